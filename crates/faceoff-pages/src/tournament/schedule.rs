//! Schedule of a tournament, round by round.

use crate::{format::utc_minute, game_row::GameRow, spoilers::Spoilers, tournament_text};
use faceoff_api::views::tournament::{RoundView, TournamentView};
use faceoff_types::{RoundNumber, TeamName};

pub(super) struct Round {
    pub(super) number: RoundNumber,
    pub(super) progress: String,
    /// Are the pairings hidden, because they would reveal hidden results?
    pub(super) is_hidden: bool,
    /// In the order of play.
    pub(super) games: Vec<GameRow>,
    /// Byes: matchday, and the team that has no opponent on it.
    pub(super) byes: Vec<(u32, TeamName)>,
    /// Teams of each group; empty without a group stage.
    pub(super) groups: Vec<Vec<TeamName>>,
    /// Does each pairing play a mirrored pair of games?
    pub(super) has_mirrored_pairs: bool,
}

impl Round {
    pub(super) fn new(
        view: &TournamentView,
        round: &RoundView,
        games: &[GameRow],
        spoilers: &Spoilers,
    ) -> Self {
        let is_hidden = is_hidden(view, round.number, spoilers);
        let round_games = games.iter().filter(|game| game.round == round.number);
        let byes = round.byes.iter();
        let mut schedule = Self {
            number: round.number,
            progress: progress_text(round),
            is_hidden,
            games: round_games.cloned().collect(),
            byes: byes
                .map(|bye| (bye.matchday, bye.team_name.clone()))
                .collect(),
            groups: round.groups.clone(),
            has_mirrored_pairs: view.rules.mirrored,
        };
        if is_hidden {
            schedule.games.clear();
            schedule.byes.clear();
            schedule.groups.clear();
        }
        schedule
    }
}

/// Would the pairings of a round reveal hidden results?
pub(super) fn is_hidden(view: &TournamentView, round: RoundNumber, spoilers: &Spoilers) -> bool {
    tournament_text::is_drawn_from_results(&view.rules, round) && !spoilers.shows_round(round)
}

fn progress_text(round: &RoundView) -> String {
    let progress = &round.progress;
    let mut parts = vec![format!(
        "{} of {} games played",
        progress.played, progress.games
    )];
    for (count, label) in [
        (progress.running, "running"),
        (progress.queued, "queued"),
        (progress.to_be_rerun, "void or failed, to be played again"),
        (progress.cancelled, "not played"),
    ] {
        if count > 0 {
            parts.push(format!("{count} {label}"));
        }
    }
    let end = match round.ended_at {
        Some(at) => format!(", finished {}", utc_minute(at)),
        None => String::new(),
    };
    format!(
        "{}. Started {}{end}.",
        parts.join(", "),
        utc_minute(round.started_at)
    )
}
