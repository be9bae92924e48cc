//! Old paths of renamed routes. They work like the new ones until the next minor version.

use crate::{bundles, extra_evaluations, friendly_games};
use axum::routing::{MethodRouter, get, post};
use faceoff_api::paths::API_BASE;
use faceoff_service::app::App;
use utoipa::openapi::{Deprecated, OpenApi};
use utoipa_axum::router::OpenApiRouter;

/// A renamed route with one method.
struct DeprecatedRoute {
    old_path: &'static str,
    new_path: &'static str,
    /// Name of the old operation, which generated clients use for a function.
    operation_id: &'static str,
    handler: fn() -> MethodRouter<App>,
}

const DEPRECATED_ROUTES: [DeprecatedRoute; 4] = [
    DeprecatedRoute {
        old_path: "/stages/{id}/days/{day}/extra-turn",
        new_path: "/stages/{id}/days/{day}/extra-evaluation",
        operation_id: "extra_turn",
        handler: || post(extra_evaluations::grant_extra_evaluation),
    },
    DeprecatedRoute {
        old_path: "/submissions/{id}/archive",
        new_path: "/submissions/{id}/bundle",
        operation_id: "submission_archive",
        handler: || get(bundles::download_bundle),
    },
    DeprecatedRoute {
        old_path: "/submissions/{id}/archive/link",
        new_path: "/submissions/{id}/bundle/link",
        operation_id: "link_archive",
        handler: || post(bundles::link_bundle),
    },
    DeprecatedRoute {
        old_path: "/tournaments/{id}/free-games",
        new_path: "/tournaments/{id}/uncounted-games",
        operation_id: "list_free_games",
        handler: || get(friendly_games::list_uncounted_games),
    },
];

/// Serves the old paths. They are not in the OpenAPI document until [`describe`] adds them.
pub(crate) fn router() -> OpenApiRouter<App> {
    DEPRECATED_ROUTES
        .iter()
        .fold(OpenApiRouter::new(), |router, route| {
            router.route(route.old_path, (route.handler)())
        })
}

/// Adds a deprecated operation for each old path to the OpenAPI document.
pub(crate) fn describe(document: &mut OpenApi) {
    for route in DEPRECATED_ROUTES {
        let new_path = format!("{API_BASE}{}", route.new_path);
        let mut item = document.paths.paths[&new_path].clone();
        for operation in [&mut item.get, &mut item.post].into_iter().flatten() {
            operation.operation_id = Some(route.operation_id.to_owned());
            operation.deprecated = Some(Deprecated::True);
            operation.summary = Some(format!("Deprecated: the old path of {new_path}."));
        }
        let old_path = format!("{API_BASE}{}", route.old_path);
        document.paths.paths.insert(old_path, item);
    }
}
