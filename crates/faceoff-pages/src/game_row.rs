//! A game in a list of games, and how it stands in words.

use super::figures::minute;
use faceoff_api::views::game::{GameStatus, GameView, PurposeView};
use faceoff_types::{GameId, RoundNumber, TeamId, TeamName};

/// A game of a list.
#[derive(Debug, Clone)]
pub(super) struct GameRow {
    pub(super) id: GameId,
    pub(super) round: RoundNumber,
    pub(super) matchday: u32,
    pub(super) is_second_half: bool,
    pub(super) teams: [TeamName; 2],
    pub(super) team_ids: [TeamId; 2],
    pub(super) stands: Stands,
    /// What came of it, or how it stands.
    pub(super) told: String,
    /// The team by whose leaving it does not count.
    pub(super) taken_out_by: Option<TeamName>,
}

/// How a game of a list stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stands {
    Waits,
    Running,
    /// With the score that counts, and which side won.
    Played {
        score: [u32; 2],
        winner: Option<usize>,
    },
    /// It has a result that is not told here.
    Untold,
    /// It is to be played again.
    Void,
    Broken,
    Cancelled,
}

impl GameRow {
    /// Of a round's game, or of one that is played again; `None` of others. Without what it came to, if that `is_hidden`.
    pub(super) fn of(view: &GameView, is_hidden: bool) -> Option<Self> {
        let PurposeView::Round {
            round,
            matchday,
            second_half,
            ..
        } = view.purpose
        else {
            return None;
        };
        let sides = view.sides.each_ref();
        let teams = sides.map(|side| side.team_name.clone());
        Some(Self {
            id: view.id,
            round,
            matchday,
            is_second_half: second_half,
            stands: stands(&view.status, &teams, is_hidden),
            told: told(&view.status, is_hidden),
            taken_out_by: view.taken_out_by.clone(),
            team_ids: sides.map(|side| side.team),
            teams,
        })
    }

    /// Which side won, of a game whose result is told.
    pub(super) const fn winner(&self) -> Option<usize> {
        match self.stands {
            Stands::Played { winner, .. } => winner,
            _ => None,
        }
    }

    /// As tables have it; a word where there is no score.
    pub(super) fn score(&self) -> String {
        match self.stands {
            Stands::Played {
                score: [home, away],
                ..
            } => format!("{home} : {away}"),
            Stands::Waits => "to come".to_owned(),
            Stands::Running => "live".to_owned(),
            Stands::Untold => "played".to_owned(),
            Stands::Void => "void".to_owned(),
            Stands::Broken => "broken".to_owned(),
            Stands::Cancelled => "not played".to_owned(),
        }
    }

    pub(super) fn is_running(&self) -> bool {
        self.stands == Stands::Running
    }
}

fn stands(status: &GameStatus, teams: &[TeamName; 2], is_hidden: bool) -> Stands {
    match status {
        GameStatus::Queued => Stands::Waits,
        GameStatus::Running { .. } => Stands::Running,
        GameStatus::Played { .. } if is_hidden => Stands::Untold,
        GameStatus::Played { result, .. } => {
            let is_winner = |team: &TeamName| result.winner.as_ref() == Some(team);
            Stands::Played {
                score: result.score,
                winner: teams.iter().position(is_winner),
            }
        }
        GameStatus::Broken { .. } => Stands::Broken,
        GameStatus::Void { .. } => Stands::Void,
        GameStatus::Cancelled { .. } => Stands::Cancelled,
    }
}

fn told(status: &GameStatus, is_hidden: bool) -> String {
    match status {
        GameStatus::Queued => "waits for a slot".to_owned(),
        GameStatus::Running { since, .. } => format!("being played since {}", minute(*since)),
        GameStatus::Played { .. } if is_hidden => "result hidden".to_owned(),
        GameStatus::Played { result, .. } => match &result.winner {
            Some(winner) => format!("{winner} wins: {}", result.because),
            None => format!("a draw: {}", result.because),
        },
        GameStatus::Broken { .. } => "broken by the server’s fault, to be played again".to_owned(),
        // Reasons are somebody's own words, and may tell how it went.
        GameStatus::Void { .. } if is_hidden => "voided, to be played again".to_owned(),
        GameStatus::Void { reason, .. } => format!("voided, to be played again: {reason}"),
        GameStatus::Cancelled { .. } if is_hidden => "called off".to_owned(),
        GameStatus::Cancelled { reason, .. } => format!("called off: {reason}"),
    }
}
