//! `/organiser/log`: every change and its author.

use crate::{
    app::App,
    extract::QueryParams,
    pages::{
        desk_frame::{Done, Head, render_desk},
        frame::{Frame, PageProblem},
        signed_in::{Organising, Refused, encoded},
    },
    problem::Problem,
    requests::EventsQuery,
    views::{
        event::{EventView, EventsView},
        season::SeasonHead,
    },
};
use askama::Template;
use axum::{
    extract::{RawQuery, State},
    response::{IntoResponse, Redirect, Response},
};

const PATH: &str = "/organiser/log";

#[derive(Template)]
#[template(path = "organiser_log.html")]
struct Page {
    frame: Frame,
    head: Head,
    events: EventsView,
    actor: String,
    subject: String,
    kind: String,
    limit: Option<u32>,
}

impl Page {
    fn details(&self, event: &EventView) -> String {
        let fields = event.details.iter();
        fields
            .map(|(name, value)| match value {
                serde_json::Value::String(text) => format!("{name}: {text}"),
                other => format!("{name}: {other}"),
            })
            .collect::<Vec<_>>()
            .join(" · ")
    }

    /// The log of one value of a field.
    fn only(&self, field: &str, value: &str) -> String {
        format!("{PATH}?{field}={}", encoded(value))
    }

    fn older(&self) -> Option<String> {
        let mut link = format!("{PATH}?before={}", self.events.next_before?);
        for (name, value) in [
            ("actor", &self.actor),
            ("subject", &self.subject),
            ("kind", &self.kind),
        ] {
            if !value.is_empty() {
                link.push_str(&format!("&{name}={}", encoded(value)));
            }
        }
        if let Some(limit) = self.limit {
            link.push_str(&format!("&limit={limit}"));
        }
        Some(link)
    }
}

/// The log was at `/log`.
pub(super) async fn moved(RawQuery(query): RawQuery) -> Redirect {
    match query {
        Some(query) => Redirect::permanent(&format!("{PATH}?{query}")),
        None => Redirect::permanent(PATH),
    }
}

pub(super) async fn page(
    organising: Result<Organising, Refused>,
    State(app): State<App>,
    query: Result<QueryParams<EventsQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let organising = match organising {
        Ok(organising) => organising,
        Err(refused) => return Ok(refused.into_response()),
    };
    let QueryParams(mut query) = query?;
    // A form sends what was left empty, too.
    for field in [&mut query.actor, &mut query.subject, &mut query.kind] {
        field.take_if(|text| text.trim().is_empty());
    }
    let filled = |field: &Option<String>| field.clone().unwrap_or_default();
    let (actor, subject, kind) = (
        filled(&query.actor),
        filled(&query.subject),
        filled(&query.kind),
    );
    let limit = query.limit;
    let season = SeasonHead::now(&app).await?.name;
    let (events, refused) = match EventsView::page(&app, query).await {
        Ok(events) => (events, None),
        Err(problem) => {
            let none = EventsView {
                events: Vec::new(),
                next_before: None,
            };
            (none, Some(problem))
        }
    };
    let page = Page {
        frame: Frame::of(&app, season, PATH),
        head: Head::of(&organising.caller, PATH, &Done::default()).refusing(refused.as_ref()),
        events,
        actor,
        subject,
        kind,
        limit,
    };
    render_desk(&page, refused.as_ref())
}
