//! The event stream: changes of the season as server-sent events.

use super::sse::{LAST_EVENT_ID, sse_response, take_permit};
use crate::event_reader::{EventReader, Subscription};
use axum::{Extension, extract::State, http::HeaderMap, response::IntoResponse};
use faceoff_api::requests::EventStreamQuery;
use faceoff_notify::NoticeFilter;
use faceoff_service::{
    app::App,
    auth::OptionalCaller,
    extract::QueryParams,
    problem::{Problem, ProblemKind},
    shutdown::Shutdown,
    viewer::Viewer,
};
use futures::stream;

/// Streams events as they happen (server-sent events), as far as the caller may see them.
///
/// The first event is `now`, with the id of the newest event. Each `change` event names what has changed and what to
/// reload, in chronological order.
///
/// A client that reconnects with the header `Last-Event-ID` gets all events since then exactly once, and no `now`. If
/// the id is unknown or too old, it gets `reset` and has to reload everything. A stream ends after at most an hour,
/// when the server shuts down, and when the token becomes invalid.
#[utoipa::path(
    get, path = "/events/stream", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(
        EventStreamQuery,
        ("Last-Event-ID" = Option<String>, Header, description = "id of the last received event", example = "4711"),
    ),
    responses(
        (status = 200, body = String, content_type = "text/event-stream"),
        (status = 400, description = "`Last-Event-ID` is not an event id"),
        (status = 422, description = "`about` contains an unknown filter"),
        (status = 503, description = "the server has as many readers as it may"),
    )
)]
pub(crate) async fn follow_events(
    OptionalCaller(caller): OptionalCaller,
    State(app): State<App>,
    QueryParams(query): QueryParams<EventStreamQuery>,
    shutdown: Option<Extension<Shutdown>>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    let filter = match &query.about {
        Some(filters) => filters
            .parse()
            .map_err(|error| Problem::invalid("about", error))?,
        None => NoticeFilter::default(),
    };
    let last_received = headers
        .get(LAST_EVENT_ID)
        .map(|value| parse_id(value.to_str().unwrap_or_default()))
        .transpose()?;
    // A refusal advises to poll these.
    let polled = "the resources";
    let permit = take_permit(
        &app.event_readers,
        caller.as_ref(),
        "the event stream",
        polled,
    )?;
    let viewer = caller.as_ref().map_or(Viewer::Visitor, Viewer::new);
    let subscription = Subscription {
        audience: viewer.into(),
        requester: caller.map(|caller| caller.requester()),
        filter,
    };
    let shutdown = shutdown.map(|Extension(shutdown)| shutdown);
    let reader = EventReader::open(app, subscription, last_received, shutdown, permit).await?;
    let batches = stream::unfold(reader, |mut reader| async {
        let batch = reader.next().await?;
        Some((batch, reader))
    });
    Ok(sse_response(batches))
}

/// Parses an event id of the stream.
fn parse_id(text: &str) -> Result<i64, Problem> {
    let parsed = text.parse().ok().filter(|id| *id >= 0);
    parsed.ok_or_else(|| {
        Problem::new(
            ProblemKind::InvalidRequest,
            format!(
                "expected the header Last-Event-ID to be the id of an event, as in 4711, got {text:?}; leave it out to start \
                 now"
            ),
        )
    })
}
