//! What the OpenAPI document says besides routes and types.

use crate::problem::{Problem, ProblemBody};
use utoipa::{
    Modify, OpenApi, ToSchema,
    openapi::{
        self, Content, Ref, RefOr,
        security::{HttpAuthScheme, HttpBuilder, SecurityScheme},
    },
};

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Faceoff",
        description = "Competition server for robot learning: teams upload agents, the server evaluates them daily.",
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

/// Every error is a problem, so no route says so.
pub(super) fn describe_errors(document: &mut openapi::OpenApi) {
    let problem = Content::new(Some(Ref::from_schema_name(ProblemBody::name())));
    for item in document.paths.paths.values_mut() {
        let operations = [
            &mut item.get,
            &mut item.post,
            &mut item.put,
            &mut item.patch,
            &mut item.delete,
        ];
        for operation in operations.into_iter().flatten() {
            for (status, response) in &mut operation.responses.responses {
                if let RefOr::T(response) = response
                    && status.starts_with(['4', '5'])
                {
                    let media_type = Problem::MEDIA_TYPE.to_owned();
                    response
                        .content
                        .insert(media_type, RefOr::T(problem.clone()));
                }
            }
        }
    }
}
