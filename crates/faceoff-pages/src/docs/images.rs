//! Pictures of the documentation, compiled in.

use crate::{
    compressed_text::{CompressedText, compressed_text},
    embeddable::Embeddable,
};
use axum::{
    Extension,
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    extract::PathParam,
    problem::{Problem, ProblemKind},
    request_preconditions::{ETag, RequestPreconditions},
};

/// The address of a picture is stable while its content changes between versions, so browsers may cache it for an hour only.
const CACHE_CONTROL: &str = "public, max-age=3600";

struct Image {
    name: &'static str,
    content: Content,
}

enum Content {
    Png(&'static [u8]),
    Svg(CompressedText),
}

impl Image {
    fn media_type(&self) -> &'static str {
        match self.content {
            Content::Png(_) => "image/png",
            Content::Svg(_) => "image/svg+xml",
        }
    }

    fn bytes(&self) -> &[u8] {
        match &self.content {
            Content::Png(bytes) => bytes,
            Content::Svg(drawing) => drawing.text().as_bytes(),
        }
    }
}

/// A file of `docs/images/`.
macro_rules! image {
    (png $name:literal) => {
        Image {
            name: $name,
            content: Content::Png(include_bytes!(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/../../docs/images/",
                $name
            ))),
        }
    };
    (svg $name:literal) => {
        Image {
            name: $name,
            content: Content::Svg(compressed_text!("docs/images/", $name)),
        }
    };
}

static IMAGES: [Image; 7] = [
    image!(png "board.png"),
    image!(png "replay-page.png"),
    image!(svg "robot.svg"),
    image!(svg "fidelity/arm.svg"),
    image!(svg "fidelity/contacts.svg"),
    image!(svg "fidelity/episodes.svg"),
    image!(svg "fidelity/paths.svg"),
];

/// Path of a picture by its name.
pub(super) fn path(name: &str) -> Option<String> {
    let image = IMAGES.iter().find(|image| image.name == name)?;
    Some(format!("/docs/images/{}", image.name))
}

pub(super) async fn image(
    PathParam(name): PathParam<String>,
    conditions: RequestPreconditions,
) -> Result<Response, Problem> {
    let Some(image) = IMAGES.iter().find(|image| image.name == name) else {
        let detail = format!("the documentation has no picture {name}");
        return Err(Problem::new(ProblemKind::NotFound, detail));
    };
    let tag = ETag::new("picture", &[blake3::hash(image.bytes()).to_hex().as_str()]);
    let headers = [
        (header::ETAG, tag.header()),
        (
            header::CACHE_CONTROL,
            HeaderValue::from_static(CACHE_CONTROL),
        ),
    ];
    // One of them is on the cards of pages without an own picture.
    let headers = (Extension(Embeddable), headers);
    if let Some(not_modified) = conditions.not_modified(&tag) {
        return Ok((headers, not_modified).into_response());
    }
    let media_type = [(
        header::CONTENT_TYPE,
        HeaderValue::from_static(image.media_type()),
    )];
    Ok((headers, media_type, image.bytes()).into_response())
}
