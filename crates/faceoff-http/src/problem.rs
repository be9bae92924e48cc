//! Errors as the outside sees them: problem details (RFC 9457).
//!
//! Every problem says in `detail` what was expected, what came and what to do. Causes that are ours
//! (database, disk) stay in the log; the outside gets the request's id to quote.

use axum::{
    http::{HeaderName, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_store::StoreError;
use serde_json::{Map, Value, json};

/// What kind of problem it is. `type` in the answer is `/problems#` and the kind's name; that page
/// explains them all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProblemKind {
    /// No bearer token, or an unknown one.
    Unauthenticated,
    /// A known token of the wrong kind.
    Forbidden,
    /// No such thing, or not the caller's.
    NotFound,
    /// The path is known, the method is not.
    MethodNotAllowed,
    /// Not understood: bad JSON, a bad id, a bad query.
    InvalidRequest,
    /// Understood, but a value is not acceptable.
    InvalidContent,
    /// Not one of the archive formats, or not JSON.
    UnsupportedMediaType,
    /// The body is larger than allowed.
    TooLarge,
    /// The body stopped coming.
    RequestTimeout,
    /// Another team has this name.
    TeamNameTaken,
    /// The team's turn of the day is used.
    AlreadyEvaluated,
    /// The day's seed is known, and the submission came after that.
    DayReleased,
    /// It carries a seed that is secret for some more time.
    NotYet,
    /// The season is over.
    SeasonClosed,
    /// Two evaluations did not play the same episodes.
    NotPaired,
    /// The thing is in a state that does not allow this.
    Conflict,
    /// The team has several uploads that are not validated yet.
    TooManyPending,
    /// The server is at its limit of concurrent requests, or too slow.
    Busy,
    /// Our fault.
    Internal,
}

impl ProblemKind {
    /// All kinds, as the page `/problems` lists them.
    pub const ALL: [Self; 19] = [
        Self::Unauthenticated,
        Self::Forbidden,
        Self::NotFound,
        Self::MethodNotAllowed,
        Self::InvalidRequest,
        Self::InvalidContent,
        Self::UnsupportedMediaType,
        Self::TooLarge,
        Self::RequestTimeout,
        Self::TeamNameTaken,
        Self::AlreadyEvaluated,
        Self::DayReleased,
        Self::NotYet,
        Self::SeasonClosed,
        Self::NotPaired,
        Self::Conflict,
        Self::TooManyPending,
        Self::Busy,
        Self::Internal,
    ];

    const fn row(self) -> (&'static str, StatusCode, &'static str, &'static str) {
        match self {
            Self::Unauthenticated => (
                "unauthenticated",
                StatusCode::UNAUTHORIZED,
                "A valid token is needed",
                "Send the header “Authorization: Bearer TOKEN”. A lost token is replaced by the organiser.",
            ),
            Self::Forbidden => (
                "forbidden",
                StatusCode::FORBIDDEN,
                "This token may not do that",
                "The token is valid, but of the wrong kind: some requests are a team's, some are the organiser's.",
            ),
            Self::NotFound => (
                "not-found",
                StatusCode::NOT_FOUND,
                "Not found",
                "There is no such thing, or it belongs to another team. Check the id.",
            ),
            Self::MethodNotAllowed => (
                "method-not-allowed",
                StatusCode::METHOD_NOT_ALLOWED,
                "Method not allowed",
                "The path exists, but not with this method. The header “Allow” lists what it takes.",
            ),
            Self::InvalidRequest => (
                "invalid-request",
                StatusCode::BAD_REQUEST,
                "The request is not understood",
                "The JSON, an id, a header or the query is malformed. The detail names the place.",
            ),
            Self::InvalidContent => (
                "invalid-content",
                StatusCode::UNPROCESSABLE_ENTITY,
                "A value is not acceptable",
                "The request is well-formed, but a field has a value that cannot be used. The detail names it.",
            ),
            Self::UnsupportedMediaType => (
                "unsupported-media-type",
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "Unsupported media type",
                "A bundle is a .tar.gz, .tar.zst or .zip sent as the body itself; everything else is JSON.",
            ),
            Self::TooLarge => (
                "too-large",
                StatusCode::PAYLOAD_TOO_LARGE,
                "The body is too large",
                "The detail and “limit_bytes” state the limit. Leave data out of the bundle that the agent does not need.",
            ),
            Self::RequestTimeout => (
                "request-timeout",
                StatusCode::REQUEST_TIMEOUT,
                "The body stopped coming",
                "The upload stalled for too long. Nothing was stored; send it again.",
            ),
            Self::TeamNameTaken => (
                "team-name-taken",
                StatusCode::CONFLICT,
                "The name is taken",
                "Another team has this name. Choose another one, or ask for a new token for the existing team.",
            ),
            Self::AlreadyEvaluated => (
                "already-evaluated",
                StatusCode::CONFLICT,
                "Today's turn is used",
                "A team is evaluated once per UTC day. “next_turn” is the next day it can be.",
            ),
            Self::DayReleased => (
                "day-released",
                StatusCode::CONFLICT,
                "Too late for today's episodes",
                "A dataset of today was handed out, and with it the seed of today's episodes. What was uploaded after that plays from “next_turn” on.",
            ),
            Self::NotYet => (
                "not-yet",
                StatusCode::CONFLICT,
                "Not yet",
                "A dataset carries the seed of its day. It is handed out once no evaluation of that day is queued or running.",
            ),
            Self::SeasonClosed => (
                "season-closed",
                StatusCode::CONFLICT,
                "The season is over",
                "The season's secret is published, so nothing more is uploaded or evaluated. Results and datasets stay.",
            ),
            Self::NotPaired => (
                "not-paired",
                StatusCode::CONFLICT,
                "Not the same episodes",
                "Two evaluations are compared if they are of the same day and played equally many episodes of the same tasks under the same rules and profile. “field” names what differs.",
            ),
            Self::Conflict => (
                "conflict",
                StatusCode::CONFLICT,
                "Not possible in this state",
                "The detail says which state the thing is in and what it waits for.",
            ),
            Self::TooManyPending => (
                "too-many-pending",
                StatusCode::TOO_MANY_REQUESTS,
                "Too many uploads are waiting",
                "Several uploads of the team are not validated yet. Wait until one has its verdict.",
            ),
            Self::Busy => (
                "busy",
                StatusCode::SERVICE_UNAVAILABLE,
                "The server is busy",
                "Try again after the seconds stated in the header “Retry-After”.",
            ),
            Self::Internal => (
                "internal",
                StatusCode::INTERNAL_SERVER_ERROR,
                "The server failed",
                "Our fault. Try again; if it stays, send the organiser the header “X-Request-Id” of the answer.",
            ),
        }
    }

    /// Name in `type`.
    #[must_use]
    pub const fn slug(self) -> &'static str {
        self.row().0
    }

    /// HTTP status.
    #[must_use]
    pub const fn status(self) -> StatusCode {
        self.row().1
    }

    /// Short title, the same for every problem of the kind.
    #[must_use]
    pub const fn title(self) -> &'static str {
        self.row().2
    }

    /// What the kind means and what to do, for the page `/problems`.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        self.row().3
    }
}

/// One problem, ready to be sent.
#[derive(Debug, Clone)]
pub struct Problem {
    kind: ProblemKind,
    detail: String,
    members: Map<String, Value>,
    headers: Vec<(HeaderName, HeaderValue)>,
}

impl Problem {
    /// Media type of RFC 9457.
    pub const MEDIA_TYPE: &'static str = "application/problem+json";

    /// A problem; `detail` says what was expected, what came and what to do.
    #[must_use]
    pub fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        let headers = match kind {
            ProblemKind::Unauthenticated => vec![(
                header::WWW_AUTHENTICATE,
                HeaderValue::from_static("Bearer realm=\"faceoff\""),
            )],
            ProblemKind::Busy => vec![(header::RETRY_AFTER, HeaderValue::from_static("2"))],
            ProblemKind::TooManyPending | ProblemKind::NotYet => {
                vec![(header::RETRY_AFTER, HeaderValue::from_static("30"))]
            }
            _ => Vec::new(),
        };
        Self {
            kind,
            detail: detail.into(),
            members: Map::new(),
            headers,
        }
    }

    /// With an extension member, for programs.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.members.insert(name.to_owned(), value.into());
        self
    }

    /// With a header.
    #[must_use]
    pub fn with_header(mut self, name: HeaderName, value: HeaderValue) -> Self {
        self.headers.push((name, value));
        self
    }

    /// Its kind.
    #[must_use]
    pub const fn kind(&self) -> ProblemKind {
        self.kind
    }

    /// What happened and what to do.
    #[must_use]
    pub fn detail(&self) -> &str {
        &self.detail
    }

    /// Our fault: `cause` goes to the log only.
    pub(crate) fn internal(cause: impl std::fmt::Display) -> Self {
        tracing::error!(%cause, "request failed");
        Self::new(
            ProblemKind::Internal,
            "the server could not complete the request; nothing is wrong with what you sent. Try again; \
             if it stays, send the organiser the x-request-id header of this answer",
        )
    }

    /// No such `what` (or not the caller's: the two must look alike).
    pub(crate) fn not_found(what: &str) -> Self {
        Self::new(
            ProblemKind::NotFound,
            format!("there is no such {what} of yours; check the id and the token's team"),
        )
    }

    pub(crate) fn headers(&self) -> &[(HeaderName, HeaderValue)] {
        &self.headers
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = self.kind.status();
        let mut body = self.members;
        body.insert(
            "type".into(),
            json!(format!("/problems#{}", self.kind.slug())),
        );
        body.insert("title".into(), json!(self.kind.title()));
        body.insert("status".into(), json!(status.as_u16()));
        body.insert("detail".into(), json!(self.detail));
        let mut response = (status, Value::Object(body).to_string()).into_response();
        let headers = response.headers_mut();
        headers.insert(
            header::CONTENT_TYPE,
            HeaderValue::from_static(Self::MEDIA_TYPE),
        );
        headers.extend(self.headers);
        response
    }
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::NotFound(what) => Self::not_found(what),
            StoreError::TeamNameTaken(name) => Self::new(
                ProblemKind::TeamNameTaken,
                format!(
                    "a team named {name:?} exists already; choose another name, or make a new token \
                     for it with POST /api/v1/teams/ID/token"
                ),
            ),
            StoreError::AlreadyEvaluated { day, next } => Self::new(
                ProblemKind::AlreadyEvaluated,
                format!(
                    "this team's evaluation of {day} exists already, and a team is evaluated once per \
                     UTC day; the next turn is on {next}, from 00:00 UTC"
                ),
            )
            .with("day", day.to_string())
            .with("next_turn", next.to_string()),
            StoreError::DayReleased {
                day,
                released_at,
                next,
            } => Self::new(
                ProblemKind::DayReleased,
                format!(
                    "the seed of {day} is known since {}, when the first dataset of the day was handed \
                     out, and this submission was uploaded after that; it can play from {next}, 00:00 \
                     UTC. A submission that was uploaded before can still play {day}",
                    released_at.strftime("%H:%M:%S UTC")
                ),
            )
            .with("day", day.to_string())
            .with("next_turn", next.to_string()),
            StoreError::SeasonClosed { closed_at } => Self::new(
                ProblemKind::SeasonClosed,
                format!(
                    "the season was closed on {} and its secret is public, so nothing more is uploaded \
                     or evaluated; results and datasets stay",
                    closed_at.strftime("%Y-%m-%d at %H:%M UTC")
                ),
            )
            .with("closed_at", closed_at.to_string()),
            StoreError::Conflict(detail) => Self::new(ProblemKind::Conflict, detail),
            error @ (StoreError::Database(_)
            | StoreError::Artifacts(_)
            | StoreError::Damaged(_)) => Self::internal(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn kinds_are_told_apart_and_are_errors() {
        let slugs: BTreeSet<_> = ProblemKind::ALL.iter().map(|kind| kind.slug()).collect();
        assert_eq!(slugs.len(), ProblemKind::ALL.len());
        for kind in ProblemKind::ALL {
            assert!(kind.status().is_client_error() || kind.status().is_server_error());
            assert!(kind.meaning().ends_with('.'));
        }
    }

    #[test]
    fn a_cause_that_is_ours_stays_inside() {
        let problem = Problem::from(StoreError::Artifacts("disk /dev/secret is full".into()));
        assert_eq!(problem.kind(), ProblemKind::Internal);
        assert!(!problem.detail().contains("secret"));
    }
}
