//! `/log`: every change and its author, for organisers who have signed in.

use super::frame::{Frame, PageProblem, render};
use crate::{
    app::App,
    auth::Anybody,
    extract::QueryParams,
    problem::{Problem, ProblemKind},
    requests::EventsQuery,
    views::{
        event::{EventView, EventsView},
        season::SeasonHead,
    },
};
use askama::Template;
use axum::{
    extract::State,
    response::{IntoResponse, Redirect, Response},
};

#[derive(Template)]
#[template(path = "log.html")]
struct Page {
    frame: Frame,
    events: EventsView,
    actor: String,
    subject: String,
    kind: String,
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

    fn older(&self) -> Option<String> {
        let mut query = vec![("before", self.events.next_before?.to_string())];
        for (name, value) in [
            ("actor", &self.actor),
            ("subject", &self.subject),
            ("kind", &self.kind),
        ] {
            if !value.is_empty() {
                query.push((name, value.clone()));
            }
        }
        let pairs = query.into_iter().map(|(name, value)| {
            // They were checked: letters, digits and . / : _ -
            format!("{name}={value}")
        });
        Some(format!("/log?{}", pairs.collect::<Vec<_>>().join("&")))
    }
}

pub(super) async fn page(
    Anybody(caller): Anybody,
    State(app): State<App>,
    QueryParams(mut query): QueryParams<EventsQuery>,
) -> Result<Response, PageProblem> {
    match caller {
        None => return Ok(Redirect::to("/sign-in").into_response()),
        Some(caller) if caller.is_organiser() => {}
        Some(_) => {
            let detail = "the log of all changes is for organisers";
            return Err(Problem::new(ProblemKind::Forbidden, detail).into());
        }
    }
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
    let season = SeasonHead::now(&app).await?.name;
    render(&Page {
        frame: Frame::of(&app, season, "/log"),
        events: EventsView::page(&app, query).await?,
        actor,
        subject,
        kind,
    })
}
