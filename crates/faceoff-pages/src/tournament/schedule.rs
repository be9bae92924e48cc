//! Who plays whom, round by round.

use crate::{figures::minute, game_row::GameRow, spoilers::Spoilers, tournament_words};
use faceoff_api::views::tournament::{RoundView, TournamentView};
use faceoff_types::{RoundNumber, TeamName};

/// A round, as it was drawn.
pub(super) struct Round {
    pub(super) number: RoundNumber,
    /// How far it is.
    pub(super) told: String,
    /// Who plays in it follows from results that are hidden.
    pub(super) is_withheld: bool,
    /// In the order of play.
    pub(super) games: Vec<GameRow>,
    pub(super) byes: Vec<(u32, TeamName)>,
    pub(super) groups: Vec<Vec<TeamName>>,
    pub(super) has_halves: bool,
}

impl Round {
    pub(super) fn of(
        view: &TournamentView,
        round: &RoundView,
        games: &[GameRow],
        spoilers: &Spoilers,
    ) -> Self {
        let is_withheld = is_withheld(view, round.number, spoilers);
        let own = games.iter().filter(|game| game.round == round.number);
        let byes = round.byes.iter();
        let mut drawn = Self {
            number: round.number,
            told: told(round),
            is_withheld,
            games: own.cloned().collect(),
            byes: byes
                .map(|bye| (bye.matchday, bye.team_name.clone()))
                .collect(),
            groups: round.groups.clone(),
            has_halves: view.rules.mirrored,
        };
        if is_withheld {
            drawn.games.clear();
            drawn.byes.clear();
            drawn.groups.clear();
        }
        drawn
    }
}

/// Would who plays in a round tell how games ended that are hidden?
pub(super) fn is_withheld(view: &TournamentView, round: RoundNumber, spoilers: &Spoilers) -> bool {
    tournament_words::is_drawn_from_results(&view.rules, round) && !spoilers.tell_round(round)
}

fn told(round: &RoundView) -> String {
    let progress = &round.progress;
    let mut parts = vec![format!(
        "{} of {} games played",
        progress.played, progress.games
    )];
    for (count, words) in [
        (progress.running, "being played"),
        (progress.queued, "to come"),
        (progress.to_be_rerun, "void or broken, to be played again"),
        (progress.cancelled, "called off"),
    ] {
        if count > 0 {
            parts.push(format!("{count} {words}"));
        }
    }
    let over = match round.over_at {
        Some(at) => format!(", over {}", minute(at)),
        None => String::new(),
    };
    format!(
        "{}. Started {}{over}.",
        parts.join(", "),
        minute(round.started_at)
    )
}
