//! Games of the server in tables and lines.

use crate::commands::output::or_none;
use faceoff_api::views::{
    attempt::{AttemptEndView, AttemptView},
    game::{GameStatus, GameView, PurposeView, TestGamesView},
};

/// Games, in a table.
pub(in crate::commands) fn table(games: &[GameView]) -> String {
    let wide = |side: usize| {
        let lengths = games
            .iter()
            .map(|game| game.sides[side].team_name.as_str().chars().count());
        lengths.max().unwrap_or(0).max(4)
    };
    let (home, away) = (wide(0), wide(1));
    let mut lines: Vec<String> = games
        .iter()
        .map(|game| {
            let [first, second] = &game.sides;
            format!(
                "{}  {:<11}  {:<home$}  {:<away$}  {}",
                game.id,
                place(&game.purpose),
                first.team_name,
                second.team_name,
                state(game)
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
    or_none(lines, "no game")
}

/// What [`state`] prints of a game with a result.
const COLUMNS: &str = "  score    goals    fouls   penalty points  winner and why";

/// Where it stands in the schedule, or what it is for.
fn place(purpose: &PurposeView) -> String {
    match purpose {
        PurposeView::Round {
            round, matchday, ..
        } => format!("{round}, day {matchday}"),
        PurposeView::Replay { replay, round, .. } => format!("{round}, replay {replay}"),
        PurposeView::Test { .. } => "test".to_owned(),
        PurposeView::Friendly { .. } => "friendly".to_owned(),
    }
}

fn pair(numbers: [u32; 2]) -> String {
    format!("{}-{}", numbers[0], numbers[1])
}

fn state(game: &GameView) -> String {
    let mut text = match &game.status {
        GameStatus::Queued => "queued".to_owned(),
        GameStatus::Running { attempt, .. } => format!("running, attempt {attempt}"),
        GameStatus::Broken { reason, .. } => format!("broken by our fault: {reason}"),
        GameStatus::Void { reason, .. } => format!("void: {reason}"),
        GameStatus::Cancelled { reason, .. } => format!("not played: {reason}"),
        GameStatus::Played { result, .. } => {
            let points = result.penalty_points.map(|points| format!("{points:.1}"));
            let winner = result.winner.as_ref();
            format!(
                "{:>7}  {:>7}  {:>7}  {:>15}  {}: {}",
                pair(result.score),
                pair(result.goals),
                pair(result.fouls),
                points.join(" / "),
                winner.map_or("draw", |team| team.as_str()),
                result.because
            )
        }
    };
    if let Some(team) = &game.taken_out_by {
        text.push_str(&format!(" (does not count: {team} left)"));
    }
    text
}

/// One game, in a few lines.
pub(in crate::commands) fn whole(game: &GameView) -> String {
    let [home, away] = &game.sides;
    let what = match &game.purpose {
        PurposeView::Round {
            round,
            matchday,
            meeting,
            second_half,
        } => {
            let half = if *second_half {
                ", second half of a mirrored pair"
            } else {
                ""
            };
            format!("round {round}, matchday {matchday}, meeting {meeting}{half}")
        }
        PurposeView::Test { .. } => {
            "a test game against the baseline; it does not count".to_owned()
        }
        PurposeView::Friendly { asked_by } => {
            format!("a friendly game that {asked_by} asked for; it does not count")
        }
        PurposeView::Replay { replay, round, .. } => {
            format!("of round {round}, played again (replay {replay}); it does not count")
        }
    };
    let mut lines = vec![
        format!("{} - {}", home.team_name, away.team_name),
        format!("  id        {}", game.id),
        format!("  in        {}: {what}", game.tournament_name),
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
    lines.push(format!("  stands    {}", state(game)));
    lines.push(format!("  next      {}", game.next));
    lines.join("\n")
}

/// What became of each time that a slot began a game.
pub(in crate::commands) fn attempts(attempts: &[AttemptView]) -> String {
    let line = |attempt: &AttemptView| {
        let end = match (attempt.end, attempt.ended_at) {
            (Some(end), Some(at)) => {
                let how = match end {
                    AttemptEndView::Played => "played",
                    AttemptEndView::Broken => "broken by our fault",
                    AttemptEndView::GivenBack => "given back by its slot",
                    AttemptEndView::Lost => "lost: its slot died",
                    AttemptEndView::CalledOff => "called off",
                };
                format!("{how} {}", at.strftime("%Y-%m-%d %H:%M:%S UTC"))
            }
            _ => "under way".to_owned(),
        };
        let reason = match &attempt.reason {
            Some(reason) => format!(": {reason}"),
            None => String::new(),
        };
        format!(
            "{:>3}  {}  {}  {end}{reason}",
            attempt.number,
            attempt.begun_at.strftime("%Y-%m-%d %H:%M:%S UTC"),
            attempt.worker
        )
    };
    or_none(
        attempts.iter().map(line).collect(),
        "no slot has begun it yet",
    )
}

/// Test games that were queued, and teams without one.
pub(in crate::commands) fn ordered(told: &TestGamesView) -> String {
    let mut text = table(&told.ordered);
    for team in &told.not_ordered {
        text.push_str(&format!("\n{}: none, {}", team.team_name, team.reason));
    }
    text
}
