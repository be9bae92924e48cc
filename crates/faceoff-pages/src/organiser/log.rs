//! `/organiser/log`: every change and its author.

use crate::{
    desk_frame::{Head, Said, render_desk},
    frame::{Frame, PageProblem},
    query::asking,
    signed_in::Organising,
};
use askama::Template;
use axum::{
    extract::{RawQuery, State},
    response::{Redirect, Response},
};
use faceoff_api::{
    requests::EventsQuery,
    views::event::{EventView, EventsView},
};
use faceoff_service::{
    app::App,
    extract::QueryParams,
    problem::Problem,
    views::{event, season::SeasonHead},
};

const PATH: &str = "/organiser/log";

#[derive(Template)]
#[template(path = "organiser_log.html")]
struct Page {
    frame: Frame,
    head: Head,
    events: EventsView,
    query: EventsQuery,
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
        asking(PATH, &[(field, value)])
    }

    fn older(&self) -> Option<String> {
        let older = EventsQuery {
            before: Some(self.events.next_before?),
            ..self.query.clone()
        };
        Some(asking(PATH, &older))
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
    organising: Organising,
    State(app): State<App>,
    query: Result<QueryParams<EventsQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let QueryParams(mut query) = query?;
    // A form sends what was left empty, too.
    for field in [&mut query.actor, &mut query.subject, &mut query.kind] {
        field.take_if(|text| text.trim().is_empty());
    }
    let season = SeasonHead::now(&app).await?.name;
    let (events, refused) = match event::page(&app, query.clone()).await {
        Ok(events) => (events, None),
        Err(problem) => {
            let none = EventsView {
                events: Vec::new(),
                next_before: None,
            };
            (none, Some(problem))
        }
    };
    let said = refused.as_ref().map_or(Said::Nothing, Said::Refused);
    let page = Page {
        frame: Frame::of(&app, season, PATH),
        head: Head::of(&organising.caller, PATH, said),
        events,
        query,
    };
    render_desk(&page, said)
}
