//! Problem: an error response as RFC 9457 defines it. Its body has a kind, a sentence with details, and further members for API
//! clients.

use super::kind::ProblemKind;
use axum::{
    Json,
    http::{HeaderName, HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_store::DecisionRecord;
use jiff::Timestamp;
use serde::Serialize;
use serde_json::{Map, Value};
use std::fmt::Display;
use utoipa::ToSchema;

/// An error response.
#[derive(Debug, Clone)]
pub struct Problem {
    kind: ProblemKind,
    detail: String,
    /// Extension members of the body, by name.
    members: Map<String, Value>,
    /// Additional headers of the response.
    headers: Vec<(HeaderName, HeaderValue)>,
}

impl Problem {
    /// Media type of RFC 9457.
    pub const MEDIA_TYPE: &'static str = "application/problem+json";

    /// A problem; `detail` says what was expected, what came and what to do.
    #[must_use]
    pub fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        // Values of `Retry-After` are in seconds: roughly how long the cause lasts.
        let headers = match kind {
            ProblemKind::Unauthenticated => vec![(
                header::WWW_AUTHENTICATE,
                HeaderValue::from_static("Bearer realm=\"faceoff\""),
            )],
            ProblemKind::Busy => vec![(header::RETRY_AFTER, HeaderValue::from_static("2"))],
            ProblemKind::TooManyPending
            | ProblemKind::NotYet
            | ProblemKind::StorageFull
            | ProblemKind::NotReady => {
                vec![(header::RETRY_AFTER, HeaderValue::from_static("30"))]
            }
            ProblemKind::TooManyUploads | ProblemKind::TooManyConnections => {
                vec![(header::RETRY_AFTER, HeaderValue::from_static("10"))]
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

    /// Adds an extension member, for API clients.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.members.insert(name.to_owned(), value.into());
        self
    }

    /// Adds a renamed extension member under its name and, until the next minor version, its old name.
    #[must_use]
    pub fn with_renamed(self, name: &str, old_name: &str, value: impl Into<Value>) -> Self {
        let value = value.into();
        self.with(old_name, value.clone()).with(name, value)
    }

    /// Adds a header of the response.
    pub fn with_header(mut self, name: HeaderName, value: HeaderValue) -> Self {
        self.headers.push((name, value));
        self
    }

    /// Sets `Retry-After`, in seconds.
    pub fn retry_after(mut self, seconds: u64) -> Self {
        let value = (header::RETRY_AFTER, HeaderValue::from(seconds));
        self.headers
            .retain(|(name, _)| *name != header::RETRY_AFTER);
        self.headers.push(value);
        self
    }

    /// The kind; it determines status, title and `type`.
    #[must_use]
    pub const fn kind(&self) -> ProblemKind {
        self.kind
    }

    /// What happened and what to do.
    #[must_use]
    pub fn detail(&self) -> &str {
        &self.detail
    }

    /// A `field` of the request with an invalid value; `detail` says what was expected and what came.
    pub fn invalid(field: &str, detail: impl Display) -> Self {
        Self::invalid_text(field, &detail)
    }

    fn invalid_text(field: &str, detail: &dyn Display) -> Self {
        Self::new(ProblemKind::InvalidContent, format!("{field}: {detail}")).with("field", field)
    }

    /// Refuses a request unless it is confirmed with the `name` of the affected resource. The message describes the `effect` of the
    /// request.
    pub fn check_confirmed(confirmed: Option<&str>, name: &str, effect: &str) -> Result<(), Self> {
        if confirmed == Some(name) {
            return Ok(());
        }
        let detail = format!(
            "nothing is done yet: {effect}. To do it, confirm it with {name:?} (field “confirm”)"
        );
        Err(Self::new(ProblemKind::NotConfirmed, detail).with("confirm", name))
    }

    /// A file that was removed. `file` is its name in the message; `removal` says when it was removed, and by whom or why.
    pub fn removed(file: &str, removal: &DecisionRecord) -> Self {
        let removed_at = removal.at.strftime("%Y-%m-%d at %H:%M:%S UTC");
        let detail = format!("{file} was removed on {removed_at} {}", removal.reason);
        Self::new(ProblemKind::Removed, detail).with("removed_at", removal.at.to_string())
    }

    /// Refuses a request that would change an archived season. The archive was made at `made_at`.
    pub fn archived(made_at: Timestamp, imported_at: Option<Timestamp>) -> Self {
        let format_time = |at: Timestamp| at.strftime("%Y-%m-%d %H:%M UTC").to_string();
        let imported = imported_at.map_or_else(String::new, |at| {
            format!(", which was imported at {}", format_time(at))
        });
        Self::new(
            ProblemKind::ReadOnly,
            format!(
                "this server shows the archive of a season as of {}{imported}: everything can be read, but nothing can be \
                 changed",
                format_time(made_at)
            ),
        )
        .with("made_at", made_at.to_string())
        .with("imported_at", imported_at.map(|at| at.to_string()))
    }

    /// A fault of the server; `cause` is logged, but not sent.
    pub fn internal(cause: impl Display) -> Self {
        Self::logged(&cause)
    }

    fn logged(cause: &dyn Display) -> Self {
        tracing::error!(%cause, "request failed");
        Self::new(
            ProblemKind::Internal,
            "the server could not complete the request; your request is fine. Try again; if the error persists, send the \
             header x-request-id of this response to an organiser",
        )
    }

    /// The resource does not exist, or the caller may not see it: the two must be indistinguishable. `resource_kind` names its
    /// kind, such as "team".
    pub fn not_found(resource_kind: &str) -> Self {
        Self::new(
            ProblemKind::NotFound,
            format!("you have no such {resource_kind}; check the id and the token's team"),
        )
    }

    /// Additional headers of the response.
    pub fn headers(&self) -> &[(HeaderName, HeaderValue)] {
        &self.headers
    }
}

/// Problem details (RFC 9457).
#[derive(Serialize, ToSchema)]
#[schema(as = Problem)]
pub struct ProblemBody<'a> {
    /// The kind of the problem; the server's page `/problems` explains it.
    #[schema(example = "/problems#cutoff-passed")]
    r#type: String,
    /// The kind in a few words.
    title: &'a str,
    /// The HTTP status.
    status: u16,
    /// What was expected, what came and what to do.
    detail: &'a str,
    #[serde(flatten)]
    #[schema(ignore)]
    members: &'a Map<String, Value>,
}

impl Problem {
    fn body(&self) -> ProblemBody<'_> {
        ProblemBody {
            r#type: format!("/problems#{}", self.kind.slug()),
            title: self.kind.title(),
            status: self.kind.status().as_u16(),
            detail: &self.detail,
            members: &self.members,
        }
    }

    /// The complete HTTP/1.1 response in bytes, for a connection that is closed before its first request.
    pub fn as_http1(&self) -> Vec<u8> {
        let body = serde_json::to_string(&self.body()).unwrap_or_default();
        let mut bytes = format!(
            "HTTP/1.1 {}\r\ncontent-type: {}\r\ncontent-length: {}\r\nconnection: close\r\n",
            self.kind.status(),
            Self::MEDIA_TYPE,
            body.len()
        )
        .into_bytes();
        for (name, value) in &self.headers {
            bytes.extend_from_slice(name.as_str().as_bytes());
            bytes.extend_from_slice(b": ");
            bytes.extend_from_slice(value.as_bytes());
            bytes.extend_from_slice(b"\r\n");
        }
        bytes.extend_from_slice(b"\r\n");
        bytes.extend_from_slice(body.as_bytes());
        bytes
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let body = self.body();
        let media_type = (
            header::CONTENT_TYPE,
            HeaderValue::from_static(Self::MEDIA_TYPE),
        );
        let mut response = (self.kind.status(), [media_type], Json(body)).into_response();
        response.headers_mut().extend(self.headers);
        response
    }
}
