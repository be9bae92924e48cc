//! The documents' pictures, compiled in.

use axum::{
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    conditions::{Conditions, ETag},
    extract::PathParam,
    problem::{Problem, ProblemKind},
};

/// Their addresses stay, so they may change with the program's version.
const KEPT: &str = "public, max-age=3600";

struct Image {
    name: &'static str,
    media_type: &'static str,
    content: &'static [u8],
}

/// A file of `docs/images/`.
macro_rules! image {
    ($name:literal, $media_type:literal) => {
        Image {
            name: $name,
            media_type: $media_type,
            content: include_bytes!(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/../../docs/images/",
                $name
            )),
        }
    };
}

static IMAGES: [Image; 7] = [
    image!("board.png", "image/png"),
    image!("replay-page.png", "image/png"),
    image!("robot.svg", "image/svg+xml"),
    image!("fidelity/arm.svg", "image/svg+xml"),
    image!("fidelity/contacts.svg", "image/svg+xml"),
    image!("fidelity/episodes.svg", "image/svg+xml"),
    image!("fidelity/paths.svg", "image/svg+xml"),
];

/// Where the picture of this name is, if there is one.
pub(super) fn path(name: &str) -> Option<String> {
    let image = IMAGES.iter().find(|image| image.name == name)?;
    Some(format!("/docs/images/{}", image.name))
}

pub(super) async fn image(
    PathParam(name): PathParam<String>,
    conditions: Conditions,
) -> Result<Response, Problem> {
    let Some(image) = IMAGES.iter().find(|image| image.name == name) else {
        let detail = format!("the documentation has no picture {name}");
        return Err(Problem::new(ProblemKind::NotFound, detail));
    };
    let tag = ETag::of("picture", &[blake3::hash(image.content).to_hex().as_str()]);
    let kept = [
        (header::ETAG, tag.header()),
        (header::CACHE_CONTROL, HeaderValue::from_static(KEPT)),
    ];
    if let Some(known) = conditions.not_modified(&tag) {
        return Ok((kept, known).into_response());
    }
    let media_type = [(
        header::CONTENT_TYPE,
        HeaderValue::from_static(image.media_type),
    )];
    Ok((kept, media_type, image.content).into_response())
}
