//! `/organiser/day`: an evaluation day of a stage, on which each team's active submission is evaluated once: cutoff (the moment at which
//! submissions are frozen), expected duration, evaluations and decisions.

use crate::{
    dashboard_frame::{DashboardHeader, DoneQuery, Notice},
    format::{self, utc_minute},
    frame::{Frame, PageProblem, render},
    page_auth::PageOrganiser,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::{
    decision::DecisionView,
    evaluation::{EvaluationStatus, EvaluationView},
};
use faceoff_service::{
    app::App,
    extract::QueryParams,
    problem::Problem,
    views::{capacity, day, health, queue, season::SeasonSummary, stage},
};
use faceoff_store::StagePhase;
use faceoff_types::{EvaluationId, StageDay, StageId, StageName, TeamId, TeamName};
use jiff::civil::Date;
use serde::Deserialize;
use std::collections::BTreeSet;

#[derive(Template)]
#[template(path = "organiser_day.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    stage_day: StageDay,
    stage_name: StageName,
    /// The other stages, and the other days of this one.
    stages: Vec<(StageId, StageName)>,
    days: Vec<Date>,
    cutoff_at: Option<String>,
    deadline_at: Option<String>,
    released_at: Option<String>,
    /// Why the day was missed and evaluated later; `None` if it was not missed.
    missed_reason: Option<String>,
    next_cutoff: Option<String>,
    /// May an organiser start today's evaluation?
    can_start: bool,
    /// Is it a past date without a cutoff? An organiser can evaluate it later.
    was_missed: bool,
    is_signed_off: bool,
    paused: Option<DecisionView>,
    slots: u32,
    /// Running and queued jobs, if known.
    queue: Option<(u32, u32)>,
    /// Estimate of when the day's evaluations end, as a sentence.
    capacity_forecast: Option<String>,
    rows: Vec<Row>,
    /// Number of evaluations that have ended.
    done: usize,
    /// Teams without an evaluation, with the reason.
    excluded: Vec<(TeamId, TeamName, String)>,
    can_void: bool,
}

impl Page {
    /// Path of the decision that the day needs most now, with the label of its button.
    fn primary_action(&self) -> Option<(String, &'static str)> {
        let StageDay { stage, date } = self.stage_day;
        if self.paused.is_some() {
            return Some(("/organiser/decide/resume".to_owned(), "Resume the queue"));
        }
        if self.can_start {
            let path = format!("/organiser/decide/start-day/{stage}");
            return Some((path, "Start today’s evaluation day"));
        }
        self.was_missed.then(|| {
            let path = format!("/organiser/decide/missed-day/{stage}/{date}");
            (path, "Evaluate this missed day")
        })
    }
}

struct Row {
    id: EvaluationId,
    team: TeamId,
    name: TeamName,
    state: &'static str,
    /// CSS class of the state.
    class: &'static str,
    /// Why the evaluation is in this state, or why it is an extra one.
    detail: Option<String>,
    /// Episodes done and in total.
    progress: Option<(u32, u32)>,
    expected_end: Option<String>,
    score: Option<String>,
    can_cancel: bool,
    can_void: bool,
    can_rerun: bool,
}

/// `replaced`: the evaluations of the day that have a rerun.
fn row(view: EvaluationView, replaced: &BTreeSet<EvaluationId>) -> Row {
    let is_final = view.status.is_final();
    let (state, class, detail, score) = match view.status {
        _ if view.voided.is_some() => ("voided", "plain", None, None),
        EvaluationStatus::Queued => ("queued", "plain", None, None),
        EvaluationStatus::Running => ("running", "waiting", None, None),
        EvaluationStatus::Scoring => ("scoring", "waiting", None, None),
        EvaluationStatus::Finished { ref result, .. } => {
            let score = result
                .as_ref()
                .map(|result| format::one_decimal(result.score));
            ("finished", "good", None, score)
        }
        EvaluationStatus::AgentFailed { .. } => ("agent failed", "bad", None, None),
        EvaluationStatus::PlatformFailed { ref reason, .. } => {
            ("platform fault", "bad", Some(reason.clone()), None)
        }
        EvaluationStatus::DeadlineMissed { ref reason, .. } => {
            ("not finished in time", "bad", Some(reason.clone()), None)
        }
        EvaluationStatus::Cancelled { ref reason, .. } => {
            ("cancelled", "plain", Some(reason.clone()), None)
        }
    };
    let has_verdict = matches!(
        view.status,
        EvaluationStatus::Finished { .. } | EvaluationStatus::AgentFailed { .. }
    );
    let is_counted = has_verdict && view.voided.is_none();
    let expected_end = view.queue.and_then(|queue| queue.expected_at);
    let void_reason = view.voided.map(|decision| decision.reason);
    let extra_evaluation = view
        .extra_evaluation
        .map(|reason| format!("extra evaluation: {reason}"));
    let detail = void_reason.or(detail).or(extra_evaluation);
    Row {
        id: view.id,
        team: view.team,
        name: view.team_name,
        state,
        class,
        detail,
        progress: (!is_final)
            .then_some((view.progress.episodes_done, view.progress.episodes_total)),
        expected_end: expected_end.map(utc_minute),
        score,
        can_cancel: !is_final,
        can_void: is_counted,
        can_rerun: is_final && !is_counted && !replaced.contains(&view.id),
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Query {
    stage: Option<StageId>,
    day: Option<Date>,
    done: Option<String>,
}

/// The page of a day; without a query, of the latest day of the open stage.
pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    query: Result<QueryParams<Query>, Problem>,
) -> Result<Response, PageProblem> {
    let QueryParams(query) = query?;
    let store = &app.store;
    let now = app.config.clock.now();
    let stage = match query.stage {
        Some(id) => store.stage(id).await?,
        None => stage::current(&app).await?,
    };
    let today = stage.day(now);
    let all_days = store.days().await?;
    let mut days: Vec<_> = all_days.into_iter().map(|(day, _)| day).collect();
    days.retain(|day| day.stage_day.stage == stage.id);
    let newest_date = days.iter().map(|day| day.stage_day.date).max();
    let date = query.day.or(newest_date).unwrap_or(today.date);
    let stage_day = StageDay {
        stage: stage.id,
        date,
    };
    let day = days.iter().find(|day| day.stage_day == stage_day);
    let view = day::build(&app, stage_day).await?;
    let replaced: BTreeSet<EvaluationId> = view
        .evaluations
        .iter()
        .filter_map(|evaluation| evaluation.rerun_of)
        .collect();
    let rows: Vec<Row> = view
        .evaluations
        .into_iter()
        .map(|evaluation| row(evaluation, &replaced))
        .collect();
    let exclusion_reason = match day {
        Some(_) => "no active submission at the cutoff",
        None => "this day has had no cutoff",
    };
    let without_submission = view.without_submission.into_iter();
    let mut excluded: Vec<_> = without_submission
        .filter(|team| team.retired_at.is_none() && team.disqualified.is_none())
        .map(|team| (team.id, team.name, exclusion_reason.to_owned()))
        .collect();
    let excluded_teams = view.excluded.into_iter();
    excluded.extend(
        excluded_teams.map(|exclusion| (exclusion.team, exclusion.team_name, exclusion.reason)),
    );
    let is_archive = store.archived_season().is_some();
    let forecast = match is_archive {
        true => None,
        false => {
            let forecasts = capacity::build(&app, stage.id).await?.days;
            forecasts.into_iter().find(|forecast| forecast.day == date)
        }
    };
    let health = health::check(&app).await.ok();
    let missed_days = store.missed_days().await?;
    let mut dates: Vec<Date> = days.iter().map(|day| day.stage_day.date).collect();
    dates.sort_unstable_by(|a, b| b.cmp(a));
    let is_open = stage.phase(now) == StagePhase::Open;
    let today_has_cutoff = dates.contains(&today.date);
    let season = SeasonSummary::load(&app).await?;
    let stages = store.stages().await?;
    let notice = DoneQuery { done: query.done };
    let page = Page {
        frame: Frame::for_app(&app, season.name, "/organiser/day"),
        head: DashboardHeader::new(&user.caller, "/organiser/day", Notice::Done(&notice)),
        stages: stages
            .into_iter()
            .filter(|other| other.id != stage.id)
            .map(|other| (other.id, other.name))
            .collect(),
        cutoff_at: day.map(|day| utc_minute(day.cutoff_at)),
        deadline_at: day.and_then(|day| day.deadline_at).map(utc_minute),
        released_at: day.and_then(|day| day.released_at).map(utc_minute),
        missed_reason: missed_days
            .into_iter()
            .find_map(|(day, reason)| (day == stage_day).then_some(reason)),
        next_cutoff: day::next_cutoff(&app, &stage)
            .await?
            .map(|next| next.to_string()),
        can_start: is_open && !today_has_cutoff,
        was_missed: is_open && day.is_none() && date < today.date,
        is_signed_off: stage.sign_off.is_some(),
        paused: season.paused,
        slots: queue::slots(&app),
        queue: health.map(|health| (health.running, health.waiting)),
        capacity_forecast: forecast.map(|forecast| forecast.summary),
        done: rows.iter().filter(|row| !row.can_cancel).count(),
        can_void: rows.iter().any(|row| row.can_void || row.can_cancel),
        rows,
        excluded,
        days: dates,
        stage_name: stage.name,
        stage_day,
    };
    render(&page)
}
