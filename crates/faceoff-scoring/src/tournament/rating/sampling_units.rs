//! Sampling units of the bootstrap: single games, and mirrored pairs (two games with the same seed and swapped sides).

use crate::tournament::{game::PlayedGame, submission_label::SubmissionLabel};
use faceoff_types::TeamName;
use std::collections::BTreeMap;

/// Games with the same pair number that are not a mirrored pair.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "pair {pair} of {home} against {away}: {reason}; a mirrored pair is two games of one round between the same two \
     submissions, each once at home"
)]
pub struct InvalidPair {
    pair: u32,
    home: TeamName,
    away: TeamName,
    reason: &'static str,
}

/// Team and submission of one side of a game.
type SideSubmission<'a> = (&'a TeamName, Option<&'a SubmissionLabel>);

fn sides(game: &PlayedGame) -> [SideSubmission<'_>; 2] {
    let [home, away] = game.teams();
    let [home_label, away_label] = game.submissions();
    [(home, home_label), (away, away_label)]
}

/// Groups games into sampling units, single games first. Half a pair is a unit of one game if the other half does not
/// count.
pub(in crate::tournament) fn sampling_units<'a>(
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
            let reason = if !rest.is_empty() {
                Some("it has more than two games")
            } else if first.round() != second.round() {
                Some("its games are of two rounds")
            } else if sides(second) != [away, home] {
                Some("its games do not have the same submissions with sides swapped")
            } else {
                None
            };
            if let Some(reason) = reason {
                return Err(InvalidPair {
                    pair,
                    home: home.0.clone(),
                    away: away.0.clone(),
                    reason,
                });
            }
        }
        units.push(games);
    }
    Ok(units)
}
