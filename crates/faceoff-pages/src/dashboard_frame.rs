//! Frame of the team dashboard and the organiser dashboard: tabs, notices, style and script.

use super::{
    assets, format,
    frame::{PageProblem, render},
};
use askama::Template;
use axum::response::{IntoResponse, Redirect, Response};
use faceoff_service::{auth::Caller, problem::Problem};
use serde::Deserialize;

/// A tab of a dashboard.
pub(super) struct Tab {
    pub(super) path: &'static str,
    pub(super) name: &'static str,
    /// Value of the attribute `aria-current`: the page itself, or the group that it is in; `None` for other pages.
    pub(super) current: Option<&'static str>,
}

/// A page of a dashboard: its path and name.
type TabPage = (&'static str, &'static str);

/// A tab with the pages that a second row of tabs leads to; none for a single page.
type TabGroup = (TabPage, &'static [TabPage]);

const TEAM_TABS: [TabGroup; 4] = [
    (("/dashboard", "Overview"), &[]),
    (("/dashboard/questions", "Questions"), &[]),
    (("/dashboard/access", "Members and tokens"), &[]),
    (("/dashboard/settings", "Settings"), &[]),
];

const ORGANISER_TABS: [TabGroup; 9] = [
    (("/organiser", "Overview"), &[]),
    (("/organiser/day", "Evaluation day"), &[]),
    (("/organiser/stages", "Stages"), &[]),
    (("/organiser/tournaments", "Tournaments"), &[]),
    (
        ("/organiser/teams", "People"),
        &[
            ("/organiser/teams", "Teams"),
            ("/organiser/access", "Users and tokens"),
        ],
    ),
    (("/organiser/messages", "Messages"), &[]),
    (
        ("/organiser/workers", "Site"),
        &[
            ("/organiser/workers", "Workers"),
            ("/organiser/storage", "Storage"),
        ],
    ),
    (("/organiser/log", "Log"), &[]),
    (("/organiser/settings", "Settings"), &[]),
];

/// Header of a dashboard page.
pub(super) struct DashboardHeader {
    pub(super) style: &'static str,
    pub(super) script: &'static str,
    pub(super) title: &'static str,
    /// Name of the signed-in user.
    pub(super) user: String,
    pub(super) tabs: Vec<Tab>,
    /// The second row: name of the current tab, and its pages.
    pub(super) subtabs: Option<(&'static str, Vec<Tab>)>,
    pub(super) notice: NoticeText,
}

/// [`Notice`] as text.
pub(super) enum NoticeText {
    None,
    Done(&'static str),
    Refused(Refusal),
}

/// Why a request was refused.
pub(super) struct Refusal {
    pub(super) title: &'static str,
    pub(super) detail: String,
    /// Anchor on the page `/problems`.
    pub(super) slug: &'static str,
}

impl From<&Problem> for Refusal {
    fn from(problem: &Problem) -> Self {
        Self {
            title: problem.kind().title(),
            detail: format::sentence(problem.detail()),
            slug: problem.kind().slug(),
        }
    }
}

/// A form with a button only.
#[derive(Deserialize)]
pub(super) struct EmptyForm {}

/// Query of the page to which a successful action redirects. `done` is a key of [`DONE_TEXTS`].
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub(super) struct DoneQuery {
    pub(super) done: Option<String>,
}

/// Notice above the content of a page: about the last action, or about the submitted form.
#[derive(Clone, Copy)]
pub(super) enum Notice<'a> {
    None,
    /// The successful action before the redirect to this page, if there was one.
    Done(&'a DoneQuery),
    /// The submitted form was refused.
    Refused(&'a Problem),
}

/// Notices by key. Only these texts are shown: the query cannot inject others.
const DONE_TEXTS: &[(&str, &str)] = &[
    (
        "uploaded",
        "Uploaded. The validation run is queued; the result appears below.",
    ),
    (
        "activated",
        "Chosen for the next cutoff, unless a later upload becomes valid before.",
    ),
    (
        "withdrawn",
        "Withdrawn. Evaluations that have started continue.",
    ),
    ("described", "Saved."),
    ("terms", "Terms accepted."),
    ("revoked", "Revoked. It no longer works."),
    ("uninvited", "Invitation revoked. The link no longer works."),
    (
        "removed",
        "User removed. All tokens and sessions of the user are revoked. Team tokens and invitations made by the user are revoked, and \
         webhooks disabled.",
    ),
    ("asked", "Question sent. The answer appears below."),
    ("announced", "Announcement published."),
    ("answered", "Answer sent."),
    (
        "published",
        "Terms published. Teams must accept them before the next upload.",
    ),
    ("started", "The evaluation day has started."),
    (
        "missed",
        "The missed day has started with the active submission of each team.",
    ),
    ("paused", "The queue is paused: no new jobs start."),
    ("resumed", "The queue has resumed."),
    ("clock-accepted", "The server uses the system clock again."),
    (
        "worker-banned",
        "The worker is banned: its results are rejected.",
    ),
    (
        "worker-readmitted",
        "The worker is readmitted and gets jobs again.",
    ),
    (
        "voided",
        "Voided: the evaluation no longer counts. It can be repeated.",
    ),
    ("day-voided", "The whole evaluation day was voided."),
    ("cancelled", "Cancelled. The evaluation can be repeated."),
    ("rerun", "Queued again on the same episodes."),
    ("extra-evaluation", "The extra evaluation is queued."),
    ("disqualified", "The team was disqualified."),
    ("reinstated", "The team is evaluated and ranked again."),
    (
        "approved",
        "Approved: the link of the registration is valid for seven days.",
    ),
    ("refused", "The registration was refused."),
    ("frozen", "The boards of the stage are frozen."),
    ("unfrozen", "The boards of the stage show everything again."),
    ("final-day", "The final day has started."),
    ("signed-off", "The stage is signed off."),
    (
        "user-renamed",
        "Your name was changed. Sign in with it from now on.",
    ),
    (
        "password-set",
        "Password changed. Your other sessions and tokens no longer work.",
    ),
    (
        "tournament-opened",
        "The tournament is open. Start its first round when all teams are ready.",
    ),
    ("teams-entered", "The teams take part."),
    (
        "round-started",
        "The round has started; its games are queued.",
    ),
    (
        "tournament-paused",
        "The tournament is paused: no game starts.",
    ),
    ("tournament-resumed", "The tournament has resumed."),
    ("tournament-closed", "The tournament is closed."),
    ("team-left", "The team has left the tournament."),
    ("game-voided", "Voided: the game has to be rerun."),
    ("game-rerun", "The game is queued again."),
    ("stage-made", "The stage was created."),
    ("stage-changed", "The stage was changed."),
    ("team-changed", "The team was changed."),
    ("season-changed", "The season was changed."),
];

impl DashboardHeader {
    /// `current`: path of the page, or [`NO_ENTRY`](crate::frame::NO_ENTRY) if it has no tab.
    pub(super) fn new(caller: &Caller, current: &str, notice: Notice<'_>) -> Self {
        let (groups, title): (&[TabGroup], _) = match caller.is_organiser() {
            true => (&ORGANISER_TABS, "Organiser dashboard"),
            false => (&TEAM_TABS, "Team dashboard"),
        };
        let is_shown = |(path, _): &TabPage| *path == current;
        let tab = |(path, name): &TabPage| Tab {
            path,
            name,
            current: (*path == current).then_some("page"),
        };
        let tabs = groups.iter().map(|(first, pages)| Tab {
            current: match pages.iter().any(is_shown) {
                true => Some("true"),
                false => tab(first).current,
            },
            ..tab(first)
        });
        let subtabs = groups.iter().find_map(|((_, name), pages)| {
            let is_current = pages.iter().any(is_shown);
            is_current.then(|| (*name, pages.iter().map(tab).collect()))
        });
        Self {
            style: assets::DASHBOARD_STYLE.url(),
            script: assets::DASHBOARD_SCRIPT.url(),
            title,
            user: caller.user().map_or_else(
                || match caller.team() {
                    Some(_) => "team token".to_owned(),
                    None => "operator".to_owned(),
                },
                |user| user.name.to_string(),
            ),
            tabs: tabs.collect(),
            subtabs,
            notice: NoticeText::from(notice),
        }
    }
}

impl From<Notice<'_>> for NoticeText {
    fn from(notice: Notice<'_>) -> Self {
        let done = match notice {
            Notice::None => None,
            Notice::Done(done) => done.done.as_deref(),
            Notice::Refused(problem) => return Self::Refused(problem.into()),
        };
        let text = DONE_TEXTS.iter().find(|(key, _)| Some(*key) == done);
        text.map_or(Self::None, |(_, text)| Self::Done(text))
    }
}

/// Renders a page of a dashboard; a refusal sets the status and headers of the response.
pub(super) fn render_dashboard(
    page: &impl Template,
    notice: Notice<'_>,
) -> Result<Response, PageProblem> {
    let mut response = render(page)?;
    if let Notice::Refused(problem) = notice {
        response
            .headers_mut()
            .extend(problem.headers().iter().cloned());
        *response.status_mut() = problem.kind().status();
    }
    Ok(response)
}

/// Redirects to a page that shows the notice `key`.
pub(super) fn redirect_done(path: &str, key: &'static str) -> Response {
    let sign = if path.contains('?') { '&' } else { '?' };
    Redirect::to(&format!("{path}{sign}done={key}")).into_response()
}

/// A number of bytes with a binary unit.
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
