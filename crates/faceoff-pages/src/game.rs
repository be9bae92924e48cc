//! `/games/{id}`: a game of a tournament between the agents of two teams: live view, result, timeline, analysis and replay.

mod analysis;
mod live;
mod replay;
mod score_timeline;

use super::{
    assets, format,
    frame::{Frame, PageProblem, render},
    spoilers::Spoilers,
    table_drawing::TableOutline,
};
use analysis::{Possession, Shots, Speeds, Violations};
use askama::Template;
use axum::{extract::State, response::Response};
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
    views::{game, game_clips::GameClips, live_game::LiveGameView},
};
use faceoff_types::{GameId, SubmissionId, TeamId, TournamentId};
use live::LiveGame;
use replay::GameReplay;
pub(super) use replay::embedded;
use score_timeline::ScoreTimeline;

/// A row of the table of statistics.
struct Statistic {
    name: &'static str,
    sides: [String; 2],
}

/// A result that is not hidden.
struct GameResult {
    score: [u32; 2],
    winner: Option<String>,
    /// Why the winner won, or why it is a draw.
    reason: String,
    duration_min: String,
    statistics: Vec<Statistic>,
}

/// Timeline and analysis of a game, from its clips.
struct GameSections {
    timeline: ScoreTimeline,
    possession: Possession,
    shots: [Shots; 2],
    speeds: Option<Speeds>,
    violations: [Violations; 2],
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
    /// Does the game belong to a round? Test games may have a team from outside the tournament.
    is_round_game: bool,
    state: String,
    /// The team whose departure excluded the game from the standings.
    departed_team: Option<String>,
    /// What happens next, as a sentence.
    next_step: String,
    /// Is the game queued or running?
    is_open: bool,
    live: Option<LiveGame>,
    /// Has the game a result, hidden or not?
    has_result: bool,
    /// `None` if there is no result, or if it is hidden.
    result: Option<GameResult>,
    sections: Option<GameSections>,
    replay: Option<GameReplay>,
    table: TableOutline,
    styles: [&'static str; 2],
    script: &'static str,
}

impl Page {
    /// Address of the live stream, unless results are hidden.
    fn stream(&self) -> Option<String> {
        (self.is_open && !self.spoilers.hides_results())
            .then(|| format!("{}/live", paths::game(self.id)))
    }

    /// Text for screen readers after a live update.
    fn live_text(&self) -> String {
        self.live
            .as_ref()
            .map(LiveGame::live_text)
            .unwrap_or_default()
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
    let teams = view.sides.each_ref().map(|side| side.team_name.to_string());
    let is_hidden = spoilers.hides_results();
    // What is `None` is not on the page.
    let (mut live, mut shown_result, mut sections, mut replay) = (None, None, None, None);
    match &view.status {
        GameStatus::Running { since, .. } if !is_hidden => {
            let now = app.config.clock.now();
            live =
                LiveGameView::find(&app, id).map(|live| LiveGame::new(&live, &teams, *since, now));
        }
        GameStatus::Played { result, .. } => {
            let clips = GameClips::find(&app, viewer, id).await.ok();
            // A forfeited game is shorter than the rules say. If results are hidden, the replay has the full length, since its own
            // length would reveal the forfeit.
            let steps = match is_hidden {
                true => full_game_steps(&app, view.tournament).await?,
                false => result.steps,
            };
            let analysis = match &clips {
                Some(clips) if !is_hidden => Some(clips.analysis(&app, result.steps).await?),
                _ => None,
            };
            replay = clips
                .as_ref()
                .map(|clips| GameReplay::new(&view, clips, steps, analysis.as_deref()));
            if !is_hidden {
                shown_result = Some(GameResult::new(result));
                sections = analysis.map(|analysis| GameSections::new(&analysis, &teams));
            }
        }
        _ => {}
    }
    render(&Page {
        frame: Frame::load(&app, format!("/tournaments/{}", view.tournament))
            .await?
            .with_address(&app, &format!("/games/{id}"))
            .with_card(
                &app,
                &format!("/games/{id}/card.png"),
                format!("{} against {} at the table, from above", teams[0], teams[1]),
            ),
        id,
        tournament: view.tournament,
        tournament_name: view.tournament_name.to_string(),
        team_ids: view.sides.each_ref().map(|side| side.team),
        submissions: view.sides.each_ref().map(|side| side.submission),
        is_round_game: matches!(view.purpose, PurposeView::Round { .. }),
        purpose: purpose_text(&view.purpose),
        state: state_text(&view.status, is_hidden),
        departed_team: view.excluded_by.map(|team| team.to_string()),
        next_step: view.next,
        is_open: matches!(view.status, GameStatus::Queued | GameStatus::Running { .. }),
        has_result: matches!(view.status, GameStatus::Played { .. }),
        teams,
        live,
        result: shown_result,
        sections,
        replay,
        table: TableOutline::new(),
        styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
        script: assets::REPLAY_SCRIPT.url(),
        spoilers,
    })
}

/// Control steps of a full game of the tournament.
async fn full_game_steps(app: &App, tournament: TournamentId) -> Result<u32, Problem> {
    Ok(app.store.tournament(tournament).await?.rules.steps)
}

impl GameSections {
    fn new(analysis: &GameAnalysis, teams: &[String; 2]) -> Self {
        Self {
            timeline: ScoreTimeline::new(analysis, teams),
            possession: Possession::new(analysis),
            shots: [0, 1].map(|side| Shots::new(analysis, side, &teams[side])),
            speeds: Speeds::new(analysis, teams),
            violations: [0, 1].map(|side| Violations::new(analysis, side, &teams[side])),
        }
    }
}

impl GameResult {
    fn new(result: &GameResultView) -> Self {
        let statistic = |name, sides: [String; 2]| Statistic { name, sides };
        let counts = |name, sides: [u32; 2]| statistic(name, sides.map(|count| count.to_string()));
        let milliseconds = |seconds: [f64; 2]| {
            seconds.map(|seconds| format!("{} ms", format::milliseconds(seconds)))
        };
        let times = &result.computation_time_s;
        let statistics = vec![
            counts("Goals on the table", result.goals),
            counts("Fouls", result.fouls),
            statistic(
                "Penalty points",
                result.penalty_points.map(format::one_decimal),
            ),
            statistic(
                "Tier",
                result.tiers.each_ref().map(|tier| tier.title().to_owned()),
            ),
            counts("Faults", result.faults),
            counts("Late answers", result.late_answers),
            statistic(
                "Mean computation time",
                milliseconds([times[0].mean, times[1].mean]),
            ),
            statistic(
                "Maximum computation time",
                milliseconds([times[0].max, times[1].max]),
            ),
        ];
        Self {
            score: result.score,
            winner: result.winner.as_ref().map(ToString::to_string),
            reason: result.because.clone(),
            duration_min: format::one_decimal(f64::from(result.steps) * CONTROL_STEP_S / 60.0),
            statistics,
        }
    }
}

fn purpose_text(purpose: &PurposeView) -> String {
    match purpose {
        PurposeView::Round {
            round,
            matchday,
            meeting,
            second_half,
        } => {
            let game_of_pair = if *second_half {
                ", second game of the pair"
            } else {
                ""
            };
            format!("Round {round}, matchday {matchday}, pairing {meeting}{game_of_pair}")
        }
        PurposeView::Test { .. } => "Test game; it does not count".to_owned(),
        PurposeView::Friendly { .. } => "Friendly game; it does not count".to_owned(),
        PurposeView::ScheduleReplay { replay, round, .. } => {
            format!("Repetition {replay} of the schedule, game of round {round}; it does not count")
        }
    }
}

fn state_text(status: &GameStatus, is_hidden: bool) -> String {
    match status {
        GameStatus::Queued => "Waiting for a free slot.".to_owned(),
        GameStatus::Running { since, .. } => {
            format!("Running since {}.", since.strftime("%H:%M UTC"))
        }
        GameStatus::Played { finished_at, .. } => {
            format!("Played on {}.", finished_at.strftime("%Y-%m-%d, %H:%M UTC"))
        }
        GameStatus::PlatformFailed { reason, .. } => {
            format!("Failed because of a platform fault: {reason}")
        }
        // The reason is free text and may reveal the result.
        GameStatus::Void { .. } if is_hidden => "The result was voided.".to_owned(),
        GameStatus::Cancelled { .. } if is_hidden => "Not played.".to_owned(),
        GameStatus::Void { reason, .. } => format!("The result was voided: {reason}"),
        GameStatus::Cancelled { reason, .. } => format!("Not played: {reason}"),
    }
}
