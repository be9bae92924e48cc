//! `/games/{id}`: a game, what it came to and why, and its replay.

use super::{
    assets, figures,
    frame::{Frame, PageProblem, render},
};
use crate::{
    app::App,
    extract::PathParam,
    paths,
    problem::Problem,
    viewer::Viewer,
    views::{
        game::{GameResultView, GameStatus, GameView, PurposeView},
        game_clips::GameClips,
        season::SeasonHead,
    },
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_replay::model::CONTROL_STEP_S;
use faceoff_types::{GameId, Side};

/// A line of the table: what it counts, and each side's number.
struct Line {
    what: &'static str,
    sides: [String; 2],
}

/// Where the script finds the clips.
struct Chunks {
    motion: String,
    observed: Option<String>,
    samples: u32,
}

/// A game with a result.
struct Played {
    score: [u32; 2],
    winner: Option<String>,
    because: String,
    duration_min: String,
    lines: Vec<Line>,
    chunks: Option<Chunks>,
}

#[derive(Template)]
#[template(path = "game.html")]
struct Page {
    frame: Frame,
    id: GameId,
    tournament: String,
    teams: [String; 2],
    team_ids: [String; 2],
    purpose: String,
    state: String,
    next: String,
    played: Option<Played>,
    styles: [&'static str; 2],
    script: &'static str,
}

/// A game.
pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<GameId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let viewer = viewer?;
    let view = GameView::find(&app, viewer, id).await?;
    let season = SeasonHead::now(&app).await?;
    let played = match &view.status {
        GameStatus::Played { result, .. } => {
            let clips = GameClips::of(&app, viewer, id).await.ok();
            Some(Played::of(id, result, clips.as_ref()))
        }
        _ => None,
    };
    render(&Page {
        frame: Frame::of(&app, season.name, ""),
        id,
        tournament: view.tournament_name.to_string(),
        teams: view.sides.each_ref().map(|side| side.team_name.to_string()),
        team_ids: view.sides.each_ref().map(|side| side.team.to_string()),
        purpose: in_words(&view.purpose),
        state: state(&view.status),
        next: view.next,
        played,
        styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
        script: assets::REPLAY_SCRIPT.url(),
    })
}

impl Played {
    fn of(id: GameId, result: &GameResultView, clips: Option<&GameClips>) -> Self {
        let line = |what, sides: [String; 2]| Line { what, sides };
        let counts = |what, sides: [u32; 2]| line(what, sides.map(|count| count.to_string()));
        let milliseconds = |of: [f64; 2]| of.map(|s| format!("{} ms", figures::milliseconds(s)));
        let times = &result.computation_time_s;
        let lines = vec![
            counts("Goals on the table", result.goals),
            counts("Fouls", result.fouls),
            line("Penalty points", result.penalty_points.map(figures::one)),
            line(
                "Tier",
                result.tiers.each_ref().map(|tier| tier.title().to_owned()),
            ),
            counts("Faults", result.faults),
            counts("Answers too late", result.late_answers),
            line(
                "Mean computation time",
                milliseconds([times[0].mean, times[1].mean]),
            ),
            line(
                "Longest computation time",
                milliseconds([times[0].max, times[1].max]),
            ),
        ];
        let api = paths::game(id);
        let chunks = clips.map(|clips| {
            let seen = Side::BOTH.into_iter().find(|side| clips.sees[side.index()]);
            Chunks {
                motion: format!("{api}/motion/{{chunk}}"),
                observed: seen
                    .map(|side| format!("{api}/sides/{}/observed/{{chunk}}", side.number())),
                samples: result.steps.saturating_add(1),
            }
        });
        Self {
            score: result.score,
            winner: result.winner.as_ref().map(ToString::to_string),
            because: result.because.clone(),
            duration_min: figures::one(f64::from(result.steps) * CONTROL_STEP_S / 60.0),
            lines,
            chunks,
        }
    }
}

fn in_words(purpose: &PurposeView) -> String {
    match purpose {
        PurposeView::Round {
            round,
            matchday,
            meeting,
            second_half,
        } => {
            let half = if *second_half {
                ", second game of the pair"
            } else {
                ""
            };
            format!("Round {round}, matchday {matchday}, meeting {meeting}{half}")
        }
        PurposeView::Test { .. } => "A test game: it does not count".to_owned(),
        PurposeView::Friendly { .. } => "A friendly game: it does not count".to_owned(),
        PurposeView::Replay { replay, round, .. } => {
            format!("The schedule played again, time {replay}: a game of round {round}")
        }
    }
}

fn state(status: &GameStatus) -> String {
    match status {
        GameStatus::Queued => "It waits for a slot.".to_owned(),
        GameStatus::Running { since, .. } => {
            format!("It is being played since {}.", since.strftime("%H:%M UTC"))
        }
        GameStatus::Played { finished_at, .. } => {
            format!("Played on {}.", finished_at.strftime("%Y-%m-%d, %H:%M UTC"))
        }
        GameStatus::Broken { reason, .. } => format!("It was broken by our fault: {reason}"),
        GameStatus::Void { reason, .. } => format!("Its result was voided: {reason}"),
        GameStatus::Cancelled { reason, .. } => format!("It is not played: {reason}"),
    }
}
