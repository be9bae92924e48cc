//! `/organiser/log`: all changes as sentences with their authors.

mod names;
mod sentence;

use crate::{
    dashboard_frame::{DashboardHeader, Notice, render_dashboard},
    frame::{Frame, PageProblem},
    page_auth::PageOrganiser,
    query::with_query,
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
use faceoff_service::{app::App, extract::QueryParams, problem::Problem, views::event};
use names::Names;
use sentence::sentence;

const PATH: &str = "/organiser/log";

#[derive(Template)]
#[template(path = "organiser_log.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    entries: Vec<Entry>,
    /// Id of the event before which the next page of older events ends.
    next_before: Option<i64>,
    /// Users and teams: identifier and name.
    authors: Vec<(String, String)>,
    query: EventsQuery,
}

/// A line of the log.
struct Entry {
    event: EventView,
    sentence: String,
}

impl Page {
    fn details(&self, event: &EventView) -> String {
        let fields = event.details.iter();
        let fields = fields.filter(|(name, _)| *name != "reason");
        fields
            .map(|(name, value)| match value {
                serde_json::Value::String(text) => format!("{name}: {text}"),
                other => format!("{name}: {other}"),
            })
            .collect::<Vec<_>>()
            .join(" · ")
    }

    /// The author as the log stores it, with a word about those without an account.
    fn stored_author(&self, event: &EventView) -> String {
        match event.actor.as_str() {
            "organiser" => "organiser (the operator)".to_owned(),
            "visitor" if event.subject.starts_with("person:") => {
                "a visitor, with an invitation".to_owned()
            }
            actor => actor.to_owned(),
        }
    }

    /// Is this the chosen author?
    fn is_chosen(&self, author: &str) -> bool {
        self.query.actor.as_deref() == Some(author)
    }

    /// Address of the log filtered by a field.
    fn filter_link(&self, field: &str, value: &str) -> String {
        with_query(PATH, &[(field, value)])
    }

    fn older_link(&self) -> Option<String> {
        let older = EventsQuery {
            before: Some(self.next_before?),
            ..self.query.clone()
        };
        Some(with_query(PATH, &older))
    }
}

/// Redirects from `/log`, the address in older versions.
pub(super) async fn redirect_old_path(RawQuery(query): RawQuery) -> Redirect {
    match query {
        Some(query) => Redirect::permanent(&format!("{PATH}?{query}")),
        None => Redirect::permanent(PATH),
    }
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    query: Result<QueryParams<EventsQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let QueryParams(mut query) = query?;
    // A form also sends empty fields.
    for field in [&mut query.actor, &mut query.subject, &mut query.kind] {
        field.take_if(|text| text.trim().is_empty());
    }
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
    let notice = refused.as_ref().map_or(Notice::None, Notice::Refused);
    let names = Names::load(&app, &events.events).await?;
    let entries = events.events.into_iter().map(|event| Entry {
        sentence: sentence(&event, &names),
        event,
    });
    let page = Page {
        frame: Frame::load(&app, PATH).await?,
        head: DashboardHeader::new(&user.caller, PATH, notice),
        entries: entries.collect(),
        next_before: events.next_before,
        authors: names.authors(),
        query,
    };
    render_dashboard(&page, notice)
}
