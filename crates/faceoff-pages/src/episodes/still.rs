//! `/evaluations/{id}/episodes/{task}/{episode}/still.svg`: a small still picture of an episode, for lists of episodes. It shows the public
//! motion only, so it is the same for all viewers who may see the episode.

use crate::{
    embeddable::StyledPicture, frame::PageProblem, replay::page_path, replay_section::Still,
};
use askama::Template;
use axum::{
    Extension,
    extract::{RawQuery, State},
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_replay::{Clip, ClipKey};
use faceoff_service::{
    app::App,
    episode_path::EpisodePath,
    problem::Problem,
    request_preconditions::{ETag, RequestPreconditions},
    viewer::Viewer,
    views::{clip_file::ClipFile, clips::Clips, visibility::Visibility},
};
use faceoff_types::{EvaluationId, Task};

#[derive(Template)]
#[template(path = "still.svg", escape = "html")]
struct Picture {
    still: Still,
}

/// Version of the pictures of a clip file. It is part of their addresses, so that browsers can keep them without asking again: a recording
/// never changes, and another drawing comes with another version of the program.
pub(super) fn version(clips: &ClipFile) -> String {
    let hash = blake3::hash(format!("{} {}", clips.key, env!("CARGO_PKG_VERSION")).as_bytes());
    hash.to_hex()[..12].to_owned()
}

/// The address of an episode's picture.
pub(super) fn address(id: EvaluationId, task: Task, episode: u32, version: &str) -> String {
    format!("{}/still.svg?{version}", page_path(id, task, episode))
}

pub(crate) async fn picture(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    path: Result<EpisodePath, Problem>,
    RawQuery(query): RawQuery,
    conditions: RequestPreconditions,
) -> Result<Response, PageProblem> {
    let EpisodePath { id, task, episode } = path?;
    let visibility = Visibility::load(&app, viewer?).await?;
    let clips = Clips::find(&app, &visibility, id).await?;
    let version = version(&clips.file);
    let tag = ETag::new("still", &[&version, task.as_str(), &episode.to_string()]);
    let mut response = match conditions.not_modified(&tag) {
        Some(response) => response,
        None => {
            let clip = clips.clip(ClipKey::motion(task, episode)).await?;
            let motion = Clip::read(&clip).map_err(Problem::internal)?;
            let picture = Picture {
                still: Still::small(&motion),
            };
            let svg = picture.render().map_err(Problem::internal)?;
            let media_type = HeaderValue::from_static("image/svg+xml");
            let headers = [
                (header::CONTENT_TYPE, media_type),
                (header::ETAG, tag.header()),
            ];
            (Extension(StyledPicture), headers, svg).into_response()
        }
    };
    // Only in the viewer's own browser: others may not be allowed to see the episode.
    let caching = match query == Some(version) {
        true => "private, max-age=31536000, immutable",
        false => "private, no-cache",
    };
    let headers = response.headers_mut();
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static(caching));
    let request_headers = HeaderValue::from_static("authorization, cookie");
    headers.insert(header::VARY, request_headers);
    Ok(response)
}

#[cfg(test)]
mod tests {
    use crate::assets;

    #[test]
    fn stills_have_the_colours_of_the_pages() {
        let drawing = include_str!("../../../../web/templates/still.svg");
        let styles: String = assets::STYLE.text().split_whitespace().collect();
        let schemes: Vec<_> = drawing
            .lines()
            .filter(|line| line.contains("--ink:"))
            .collect();
        assert_eq!(schemes.len(), 2, "light and dark");
        for scheme in schemes {
            let (_, properties) = scheme.split_once("svg {").unwrap();
            let (properties, _) = properties.split_once('}').unwrap();
            for property in properties.split(';') {
                let property: String = property.split_whitespace().collect();
                let is_colour = property.starts_with("--");
                assert!(!is_colour || styles.contains(&property), "{property}");
            }
        }
    }
}
