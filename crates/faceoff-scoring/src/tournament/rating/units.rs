//! What is drawn as a whole by the bootstrap: a game, or a mirrored pair of games.

use crate::tournament::{game::PlayedGame, submission_label::SubmissionLabel};
use faceoff_types::TeamName;
use std::collections::BTreeMap;

/// Games that say they are a mirrored pair, and are not.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "pair {pair} of {home} against {away}: {why}; a mirrored pair is two games of one round between the same two \
     submissions, each once at home"
)]
pub struct InvalidPair {
    pair: u32,
    home: TeamName,
    away: TeamName,
    why: &'static str,
}

/// One side of a game: a team, and which of its submissions.
type Entry<'a> = (&'a TeamName, Option<&'a SubmissionLabel>);

fn sides(game: &PlayedGame) -> [Entry<'_>; 2] {
    let [home, away] = game.teams();
    let [home_label, away_label] = game.submissions();
    [(home, home_label), (away, away_label)]
}

/// The games in units, single games first. A pair of which only one half counts is a unit of one.
pub(in crate::tournament) fn units<'a>(
    games: impl IntoIterator<Item = &'a PlayedGame>,
) -> Result<Vec<Vec<&'a PlayedGame>>, InvalidPair> {
    let mut units = Vec::new();
    let mut pairs = BTreeMap::<u32, Vec<&PlayedGame>>::new();
    for game in games {
        match game.pair() {
            None => units.push(vec![game]),
            Some(pair) => pairs.entry(pair).or_default().push(game),
        }
    }
    for (pair, games) in pairs {
        if let [first, second, rest @ ..] = games.as_slice() {
            let [home, away] = sides(first);
            let why = if !rest.is_empty() {
                Some("it has more than two games")
            } else if first.round() != second.round() {
                Some("its games are of two rounds")
            } else if sides(second) != [away, home] {
                Some("its games do not have the same submissions with sides swapped")
            } else {
                None
            };
            if let Some(why) = why {
                return Err(InvalidPair {
                    pair,
                    home: home.0.clone(),
                    away: away.0.clone(),
                    why,
                });
            }
        }
        units.push(games);
    }
    Ok(units)
}
