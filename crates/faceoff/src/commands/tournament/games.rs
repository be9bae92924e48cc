//! Text of games. A *matchday* is a part of a round in which no team has two pairings.

use crate::commands::output::{exact_time_text, lines_or};
use faceoff_api::views::{
    attempt::{AttemptOutcomeView, GameAttemptView},
    game::{GameStatus, GameView, PurposeView, TestGamesView},
};

/// Table of games.
pub(in crate::commands) fn games_table(games: &[GameView]) -> String {
    let width = |side: usize| {
        let lengths = games
            .iter()
            .map(|game| game.sides[side].team_name.as_str().chars().count());
        lengths.max().unwrap_or(0).max(4)
    };
    let (home, away) = (width(0), width(1));
    let mut lines: Vec<String> = games
        .iter()
        .map(|game| {
            let [first, second] = &game.sides;
            format!(
                "{}  {:<11}  {:<home$}  {:<away$}  {}",
                game.id,
                purpose_text(&game.purpose),
                first.team_name,
                second.team_name,
                state_text(game)
            )
        })
        .collect();
    if !lines.is_empty() {
        lines.insert(
            0,
            format!(
                "{:<36}  {:<11}  {:<home$}  {:<away$}  {COLUMNS}",
                "id", "round", "home", "away"
            ),
        );
    }
    lines_or(lines, "no games")
}

/// Headings of the columns that [`state_text`] prints for a game with a result.
const COLUMNS: &str = "  score    goals    fouls   penalty points  winner and reason";

/// Round and matchday of a scheduled game, or the purpose of another one.
fn purpose_text(purpose: &PurposeView) -> String {
    match purpose {
        PurposeView::Round {
            round, matchday, ..
        } => format!("{round}, day {matchday}"),
        PurposeView::ScheduleReplay { replay, round, .. } => format!("{round}, replay {replay}"),
        PurposeView::Test { .. } => "test".to_owned(),
        PurposeView::Friendly { .. } => "friendly".to_owned(),
    }
}

/// Two numbers, e.g. the goals of both sides, as `3-1`.
fn hyphenated(numbers: [u32; 2]) -> String {
    format!("{}-{}", numbers[0], numbers[1])
}

fn state_text(game: &GameView) -> String {
    let mut text = match &game.status {
        GameStatus::Queued => "queued".to_owned(),
        GameStatus::Running { attempt, .. } => format!("running, attempt {attempt}"),
        GameStatus::PlatformFailed { reason, .. } => format!("platform fault: {reason}"),
        GameStatus::Void { reason, .. } => format!("void: {reason}"),
        GameStatus::Cancelled { reason, .. } => format!("cancelled: {reason}"),
        GameStatus::Played { result, .. } => {
            let points = result.penalty_points.map(|points| format!("{points:.1}"));
            let winner = result.winner.as_ref();
            format!(
                "{:>7}  {:>7}  {:>7}  {:>15}  {}: {}",
                hyphenated(result.score),
                hyphenated(result.goals),
                hyphenated(result.fouls),
                points.join(" / "),
                winner.map_or("draw", |team| team.as_str()),
                result.because
            )
        }
    };
    if let Some(team) = &game.excluded_by {
        text.push_str(&format!(" (does not count: {team} left)"));
    }
    text
}

/// A game in several lines.
pub(in crate::commands) fn game_text(game: &GameView) -> String {
    let [home, away] = &game.sides;
    let purpose = match &game.purpose {
        PurposeView::Round {
            round,
            matchday,
            // The number of the pairing of the two teams in the round's draw.
            meeting,
            second_half,
        } => {
            let half = if *second_half {
                ", second half of a mirrored pair"
            } else {
                ""
            };
            format!("round {round}, matchday {matchday}, pairing {meeting}{half}")
        }
        PurposeView::Test { .. } => "test game against the baseline, does not count".to_owned(),
        PurposeView::Friendly { requested_by } => {
            format!("friendly game requested by {requested_by}, does not count")
        }
        PurposeView::ScheduleReplay { replay, round, .. } => {
            format!("replay {replay} of round {round}, does not count")
        }
    };
    let mut lines = vec![
        format!("{} - {}", home.team_name, away.team_name),
        format!("  id        {}", game.id),
        format!("  in        {}: {purpose}", game.tournament_name),
        format!("  home      submission {}", home.submission),
        format!("  away      submission {}", away.submission),
        format!("  seed      {}", game.seed_label),
    ];
    if let GameStatus::Played { result, .. } = &game.status {
        lines.extend(result.recording.as_ref().map(|recording| {
            let public = if recording.public { ", public" } else { "" };
            format!("  recording BLAKE3 {}{public}", recording.game_blake3)
        }));
        lines.push(format!("            {COLUMNS}"));
    }
    lines.push(format!("  state     {}", state_text(game)));
    lines.push(format!("  next      {}", game.next));
    lines.join("\n")
}

/// The attempts to run a game, one per line.
pub(in crate::commands) fn attempts_text(attempts: &[GameAttemptView]) -> String {
    let line = |attempt: &GameAttemptView| {
        let end = match (attempt.end, attempt.ended_at) {
            (Some(end), Some(ended_at)) => {
                let outcome = match end {
                    AttemptOutcomeView::Played => "finished",
                    AttemptOutcomeView::PlatformFailed => "platform fault",
                    AttemptOutcomeView::Released => "released by its slot",
                    AttemptOutcomeView::Lost => "lost with its slot",
                    AttemptOutcomeView::Cancelled => "cancelled",
                };
                format!("{outcome} {}", exact_time_text(ended_at))
            }
            _ => "running".to_owned(),
        };
        let reason = match &attempt.reason {
            Some(reason) => format!(": {reason}"),
            None => String::new(),
        };
        format!(
            "{:>3}  {}  {}  {end}{reason}",
            attempt.number,
            exact_time_text(attempt.started_at),
            attempt.worker
        )
    };
    lines_or(attempts.iter().map(line).collect(), "no attempts yet")
}

/// The requested test games, and the teams without one.
pub(in crate::commands) fn test_games_text(view: &TestGamesView) -> String {
    let mut text = games_table(&view.queued);
    for team in &view.skipped {
        text.push_str(&format!("\n{}: none, {}", team.team_name, team.reason));
    }
    text
}
