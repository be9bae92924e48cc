//! What the pages of both desks have in common: tabs, what was done, what was refused, style and script.

use super::{
    assets,
    frame::{PageProblem, render},
};
use askama::Template;
use axum::response::{IntoResponse, Redirect, Response};
use faceoff_service::{auth::Caller, problem::Problem};
use serde::Deserialize;

/// A page of a desk, as its navigation lists it.
pub(super) struct Tab {
    pub(super) path: &'static str,
    pub(super) name: &'static str,
    pub(super) is_current: bool,
}

/// The pages of the team's desk.
const TEAM: [(&str, &str); 3] = [
    ("/desk", "Agents"),
    ("/desk/questions", "Questions"),
    ("/desk/access", "Members and tokens"),
];

/// The pages of the organiser's.
const ORGANISER: [(&str, &str); 9] = [
    ("/organiser", "Attention"),
    ("/organiser/day", "Day"),
    ("/organiser/teams", "Teams"),
    ("/organiser/stages", "Stages"),
    ("/organiser/messages", "Messages"),
    ("/organiser/storage", "Storage"),
    ("/organiser/workers", "Workers"),
    ("/organiser/access", "People and tokens"),
    ("/organiser/log", "Log"),
];

/// Above the content of a desk's page.
pub(super) struct Head {
    pub(super) style: &'static str,
    pub(super) script: &'static str,
    pub(super) desk: &'static str,
    /// Who has signed in.
    pub(super) who: String,
    pub(super) tabs: Vec<Tab>,
    pub(super) said: Words,
}

/// [`Said`], in words.
pub(super) enum Words {
    Nothing,
    Done(&'static str),
    Refused(Refusal),
}

/// Why something was not done.
pub(super) struct Refusal {
    pub(super) title: &'static str,
    pub(super) detail: String,
    /// Its place among the explanations.
    pub(super) slug: &'static str,
}

impl From<&Problem> for Refusal {
    fn from(problem: &Problem) -> Self {
        Self {
            title: problem.kind().title(),
            detail: problem.detail().to_owned(),
            slug: problem.kind().slug(),
        }
    }
}

/// What a page is told by the one that was before it.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub(super) struct Done {
    pub(super) done: Option<String>,
}

/// What a page says above its content.
#[derive(Clone, Copy)]
pub(super) enum Said<'a> {
    Nothing,
    /// What the page before it has done, if anything.
    Done(&'a Done),
    /// Why what was sent to it was not done.
    Refused(&'a Problem),
}

/// What was done, in words: a page says none that come from outside.
const DONE: &[(&str, &str)] = &[
    (
        "uploaded",
        "Uploaded. The smoke run has been queued; its verdict appears below.",
    ),
    (
        "activated",
        "Chosen: it plays at the next cut, unless a later upload turns valid before.",
    ),
    (
        "withdrawn",
        "Withdrawn: it enters no further day. A day that had its cut goes on.",
    ),
    ("described", "Saved."),
    ("terms", "Terms accepted."),
    ("revoked", "Revoked: from now on it is worth nothing."),
    (
        "uninvited",
        "Taken back: the invitation's link is worth nothing from now on.",
    ),
    (
        "removed",
        "Removed: all tokens and sessions of that person are revoked.",
    ),
    ("asked", "Asked: the answer appears below."),
    ("announced", "Announced."),
    ("answered", "Answered."),
    (
        "published",
        "Published: teams accept the terms before they upload again.",
    ),
    ("started", "The day was started."),
    (
        "missed",
        "The missed day was started with what each team has active now.",
    ),
    ("paused", "The queue is paused: nothing new is begun."),
    ("resumed", "The queue goes on."),
    (
        "worker-banned",
        "The worker is banned: nothing is taken of it.",
    ),
    (
        "worker-readmitted",
        "The worker is readmitted: it gets work when it asks next.",
    ),
    (
        "voided",
        "Voided: it counts no more. It can be played again.",
    ),
    ("day-voided", "The whole day was voided."),
    ("cancelled", "Cancelled. It can be played again."),
    ("rerun", "Queued to be played again on the same episodes."),
    ("extra-turn", "The extra turn is queued."),
    ("disqualified", "The team was disqualified."),
    ("reinstated", "The team plays and is ranked again."),
    (
        "approved",
        "Approved: the link of the registration is good for seven days.",
    ),
    ("refused", "The registration was refused."),
    ("frozen", "The boards of the stage are frozen."),
    ("unfrozen", "The boards of the stage show everything again."),
    ("final-day", "The final day was started."),
    ("signed-off", "The stage is signed off."),
    ("stage-made", "The stage was made."),
    ("stage-changed", "The stage was changed."),
    ("team-changed", "The team was changed."),
    ("season-changed", "The season was changed."),
];

impl Head {
    /// Of the page at `current`.
    pub(super) fn of(caller: &Caller, current: &str, said: Said<'_>) -> Self {
        let (tabs, desk): (&[(&str, &str)], _) = match caller.is_organiser() {
            true => (&ORGANISER, "Organiser’s desk"),
            false => (&TEAM, "Team’s desk"),
        };
        let tab = |(path, name): &(&'static str, &'static str)| Tab {
            path,
            name,
            is_current: *path == current,
        };
        Self {
            style: assets::DESK_STYLE.url(),
            script: assets::DESK_SCRIPT.url(),
            desk,
            who: caller.person().map_or_else(
                || match caller.team() {
                    Some(_) => "the team’s own token".to_owned(),
                    None => "the host".to_owned(),
                },
                |person| person.name.to_string(),
            ),
            tabs: tabs.iter().map(tab).collect(),
            said: Words::from(said),
        }
    }
}

impl From<Said<'_>> for Words {
    fn from(said: Said<'_>) -> Self {
        let done = match said {
            Said::Nothing => None,
            Said::Done(done) => done.done.as_deref(),
            Said::Refused(problem) => return Self::Refused(problem.into()),
        };
        let words = DONE.iter().find(|(key, _)| Some(*key) == done);
        words.map_or(Self::Nothing, |(_, words)| Self::Done(words))
    }
}

/// Renders a page of a desk, with the status of what was refused.
pub(super) fn render_desk(page: &impl Template, said: Said<'_>) -> Result<Response, PageProblem> {
    let mut response = render(page)?;
    if let Said::Refused(problem) = said {
        response
            .headers_mut()
            .extend(problem.headers().iter().cloned());
        *response.status_mut() = problem.kind().status();
    }
    Ok(response)
}

/// To the page that says what was done.
pub(super) fn done(path: &str, key: &'static str) -> Response {
    let sign = if path.contains('?') { '&' } else { '?' };
    Redirect::to(&format!("{path}{sign}done={key}")).into_response()
}

/// As the desks write a number of bytes.
pub(super) fn bytes(bytes: u64) -> String {
    const UNITS: [&str; 5] = ["bytes", "KiB", "MiB", "GiB", "TiB"];
    let mut value = bytes as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    match unit {
        0 => format!("{bytes} bytes"),
        _ => format!("{value:.1} {}", UNITS[unit]),
    }
}
