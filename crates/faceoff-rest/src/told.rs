//! What streams of server-sent events have in common.

use axum::{
    http::HeaderName,
    response::{
        AppendHeaders, IntoResponse,
        sse::{Event, KeepAlive, Sse},
    },
};
use futures::{Stream, StreamExt as _, stream};
use std::{convert::Infallible, time::Duration};

/// Of whoever comes again: the id of what it was told last.
pub(super) const LAST_EVENT_ID: &str = "last-event-id";
/// Proxies close what says nothing for a minute.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// The answer that goes on as long as there are batches.
pub(super) fn told(batches: impl Stream<Item = Vec<Event>> + Send + 'static) -> impl IntoResponse {
    let events = batches.flat_map(stream::iter).map(Ok::<_, Infallible>);
    let events = Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE));
    // A proxy that collects answers would hold what is told now.
    let unbuffered = [(HeaderName::from_static("x-accel-buffering"), "no")];
    (AppendHeaders(unbuffered), events)
}
