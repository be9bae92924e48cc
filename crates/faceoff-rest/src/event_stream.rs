//! What changes, as it happens, by server-sent events.

use super::told::{LAST_EVENT_ID, told};
use crate::event_reader::{EventReader, Follower};
use axum::{Extension, extract::State, http::HeaderMap, response::IntoResponse};
use faceoff_api::requests::FollowQuery;
use faceoff_notify::About;
use faceoff_service::{
    app::App,
    auth::Anybody,
    ending::Ending,
    extract::QueryParams,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
};
use futures::stream;
use std::sync::Arc;

/// Tells what changes: `change` with what to ask for again, in the order in which it happened, as far as the caller may
/// know of it. First of all `now`, with the id of what happened last.
///
/// Who comes again with the header `Last-Event-ID` gets all that happened since, each change once, and no `now`; with an
/// id that this server has not given, or long ago, `reset`: ask for everything again. Streams end after an hour at most,
/// when the server ends, and when the token is worth nothing any more.
#[utoipa::path(
    get, path = "/events/stream", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(
        FollowQuery,
        ("Last-Event-ID" = Option<String>, Header, description = "the id of the last event that came", example = "4711"),
    ),
    responses(
        (status = 200, body = String, content_type = "text/event-stream"),
        (status = 400, description = "the header is none of this stream's ids"),
        (status = 422, description = "`about` names nothing that there is to follow"),
        (status = 503, description = "as many readers as may be are following"),
    )
)]
pub(crate) async fn follow_events(
    Anybody(caller): Anybody,
    State(app): State<App>,
    QueryParams(query): QueryParams<FollowQuery>,
    ending: Option<Extension<Ending>>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    let about = match &query.about {
        Some(about) => about
            .parse()
            .map_err(|error| Problem::invalid("about", error))?,
        None => About::default(),
    };
    let from = headers
        .get(LAST_EVENT_ID)
        .map(|value| parse_id(value.to_str().unwrap_or_default()))
        .transpose()?;
    let Ok(seat) = Arc::clone(&app.following).try_acquire_owned() else {
        return Err(Problem::new(
            ProblemKind::Busy,
            format!(
                "{} readers follow what happens, and more may not at a time; try again, or ask for what you show now and then",
                app.config.limits.event_readers
            ),
        ));
    };
    let viewer = caller.as_ref().map_or(Viewer::Anybody, Viewer::of);
    let follower = Follower {
        reader: viewer.into(),
        token: caller.map(|caller| caller.token.id),
        about,
    };
    let ending = ending.map(|Extension(ending)| ending);
    let reader = EventReader::open(app, follower, from, ending, seat).await?;
    let batches = stream::unfold(reader, |mut reader| async {
        let batch = reader.next().await?;
        Some((batch, reader))
    });
    Ok(told(batches))
}

/// An id as the stream gives it.
fn parse_id(text: &str) -> Result<i64, Problem> {
    let parsed = text.parse().ok().filter(|id| *id >= 0);
    parsed.ok_or_else(|| {
        Problem::new(
            ProblemKind::InvalidRequest,
            format!(
                "the header Last-Event-ID is the id of the last event that came, as in 4711, got {text:?}; without it the \
                 stream begins now"
            ),
        )
    })
}
