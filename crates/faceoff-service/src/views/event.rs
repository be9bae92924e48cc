//! The event log, which organisers read: every change of the season, with its time, its actor (who made it) and its subject (what was
//! changed).

use crate::{app::AppState, boxed_future, problem::Problem};
use faceoff_api::{
    requests::EventsQuery,
    views::event::{EventView, EventsView},
};
use faceoff_store::{Actor, Event, EventFilter, EventRecord, Subject};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Default number of events per page.
const DEFAULT_LIMIT: u32 = 100;

/// Largest number of events per page.
const MAX_LIMIT: u32 = 1000;

/// The page of events that a query selects.
#[boxed_future]
pub async fn page(app: &AppState, query: EventsQuery) -> Result<EventsView, Problem> {
    let limit = query.limit.unwrap_or(DEFAULT_LIMIT);
    if !(1..=MAX_LIMIT).contains(&limit) {
        let detail = format!("expected 1 to {MAX_LIMIT}, got {limit}");
        return Err(Problem::invalid("limit", detail));
    }
    let subject = query.subject.map(|text| parse_subject(&text)).transpose()?;
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
    // Reading one event more shows whether there is another page.
    let mut events = app.store.newest_events(&filter, limit + 1).await?;
    let is_last = events.len() <= limit as usize;
    events.truncate(limit as usize);
    let next_before = events.last().filter(|_| !is_last).map(|event| event.id);
    let names = actor_names(app).await?;
    let view_with_name = |record: EventRecord| {
        let mut view = view(record);
        view.actor_name = names.get(&view.actor).cloned();
        view
    };
    Ok(EventsView {
        events: events.into_iter().map(view_with_name).collect(),
        next_before,
    })
}

/// Names of all users and teams, by actor as the log writes it, such as `team:ID`.
#[boxed_future]
pub async fn actor_names(app: &AppState) -> Result<BTreeMap<String, String>, Problem> {
    let users = app.store.users().await?.into_iter();
    let teams = app.store.teams().await?.into_iter();
    let users = users.map(|user| (Actor::User(user.id).to_string(), user.name.to_string()));
    let teams = teams.map(|team| (Actor::Team(team.id).to_string(), team.name.to_string()));
    Ok(users.chain(teams).collect())
}

fn parse_subject(text: &str) -> Result<Subject, Problem> {
    text.parse().map_err(|_| {
        let expected = "season, stage:ID, day:STAGE/DATE, team:ID, submission:ID, evaluation:ID, ablation:ID, \
                        person:ID, registration:ID, announcement:ID, question:ID, proposal:ID, tournament:ID or game:ID";
        Problem::invalid("subject", format!("expected {expected}, got {text:?}"))
    })
}

fn check_actor(text: &str) -> Result<(), Problem> {
    if matches!(text, "team" | "person" | "worker") || text.parse::<Actor>().is_ok() {
        return Ok(());
    }
    let expected = "organiser, person, person:ID, team, team:ID, visitor, schedule, worker, worker:NAME or server";
    let detail = format!("expected {expected}, got {text:?}");
    Err(Problem::invalid("actor", detail))
}

/// An event, without its actor's name.
pub fn view(record: EventRecord) -> EventView {
    let mut details = match serde_json::to_value(&record.event) {
        Ok(Value::Object(details)) => details,
        _ => Map::new(),
    };
    let kind = match details.remove("kind") {
        Some(Value::String(kind)) => kind,
        _ => String::new(),
    };
    EventView {
        id: record.id,
        at: record.at,
        actor: record.actor.to_string(),
        actor_name: None,
        subject: record.subject.to_string(),
        kind,
        details,
    }
}
