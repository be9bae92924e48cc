//! The OpenAPI document: what `utoipa` does not derive from the routes and types.

mod competition_schemas;
mod conditional_requests;
mod deprecated_fields;
mod flattened_enums;
mod paged_lists;
mod responses;
mod unsigned_integers;

pub(super) use conditional_requests::{FileHeaders, IfNoneMatchHeader};
use faceoff_service::problem::ProblemBody;
use faceoff_types::Competition;
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
                       Every GET resource also supports HEAD: the same headers without a body.",
        license(name = "MIT OR Apache-2.0")
    ),
    components(schemas(ProblemBody)),
    modifiers(&SecuritySchemes),
    // The tag of an operation says which token it needs.
    tags(
        (name = "public", description = "No token required"),
        (name = "people", description = "Requires any valid token"),
        (name = "team", description = "Requires a team's token, or a member's"),
        (name = "organiser", description = "Requires an organiser's token"),
    )
)]
pub(super) struct Document;

struct SecuritySchemes;

impl Modify for SecuritySchemes {
    fn modify(&self, document: &mut openapi::OpenApi) {
        let components = document.components.get_or_insert_default();
        for (name, description) in [
            (
                "team",
                "A member's token (fo_person_…), or the team's (fo_team_…)",
            ),
            (
                "organiser",
                "An organiser's token (fo_person_…), or the operator's (fo_admin_…), which the server creates at its first start",
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

/// Adds what `utoipa` cannot derive from the routes and types: common responses, corrected schemas, deprecated fields, and what
/// depends on the competition.
pub(super) fn complete(mut document: openapi::OpenApi, competition: &Competition) -> Value {
    responses::complete(&mut document);
    let components = document.components.get_or_insert_default();
    flattened_enums::flatten(&mut components.schemas);
    let mut document = serde_json::to_value(document).expect("its keys are strings");
    competition_schemas::describe(&mut document, competition);
    deprecated_fields::add(&mut document);
    unsigned_integers::mark_unsigned(&mut document);
    document
}

/// Schema of a binary body: a bundle, a dataset or a clip.
pub(super) struct Binary;

impl PartialSchema for Binary {
    /// Some client generators need `format` (OpenAPI 3.0), others `contentMediaType` (3.1).
    fn schema() -> RefOr<Schema> {
        ObjectBuilder::new()
            .schema_type(Type::String)
            .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
            .content_media_type("application/octet-stream")
            .into()
    }
}

impl ToSchema for Binary {}
