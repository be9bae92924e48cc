//! How an evaluation's episodes went, and the clips that their replays are drawn from.

use super::{
    document::{Binary, TagHeader},
    downloads::stays_its_callers,
};
use crate::{
    app::App,
    conditions::{Conditions, ETag},
    episode_path::EpisodePath,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{
        clips::{Clips, EpisodesView},
        sight::Sight,
    },
};
use axum::{
    Json,
    body::Body,
    extract::State,
    http::{HeaderMap, HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_replay::Key;
use faceoff_types::EvaluationId;
use flate2::read::GzDecoder;
use std::io::Read;

/// How the episodes of an evaluation went, once its day is released: where each began and ended and why, and what it broke.
///
/// Everybody sees it, as the result. Computation times, and what exactly a faulty agent did, are for whoever gets the dataset.
#[utoipa::path(
    get, path = "/evaluations/{id}/episodes", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), TagHeader),
    responses(
        (status = 200, body = EpisodesView),
        (status = 404),
        (status = 409, description = "no result, its day is not released, its stage is blind or its boards frozen; or an older version of the server played it"),
        (status = 410, description = "the recording was removed; the detail says when and by which retention"),
    )
)]
pub(crate) async fn episodes(
    viewer: Viewer,
    conditions: Conditions,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Response, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    let clips = Clips::of(&app, &sight, id).await?;
    let seen = if clips.sees_observed { "all" } else { "some" };
    let tag = ETag::of("episodes", &[&clips.key, seen, env!("CARGO_PKG_VERSION")]);
    let mut answer = match conditions.not_modified(&tag) {
        Some(answer) => answer,
        None => {
            let view = clips.episodes().await?;
            ([(header::ETAG, tag.header())], Json(view)).into_response()
        }
    };
    stays_its_callers(answer.headers_mut());
    Ok(answer)
}

/// The motion of table and robots in an episode, as a clip that replays are drawn from; for everybody, once the day is released.
///
/// Its bytes are described in `docs/replay.md`. They come gzip-compressed, for whoever accepts that.
#[utoipa::path(
    get, path = "/evaluations/{id}/episodes/{task}/{episode}/motion", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), ("task" = faceoff_types::Task, Path), ("episode" = u32, Path), TagHeader),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 404),
        (status = 409, description = "as for the episodes"),
        (status = 410, description = "the recording was removed"),
    )
)]
pub(crate) async fn motion(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: EpisodePath,
) -> Result<Response, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    let clips = Clips::of(&app, &sight, path.id).await?;
    let key = Key::motion(path.task, path.episode);
    send(&clips, key, "motion", path, &conditions, &headers).await
}

/// What the agent was told and commanded in an episode, and how long its answers took, as a clip; for whoever gets the
/// dataset.
#[utoipa::path(
    get, path = "/evaluations/{id}/episodes/{task}/{episode}/observed", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), ("task" = faceoff_types::Task, Path), ("episode" = u32, Path), TagHeader),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 404),
        (status = 409, description = "as for the episodes"),
        (status = 410, description = "the recording was removed"),
    )
)]
pub(crate) async fn observed(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: EpisodePath,
) -> Result<Response, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    let clips = Clips::of(&app, &sight, path.id).await?;
    if !clips.sees_observed {
        let kind = match viewer {
            Viewer::Anybody => ProblemKind::Unauthenticated,
            Viewer::Team(_) | Viewer::Organiser => ProblemKind::Forbidden,
        };
        return Err(Problem::new(
            kind,
            "what an agent was told and commanded is its team's, until the dataset is public; the motion is there for \
             everybody",
        ));
    }
    let key = Key::observed(path.task, path.episode);
    send(&clips, key, "observed", path, &conditions, &headers).await
}

async fn send(
    clips: &Clips,
    key: Key,
    what: &str,
    path: EpisodePath,
    conditions: &Conditions,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let EpisodePath { task, episode, .. } = path;
    let tag = ETag::of(what, &[&clips.key, task.as_str(), &episode.to_string()]);
    if let Some(mut answer) = conditions.not_modified(&tag) {
        stays_its_callers(answer.headers_mut());
        return Ok(answer);
    }
    let compressed = clips.clip(key).await?;
    let mut answer = if accepts_gzip(headers) {
        let encoding = (header::CONTENT_ENCODING, "gzip");
        ([encoding], Body::from(compressed)).into_response()
    } else {
        let mut bytes = Vec::new();
        GzDecoder::new(compressed.as_slice())
            .read_to_end(&mut bytes)
            .map_err(Problem::internal)?;
        Body::from(bytes).into_response()
    };
    let sent = answer.headers_mut();
    sent.insert(header::ETAG, tag.header());
    sent.insert(
        header::CONTENT_TYPE,
        HeaderValue::from_static("application/octet-stream"),
    );
    stays_its_callers(sent);
    let by = HeaderValue::from_static("authorization, cookie, accept-encoding");
    sent.insert(header::VARY, by);
    Ok(answer)
}

/// Does the client take gzip? By the encodings that it names, whichever it likes best.
fn accepts_gzip(headers: &HeaderMap) -> bool {
    let named = headers.get_all(header::ACCEPT_ENCODING).iter();
    named
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .any(|one| {
            let (name, weight) = one.split_once(';').unwrap_or((one, ""));
            let refused = weight
                .trim()
                .strip_prefix("q=")
                .is_some_and(|weight| weight.trim().parse() == Ok(0.0));
            matches!(name.trim(), "gzip" | "x-gzip" | "*") && !refused
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gzip_is_sent_to_who_takes_it() {
        let accepts = |text: &'static str| {
            let value = HeaderValue::from_static(text);
            accepts_gzip(&HeaderMap::from_iter([(header::ACCEPT_ENCODING, value)]))
        };
        assert!(accepts("deflate, gzip;q=0.5"));
        assert!(accepts("br,*"));
        assert!(!accepts("br, gzip;q=0"));
        assert!(!accepts("identity"));
        assert!(!accepts_gzip(&HeaderMap::new()));
    }
}
