//! The log of all changes, for the organiser.

use crate::{
    app::App,
    auth::Organiser,
    extract::QueryParams,
    problem::Problem,
    views::event::{EventView, EventsView},
};
use axum::{Json, extract::State};
use faceoff_store::{Actor, Event, EventFilter, Subject};
use serde::Deserialize;
use utoipa::IntoParams;

/// Events of a page, unless another number is asked for.
const PAGE: u32 = 100;
const LONGEST_PAGE: u32 = 1000;

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct EventsQuery {
    /// Only events before the one with this id: `next_before` of the page before.
    before: Option<i64>,
    /// Events of a page: 1 to 1000; 100 without it.
    limit: Option<u32>,
    /// Who caused it: `organiser`, `team:ID`, `schedule`, `worker:NAME`, `server`; `team` and `worker` name all of them.
    actor: Option<String>,
    /// What it is about: `season`, `stage:ID`, `day:STAGE/2026-03-01`, `team:ID`, `submission:ID`, `evaluation:ID` or `ablation:ID`.
    subject: Option<String>,
    /// What happened, e.g. `day_started`.
    kind: Option<String>,
}

/// What was changed, when and by whom, the newest first.
#[utoipa::path(
    get, path = "/events", tag = "organiser", security(("organiser" = [])),
    params(EventsQuery), responses((status = 200, body = EventsView), (status = 422))
)]
pub(crate) async fn list_events(
    _: Organiser,
    State(app): State<App>,
    QueryParams(query): QueryParams<EventsQuery>,
) -> Result<Json<EventsView>, Problem> {
    let limit = query.limit.unwrap_or(PAGE);
    if !(1..=LONGEST_PAGE).contains(&limit) {
        let detail = format!("expected 1 to {LONGEST_PAGE}, got {limit}");
        return Err(Problem::invalid("limit", detail));
    }
    let subject = query.subject.map(|text| subject(&text)).transpose()?;
    query.actor.as_deref().map(check_actor).transpose()?;
    if let Some(kind) = &query.kind {
        Event::check_kind(kind).map_err(|error| Problem::invalid("kind", error))?;
    }
    let filter = EventFilter {
        before: query.before,
        actor: query.actor,
        subject,
        kind: query.kind,
    };
    // One more tells whether there is another page.
    let mut found = app.store.newest_events(&filter, limit + 1).await?;
    let is_last = found.len() <= limit as usize;
    found.truncate(limit as usize);
    let next_before = found.last().filter(|_| !is_last).map(|event| event.id);
    Ok(Json(EventsView {
        events: found.into_iter().map(EventView::from).collect(),
        next_before,
    }))
}

fn subject(text: &str) -> Result<Subject, Problem> {
    text.parse().map_err(|_| {
        let expected = "season, stage:ID, day:STAGE/DATE, team:ID, submission:ID, evaluation:ID or ablation:ID";
        Problem::invalid("subject", format!("expected {expected}, got {text:?}"))
    })
}

fn check_actor(text: &str) -> Result<(), Problem> {
    if matches!(text, "team" | "worker") || text.parse::<Actor>().is_ok() {
        return Ok(());
    }
    let expected = "organiser, team, team:ID, schedule, worker, worker:NAME or server";
    let detail = format!("expected {expected}, got {text:?}");
    Err(Problem::invalid("actor", detail))
}
