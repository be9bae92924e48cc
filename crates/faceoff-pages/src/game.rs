//! `/games/{id}`: a game, live while it is played; what it came to and why, how that came about, and its replay.

mod course;
mod live;
mod play;

use super::{
    assets, figures,
    frame::{Frame, PageProblem, render},
    spoilers::Spoilers,
    table_drawing::Ground,
};
use askama::Template;
use axum::{extract::State, response::Response};
use course::TimeLine;
use faceoff_api::{
    paths,
    views::game::{GameResultView, GameStatus, PurposeView},
};
use faceoff_replay::{GameAnalysis, model::CONTROL_STEP_S};
use faceoff_service::{
    app::App,
    extract::PathParam,
    problem::Problem,
    viewer::Viewer,
    views::{game, game_clips::GameClips, game_live::GameLive, season::SeasonHead},
};
use faceoff_types::{GameId, Side, SubmissionId, TeamId, TournamentId};
use live::Live;
use play::{Possession, Safety, Shots, Speeds};

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

/// A game whose result is told.
struct Played {
    score: [u32; 2],
    winner: Option<String>,
    because: String,
    duration_min: String,
    lines: Vec<Line>,
}

/// How the result came about, by the clips.
struct Play {
    time_line: TimeLine,
    possession: Possession,
    shots: [Shots; 2],
    speeds: Option<Speeds>,
    safety: [Safety; 2],
}

#[derive(Template)]
#[template(path = "game.html")]
struct Page {
    frame: Frame,
    spoilers: Spoilers,
    id: GameId,
    tournament: TournamentId,
    tournament_name: String,
    teams: [String; 2],
    team_ids: [TeamId; 2],
    submissions: [SubmissionId; 2],
    purpose: String,
    /// Test games may be against a team that is not in the tournament.
    is_of_round: bool,
    state: String,
    /// The team by whose leaving it does not count.
    taken_out_by: Option<String>,
    next: String,
    /// Is it, or may it be, played by and by?
    is_open: bool,
    live: Option<Live>,
    /// Has it a result?
    has_result: bool,
    played: Option<Played>,
    play: Option<Play>,
    replay: Option<Chunks>,
    ground: Ground,
    styles: [&'static str; 2],
    script: &'static str,
}

impl Page {
    /// Where its stream is, of a game whose course may be told.
    fn stream(&self) -> Option<String> {
        (self.is_open && !self.spoilers.hide()).then(|| format!("{}/live", paths::game(self.id)))
    }

    fn told(&self) -> String {
        self.live.as_ref().map(Live::told).unwrap_or_default()
    }
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    spoilers: Spoilers,
    id: Result<PathParam<GameId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let viewer = viewer?;
    let view = game::find(&app, viewer, id).await?;
    let season = SeasonHead::now(&app).await?;
    let teams = view.sides.each_ref().map(|side| side.team_name.to_string());
    let is_hidden = spoilers.hide();
    let (mut live, mut played, mut play, mut replay) = (None, None, None, None);
    match &view.status {
        GameStatus::Running { since, .. } if !is_hidden => {
            let now = app.config.clock.now();
            live = GameLive::of(&app, id).map(|live| Live::of(&live, &teams, *since, now));
        }
        GameStatus::Played { result, .. } => {
            let clips = GameClips::of(&app, viewer, id).await.ok();
            // A game that was forfeited is shorter than the rules have it, which would tell how it ended.
            let steps = match is_hidden {
                true => rules_steps(&app, view.tournament).await?,
                false => result.steps,
            };
            replay = clips.as_ref().map(|clips| Chunks::of(id, clips, steps));
            if !is_hidden {
                played = Some(Played::of(result));
                if let Some(clips) = &clips {
                    let analysis = clips.analysis(&app, result.steps).await?;
                    play = Some(Play::of(&analysis, &teams));
                }
            }
        }
        _ => {}
    }
    render(&Page {
        frame: Frame::of(
            &app,
            season.name,
            format!("/tournaments/{}", view.tournament),
        ),
        id,
        tournament: view.tournament,
        tournament_name: view.tournament_name.to_string(),
        team_ids: view.sides.each_ref().map(|side| side.team),
        submissions: view.sides.each_ref().map(|side| side.submission),
        is_of_round: matches!(view.purpose, PurposeView::Round { .. }),
        purpose: in_words(&view.purpose),
        state: state(&view.status, is_hidden),
        taken_out_by: view.taken_out_by.map(|team| team.to_string()),
        next: view.next,
        is_open: matches!(view.status, GameStatus::Queued | GameStatus::Running { .. }),
        has_result: matches!(view.status, GameStatus::Played { .. }),
        teams,
        live,
        played,
        play,
        replay,
        ground: Ground::new(),
        styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
        script: assets::REPLAY_SCRIPT.url(),
        spoilers,
    })
}

/// Control steps of each game of a tournament, if none forfeits.
async fn rules_steps(app: &App, tournament: TournamentId) -> Result<u32, Problem> {
    Ok(app.store.tournament(tournament).await?.rules.steps)
}

impl Chunks {
    fn of(id: GameId, clips: &GameClips, steps: u32) -> Self {
        let api = paths::game(id);
        let seen = Side::BOTH.into_iter().find(|side| clips.sees[side.index()]);
        Self {
            motion: format!("{api}/motion/{{chunk}}"),
            observed: seen.map(|side| format!("{api}/sides/{}/observed/{{chunk}}", side.number())),
            samples: steps.saturating_add(1),
        }
    }
}

impl Play {
    fn of(analysis: &GameAnalysis, teams: &[String; 2]) -> Self {
        Self {
            time_line: TimeLine::of(analysis, teams),
            possession: Possession::of(analysis),
            shots: [0, 1].map(|side| Shots::of(analysis, side, &teams[side])),
            speeds: Speeds::of(analysis, teams),
            safety: [0, 1].map(|side| Safety::of(analysis, side, &teams[side])),
        }
    }
}

impl Played {
    fn of(result: &GameResultView) -> Self {
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
        Self {
            score: result.score,
            winner: result.winner.as_ref().map(ToString::to_string),
            because: result.because.clone(),
            duration_min: figures::one(f64::from(result.steps) * CONTROL_STEP_S / 60.0),
            lines,
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

fn state(status: &GameStatus, is_hidden: bool) -> String {
    match status {
        GameStatus::Queued => "It waits for a slot.".to_owned(),
        GameStatus::Running { since, .. } => {
            format!("It is being played since {}.", since.strftime("%H:%M UTC"))
        }
        GameStatus::Played { finished_at, .. } => {
            format!("Played on {}.", finished_at.strftime("%Y-%m-%d, %H:%M UTC"))
        }
        GameStatus::Broken { reason, .. } => format!("It was broken by our fault: {reason}"),
        // Reasons are somebody's own words, and may tell how it went.
        GameStatus::Void { .. } if is_hidden => "Its result was voided.".to_owned(),
        GameStatus::Cancelled { .. } if is_hidden => "It is not played.".to_owned(),
        GameStatus::Void { reason, .. } => format!("Its result was voided: {reason}"),
        GameStatus::Cancelled { reason, .. } => format!("It is not played: {reason}"),
    }
}
