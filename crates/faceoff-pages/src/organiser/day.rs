//! `/organiser/day`: a day of a stage: its cut, its load, its evaluations, and what can be decided about them.

use crate::{
    desk_frame::{Done, Head, Said},
    figures::{self, minute},
    frame::{Frame, PageProblem, render},
    signed_in::Organising,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::{
    evaluation::{EvaluationStatus, EvaluationView},
    ruling::RulingView,
};
use faceoff_service::{
    app::App,
    extract::QueryParams,
    problem::Problem,
    views::{capacity, day, health, queue, season::SeasonHead, stage},
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
    head: Head,
    of: StageDay,
    stage_name: StageName,
    /// The other stages, and the other days of this one.
    stages: Vec<(StageId, StageName)>,
    days: Vec<Date>,
    cut_at: Option<String>,
    deadline_at: Option<String>,
    released_at: Option<String>,
    missed: Option<String>,
    next_cut: Option<String>,
    /// Does the organiser start the day now?
    can_start: bool,
    /// A date of the past without a cut.
    was_missed: bool,
    is_signed_off: bool,
    paused: Option<RulingView>,
    /// Slots; units under way and waiting, if the queue tells.
    slots: u32,
    queue: Option<(u32, u32)>,
    load: Option<String>,
    rows: Vec<Row>,
    over: usize,
    left_out: Vec<(TeamId, TeamName, String)>,
    can_void: bool,
}

struct Row {
    id: EvaluationId,
    team: TeamId,
    name: TeamName,
    state: &'static str,
    class: &'static str,
    detail: Option<String>,
    /// Episodes played and to play.
    progress: Option<(u32, u32)>,
    expected: Option<String>,
    score: Option<String>,
    can_cancel: bool,
    can_void: bool,
    can_rerun: bool,
}

fn row(view: EvaluationView, replaced: &BTreeSet<EvaluationId>) -> Row {
    let is_final = view.status.is_final();
    let (state, class, detail, score) = match view.status {
        _ if view.voided.is_some() => ("voided", "plain", None, None),
        EvaluationStatus::Queued => ("queued", "plain", None, None),
        EvaluationStatus::Running => ("running", "waiting", None, None),
        EvaluationStatus::Finalising => ("scoring", "waiting", None, None),
        EvaluationStatus::Finished { ref result, .. } => {
            let score = result.as_ref().map(|result| figures::one(result.score));
            ("finished", "good", None, score)
        }
        EvaluationStatus::AgentFailed { .. } => ("agent failed", "bad", None, None),
        EvaluationStatus::PlatformFailed { ref reason, .. } => (
            "failed by the server’s fault",
            "bad",
            Some(reason.clone()),
            None,
        ),
        EvaluationStatus::NotPlayed { ref reason, .. } => {
            ("not played", "bad", Some(reason.clone()), None)
        }
        EvaluationStatus::Cancelled { ref reason, .. } => {
            ("cancelled", "plain", Some(reason.clone()), None)
        }
    };
    let has_ended_by_itself = matches!(
        view.status,
        EvaluationStatus::Finished { .. } | EvaluationStatus::AgentFailed { .. }
    );
    let counts = has_ended_by_itself && view.voided.is_none();
    let expected = view.queue.and_then(|queue| queue.expected_at);
    let voided = view.voided.map(|ruling| ruling.reason);
    let extra = view
        .extra_turn
        .map(|reason| format!("extra turn: {reason}"));
    let detail = voided.or(detail).or(extra);
    Row {
        id: view.id,
        team: view.team,
        name: view.team_name,
        state,
        class,
        detail,
        progress: (!is_final)
            .then_some((view.progress.episodes_done, view.progress.episodes_total)),
        expected: expected.map(minute),
        score,
        can_cancel: !is_final,
        can_void: counts,
        can_rerun: is_final && !counts && !replaced.contains(&view.id),
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Query {
    stage: Option<StageId>,
    day: Option<Date>,
    done: Option<String>,
}

/// A day; without a query the newest of the stage that is open.
pub(super) async fn page(
    organising: Organising,
    State(app): State<App>,
    query: Result<QueryParams<Query>, Problem>,
) -> Result<Response, PageProblem> {
    let QueryParams(query) = query?;
    let store = &app.store;
    let now = app.config.clock.now();
    let stage = match query.stage {
        Some(id) => store.stage(id).await.map_err(Problem::from)?,
        None => stage::current(&app).await?,
    };
    let today = stage.day(now);
    let all = store.days().await.map_err(Problem::from)?;
    let mut days: Vec<_> = all.into_iter().map(|(day, _)| day).collect();
    days.retain(|day| day.of.stage == stage.id);
    let newest = days.iter().map(|day| day.of.date).max();
    let date = query.day.or(newest).unwrap_or(today.date);
    let of = StageDay {
        stage: stage.id,
        date,
    };
    let day = days.iter().find(|day| day.of == of);
    let view = day::of(&app, of).await?;
    let replaced: BTreeSet<EvaluationId> =
        view.created.iter().filter_map(|one| one.rerun_of).collect();
    let rows: Vec<Row> = view
        .created
        .into_iter()
        .map(|one| row(one, &replaced))
        .collect();
    let without = view.without_submission.into_iter();
    let mut left_out: Vec<_> = without
        .filter(|team| team.retired_at.is_none() && team.disqualified.is_none())
        .map(|team| (team.id, team.name, "has no valid submission".to_owned()))
        .collect();
    let not_taken = view.not_taken.into_iter();
    left_out.extend(not_taken.map(|one| (one.team, one.team_name, one.reason)));
    let is_archive = store.archived().is_some();
    let load = match is_archive {
        true => None,
        false => {
            let loads = capacity::of(&app, stage.id).await?.days;
            loads.into_iter().find(|load| load.day == date)
        }
    };
    let health = health::now(&app).await.ok();
    let missed = store.missed_days().await.map_err(Problem::from)?;
    let mut dates: Vec<Date> = days.iter().map(|day| day.of.date).collect();
    dates.sort_unstable_by(|a, b| b.cmp(a));
    let is_open = stage.phase(now) == StagePhase::Open;
    let today_has_cut = dates.contains(&today.date);
    let season = SeasonHead::now(&app).await?;
    let stages = store.stages().await.map_err(Problem::from)?;
    let said = Done { done: query.done };
    let page = Page {
        frame: Frame::of(&app, season.name, "/organiser/day"),
        head: Head::of(&organising.caller, "/organiser/day", Said::Done(&said)),
        stages: stages
            .into_iter()
            .filter(|other| other.id != stage.id)
            .map(|other| (other.id, other.name))
            .collect(),
        cut_at: day.map(|day| minute(day.cut_at)),
        deadline_at: day.and_then(|day| day.deadline_at).map(minute),
        released_at: day.and_then(|day| day.released_at).map(minute),
        missed: missed
            .into_iter()
            .find_map(|(day, reason)| (day == of).then_some(reason)),
        next_cut: day::next_cut(&app, &stage)
            .await?
            .map(|next| next.to_string()),
        can_start: is_open && !today_has_cut,
        was_missed: is_open && day.is_none() && date < today.date,
        is_signed_off: stage.finalised.is_some(),
        paused: season.paused,
        slots: queue::slots(&app),
        queue: health.map(|health| (health.running, health.waiting)),
        load: load.map(|load| load.summary),
        over: rows.iter().filter(|row| !row.can_cancel).count(),
        can_void: rows.iter().any(|row| row.can_void || row.can_cancel),
        rows,
        left_out,
        days: dates,
        stage_name: stage.name,
        of,
    };
    render(&page)
}
