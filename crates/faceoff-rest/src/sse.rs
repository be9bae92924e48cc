//! Common parts of server-sent event streams.

use axum::{
    http::HeaderName,
    response::{
        AppendHeaders, IntoResponse,
        sse::{Event, KeepAlive, Sse},
    },
};
use faceoff_service::{
    app::App,
    auth::Caller,
    priority_permits::{Precedence, PriorityPermit, PriorityPermits},
    problem::{Problem, ProblemKind},
};
use faceoff_store::Requester;
use futures::{Stream, StreamExt as _, stream};
use std::{convert::Infallible, time::Duration};

/// Request header of a client that reconnects: id of the last received event.
pub(super) const LAST_EVENT_ID: &str = "last-event-id";
/// Time between two messages that keep a silent connection open. Proxies close connections that are silent for a minute.
const KEEP_ALIVE_INTERVAL: Duration = Duration::from_secs(15);

/// Whether the token of a stream's request is still valid, with the secret that was sent; without one, the stream is a visitor's.
pub(super) async fn is_still_valid(
    app: &App,
    requester: Option<&Requester>,
) -> Result<bool, Problem> {
    match requester {
        Some(requester) => Ok(app
            .store
            .is_valid(requester, app.config.clock.now())
            .await?),
        None => Ok(true),
    }
}

/// Takes a permit for the reader of a stream. The message of a refusal names the `stream` and what can be `polled`
/// instead.
pub(super) fn take_permit(
    readers: &PriorityPermits,
    caller: Option<&Caller>,
    stream: &str,
    polled: &str,
) -> Result<PriorityPermit, Problem> {
    let precedence = caller.map_or(Precedence::Visitor, Caller::precedence);
    readers.take(precedence).ok_or_else(|| {
        let (taken, max) = (readers.taken(), readers.max());
        let reserved_note = if taken < max {
            ", and the last ones are kept for teams and organisers"
        } else {
            ""
        };
        Problem::new(
            ProblemKind::Busy,
            format!(
                "{taken} of the {max} places for readers of {stream} are taken{reserved_note}; try again later, or poll {polled}"
            ),
        )
    })
}

/// A streaming response with the events of all batches. It ends when `batches` ends.
pub(super) fn sse_response(
    batches: impl Stream<Item = Vec<Event>> + Send + 'static,
) -> impl IntoResponse {
    let events = batches.flat_map(stream::iter).map(Ok::<_, Infallible>);
    let events = Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE_INTERVAL));
    // Keeps proxies from buffering the stream.
    let unbuffered = [(HeaderName::from_static("x-accel-buffering"), "no")];
    (AppendHeaders(unbuffered), events)
}
