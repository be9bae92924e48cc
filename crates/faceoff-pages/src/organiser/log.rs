//! `/organiser/log`: all changes with their authors.

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

const PATH: &str = "/organiser/log";

#[derive(Template)]
#[template(path = "organiser_log.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
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

    /// Address of the log filtered by a field.
    fn filter_link(&self, field: &str, value: &str) -> String {
        with_query(PATH, &[(field, value)])
    }

    fn older_link(&self) -> Option<String> {
        let older = EventsQuery {
            before: Some(self.events.next_before?),
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
    let page = Page {
        frame: Frame::load(&app, PATH).await?,
        head: DashboardHeader::new(&user.caller, PATH, notice),
        events,
        query,
    };
    render_dashboard(&page, notice)
}
