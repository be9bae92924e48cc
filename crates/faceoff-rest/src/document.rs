//! What the OpenAPI document says besides routes and types.

mod answers;
mod files;
mod integers;
mod lists;
mod unions;

use faceoff_service::problem::ProblemBody;
pub(super) use files::{FileHeaders, TagHeader};
use serde_json::Value;
use utoipa::{
    Modify, OpenApi, PartialSchema, ToSchema,
    openapi::{
        self, KnownFormat, ObjectBuilder, RefOr, Schema, SchemaFormat, Type,
        security::{HttpAuthScheme, HttpBuilder, SecurityScheme},
    },
};

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Faceoff",
        description = "Competition server for robot learning: teams upload agents, the server evaluates them daily. \
                       Whatever can be asked with GET can be asked with HEAD: the same headers, and no body.",
        license(name = "MIT OR Apache-2.0")
    ),
    components(schemas(ProblemBody)),
    modifiers(&Tokens),
    tags(
        (name = "public", description = "For everybody, without a token"),
        (name = "people", description = "With anybody's token"),
        (name = "team", description = "With a team's token, or a member's"),
        (name = "organiser", description = "With the organiser's token"),
    )
)]
pub(super) struct Document;

struct Tokens;

impl Modify for Tokens {
    fn modify(&self, document: &mut openapi::OpenApi) {
        let components = document.components.get_or_insert_default();
        for (name, description) in [
            (
                "team",
                "A member's token, fo_person_…, or the team's own, fo_team_…",
            ),
            (
                "organiser",
                "An organiser's token, fo_person_…, or the host's, fo_admin_…, made at the server's first start",
            ),
        ] {
            components.add_security_scheme(
                name,
                SecurityScheme::Http(
                    HttpBuilder::new()
                        .scheme(HttpAuthScheme::Bearer)
                        .description(Some(description))
                        .build(),
                ),
            );
        }
    }
}

/// The document, with what follows from what routes and types say of themselves.
pub(super) fn told(mut document: openapi::OpenApi) -> Value {
    answers::complete(&mut document);
    let components = document.components.get_or_insert_default();
    unions::multiply_out(&mut components.schemas);
    let mut told = serde_json::to_value(document).expect("its keys are texts");
    integers::tell_unsigned(&mut told);
    told
}

/// The bytes of an archive, as a body or an answer.
pub(super) struct Binary;

impl PartialSchema for Binary {
    /// Some generators know `format` (of OpenAPI 3.0), others `contentMediaType` (of 3.1).
    fn schema() -> RefOr<Schema> {
        ObjectBuilder::new()
            .schema_type(Type::String)
            .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
            .content_media_type("application/octet-stream")
            .into()
    }
}

impl ToSchema for Binary {}
