//! Bundles, the files that teams upload as submissions: downloading and deleting them.

use super::{
    document::{Binary, FileHeaders},
    downloads::{Download, download},
};
use crate::download_links::{self, LinkOr, LinkQuery};
use axum::{Json, extract::State, http::StatusCode, response::Response};
use faceoff_api::{
    paths,
    requests::{DeleteSubmission, NewLink},
    views::{link::LinkView, submission::SubmissionView},
};
use faceoff_service::{
    app::App,
    archive_contents,
    auth::Caller,
    extract::{OptionalJson, PathParam},
    problem::Problem,
    request_preconditions::RequestPreconditions,
    services::decision_preview::checked_reason,
    views::submission,
};
use faceoff_store::{StoreError, Submission};
use faceoff_types::SubmissionId;

/// Downloads the bundle as it was uploaded. For its team and organisers.
#[utoipa::path(
    get, path = "/submissions/{id}/bundle", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = SubmissionId, Path), FileHeaders, LinkQuery),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 403, description = "the link is invalid"),
        (status = 404),
        (status = 410, description = "the bundle was removed, the detail says when and why; or the link has expired"),
    )
)]
pub(crate) async fn download_bundle(
    LinkOr(caller): LinkOr<Caller>,
    conditions: RequestPreconditions,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Response, Problem> {
    let submission = find_downloadable(&caller, &app, id).await?;
    let bundle = &submission.bundle;
    let stored_name = bundle.key.rsplit('/').next().unwrap_or_default();
    let extension = stored_name.split_once('.').map_or("bundle", |(_, end)| end);
    let file = Download {
        key: &bundle.key,
        blake3: Some(&bundle.blake3),
        media_type: "application/octet-stream",
        name: &format!("faceoff-submission-{id}.{extension}"),
    };
    match download(&app, &conditions, file).await {
        Err(StoreError::NotFound(_)) => {
            // The bundle may have been removed meanwhile. Otherwise the file is lost.
            check_stored(&app.store.submission(id).await?)?;
            Err(Problem::internal(format_args!("{} is lost", file.key)))
        }
        result => Ok(result?),
    }
}

/// Creates a link that downloads the bundle without a token for a limited time. For callers who may download it now.
///
/// Permissions are checked when the link is used, as for its creator.
#[utoipa::path(
    post, path = "/submissions/{id}/bundle/link", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = SubmissionId, Path)),
    request_body(content = Option<NewLink>, content_type = "application/json"),
    responses(
        (status = 201, body = LinkView),
        (status = 404),
        (status = 410, description = "the bundle was removed"),
        (status = 422),
    )
)]
pub(crate) async fn link_bundle(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
    OptionalJson(request): OptionalJson<NewLink>,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    find_downloadable(&caller, &app, id).await?;
    let path = format!("{}/bundle", paths::submission(id));
    download_links::link(&app, &caller, &path, request).await
}

/// A submission whose bundle the caller may download now.
async fn find_downloadable(
    caller: &Caller,
    app: &App,
    id: SubmissionId,
) -> Result<Submission, Problem> {
    let found = app.store.submission(id).await;
    let submission = caller.visible("submission", found, |submission| submission.team)?;
    // The file of a deleted bundle may be kept as evidence, say of a disqualified team: organisers can download it as long as it exists.
    if !caller.is_organiser() {
        check_stored(&submission)?;
    }
    archive_contents::check_included(app, &submission.bundle.key, "submission").await?;
    Ok(submission)
}

fn check_stored(submission: &Submission) -> Result<(), Problem> {
    match &submission.bundle_removed {
        Some(removed) => Err(Problem::removed("the bundle of the submission", removed)),
        None => Ok(()),
    }
}

/// Deletes the bundle of a valid submission for good: it cannot be evaluated again.
///
/// Its name, hash, log and results stay, and so do its rows on boards. For its team, and for organisers, who give a
/// reason.
#[utoipa::path(
    delete, path = "/submissions/{id}", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = SubmissionId, Path)),
    request_body(content = Option<DeleteSubmission>, content_type = "application/json"),
    responses(
        (status = 200, body = SubmissionView),
        (status = 404),
        (status = 409, description = "not confirmed with the bundle's file name (nothing is done); the submission is active, pending or running, needed by an unreleased day or a proposal, kept as evidence, or already deleted"),
        (status = 422, description = "an organiser gave no reason"),
    )
)]
pub(crate) async fn delete_submission(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
    OptionalJson(request): OptionalJson<DeleteSubmission>,
) -> Result<Json<SubmissionView>, Problem> {
    let found = app.store.submission(id).await;
    caller.visible("submission", found, |submission| submission.team)?;
    let reason = match (caller.is_organiser(), request.reason.as_deref()) {
        (true, reason) => {
            let reason = checked_reason(reason.unwrap_or_default())?;
            format!("by an organiser: {reason}")
        }
        (false, Some(reason)) => format!("by its team: {}", checked_reason(reason)?),
        (false, None) => "by its team".to_owned(),
    };
    let now = app.config.clock.now();
    let submission = app.store.check_deletable(id, now).await?;
    let name = &submission.bundle.file_name;
    let effect = format!(
        "the bundle {name:?} of {} bytes, uploaded on {}, will be deleted for good and cannot be evaluated again; its \
         name, hash, log and results stay",
        submission.bundle.bytes,
        submission.created_at.strftime("%Y-%m-%d at %H:%M UTC")
    );
    Problem::check_confirmed(request.confirm.as_deref(), name, &effect)?;
    let deleted = app
        .store
        .delete_submission(caller.actor(), id, &reason, now)
        .await?;
    tracing::info!(submission = %id, actor = %caller.actor(), reason, "submission deleted");
    submission::build(&app, deleted).await.map(Json)
}
