//! A row of a list of games, with the state of the game as text.

use super::format::utc_minute;
use faceoff_api::views::game::{GameStatus, GameView, PurposeView};
use faceoff_types::{GameId, RoundNumber, TeamId, TeamName};

#[derive(Debug, Clone)]
pub(super) struct GameRow {
    pub(super) id: GameId,
    pub(super) round: RoundNumber,
    /// Number of the matchday in the round. On a matchday each team meets one opponent, or has a bye.
    pub(super) matchday: u32,
    /// Is it the second game of a mirrored pair, two games with the same seed and swapped sides?
    pub(super) is_second_of_pair: bool,
    pub(super) teams: [TeamName; 2],
    pub(super) team_ids: [TeamId; 2],
    pub(super) state: GameState,
    /// The result, or the state of the game.
    pub(super) summary: String,
    /// The team whose departure excluded the game from the standings.
    pub(super) departed_team: Option<TeamName>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GameState {
    Queued,
    Running,
    Played {
        /// Goals, and a point for every third foul of the opponent.
        score: [u32; 2],
        /// Index of the winning side; `None` for a draw.
        winner: Option<usize>,
    },
    /// Played; the result is hidden.
    Hidden,
    /// Voided, to be played again.
    Void,
    /// Failed because of a platform fault, to be played again.
    Failed,
    Cancelled,
}

/// Does a page show the results of games? Visitors can choose to hide them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ResultDisplay {
    Shown,
    Hidden,
}

impl GameRow {
    /// The row of a game of a round; `None` for test games, friendly games and repetitions of the schedule.
    pub(super) fn new(view: &GameView, results: ResultDisplay) -> Option<Self> {
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
            is_second_of_pair: second_half,
            state: game_state(&view.status, &teams, results),
            summary: summary(&view.status, results),
            departed_team: view.excluded_by.clone(),
            team_ids: sides.map(|side| side.team),
            teams,
        })
    }

    /// The side that won; `None` for draws and without a visible result.
    pub(super) const fn winner(&self) -> Option<usize> {
        match self.state {
            GameState::Played { winner, .. } => winner,
            _ => None,
        }
    }

    /// The score, or the state in a word.
    pub(super) fn score(&self) -> String {
        match self.state {
            GameState::Played {
                score: [home, away],
                ..
            } => format!("{home} : {away}"),
            GameState::Queued => "queued".to_owned(),
            GameState::Running => "live".to_owned(),
            GameState::Hidden => "played".to_owned(),
            GameState::Void => "void".to_owned(),
            GameState::Failed => "failed".to_owned(),
            GameState::Cancelled => "not played".to_owned(),
        }
    }

    pub(super) fn is_running(&self) -> bool {
        self.state == GameState::Running
    }
}

fn game_state(status: &GameStatus, teams: &[TeamName; 2], results: ResultDisplay) -> GameState {
    let is_hidden = results == ResultDisplay::Hidden;
    match status {
        GameStatus::Queued => GameState::Queued,
        GameStatus::Running { .. } => GameState::Running,
        GameStatus::Played { .. } if is_hidden => GameState::Hidden,
        GameStatus::Played { result, .. } => {
            let is_winner = |team: &TeamName| result.winner.as_ref() == Some(team);
            GameState::Played {
                score: result.score,
                winner: teams.iter().position(is_winner),
            }
        }
        GameStatus::PlatformFailed { .. } => GameState::Failed,
        GameStatus::Void { .. } => GameState::Void,
        GameStatus::Cancelled { .. } => GameState::Cancelled,
    }
}

fn summary(status: &GameStatus, results: ResultDisplay) -> String {
    let is_hidden = results == ResultDisplay::Hidden;
    match status {
        GameStatus::Queued => "waiting for a free slot".to_owned(),
        GameStatus::Running { since, .. } => format!("running since {}", utc_minute(*since)),
        GameStatus::Played { .. } if is_hidden => "result hidden".to_owned(),
        GameStatus::Played { result, .. } => match &result.winner {
            Some(winner) => format!("{winner} wins: {}", result.because),
            None => format!("draw: {}", result.because),
        },
        GameStatus::PlatformFailed { .. } => "platform fault, to be played again".to_owned(),
        // The reason is free text and may reveal the result.
        GameStatus::Void { .. } if is_hidden => "voided, to be played again".to_owned(),
        GameStatus::Void { reason, .. } => format!("voided, to be played again: {reason}"),
        GameStatus::Cancelled { .. } if is_hidden => "not played".to_owned(),
        GameStatus::Cancelled { reason, .. } => format!("not played: {reason}"),
    }
}
