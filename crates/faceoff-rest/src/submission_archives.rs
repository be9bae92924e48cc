//! The archives of submissions: downloaded, and deleted.

use super::{
    document::{Binary, FileHeaders},
    downloads::{Download, download},
};
use crate::links::{self, LinkOr, LinkQuery};
use axum::{Json, extract::State, http::StatusCode, response::Response};
use faceoff_api::{
    paths,
    requests::{DeleteSubmission, NewLink},
    views::{link::LinkView, submission::SubmissionView},
};
use faceoff_service::{
    acts::deciding::checked_reason,
    app::App,
    archived,
    auth::Caller,
    conditions::Conditions,
    extract::{OptionalJson, PathParam},
    problem::Problem,
    views::submission,
};
use faceoff_store::{StoreError, Submission};
use faceoff_types::SubmissionId;

/// The archive as it was uploaded; for its team and the organiser.
#[utoipa::path(
    get, path = "/submissions/{id}/archive", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = SubmissionId, Path), FileHeaders, LinkQuery),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 403, description = "the link is not good"),
        (status = 404),
        (status = 410, description = "it was removed, and the detail says when and why; or the link has expired"),
    )
)]
pub(crate) async fn submission_archive(
    LinkOr(caller): LinkOr<Caller>,
    conditions: Conditions,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Response, Problem> {
    let submission = downloadable(&caller, &app, id).await?;
    let bundle = &submission.bundle;
    let stored_as = bundle.key.rsplit('/').next().unwrap_or_default();
    let format = stored_as.split_once('.').map_or("bundle", |(_, end)| end);
    let file = Download {
        key: &bundle.key,
        blake3: Some(&bundle.blake3),
        media_type: "application/octet-stream",
        name: &format!("faceoff-submission-{id}.{format}"),
    };
    match download(&app, &conditions, file).await {
        Err(StoreError::NotFound(_)) => {
            // It may have gone meanwhile.
            check_kept(&app.store.submission(id).await?)?;
            Err(Problem::internal(format_args!("{} is lost", file.key)))
        }
        answer => Ok(answer?),
    }
}

/// A link that downloads the archive without a token, for a time; made by whoever may download it now.
///
/// What it opens is decided when it is followed, as if whoever made it asked then.
#[utoipa::path(
    post, path = "/submissions/{id}/archive/link", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = SubmissionId, Path)),
    request_body(content = Option<NewLink>, content_type = "application/json"),
    responses(
        (status = 201, body = LinkView),
        (status = 404),
        (status = 410, description = "it was removed"),
        (status = 422),
    )
)]
pub(crate) async fn link_archive(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
    OptionalJson(wanted): OptionalJson<NewLink>,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    downloadable(&caller, &app, id).await?;
    let path = format!("{}/archive", paths::submission(id));
    links::link(&app, &caller, &path, wanted).await
}

/// A submission whose archive the caller may have now.
async fn downloadable(caller: &Caller, app: &App, id: SubmissionId) -> Result<Submission, Problem> {
    let found = app.store.submission(id).await;
    let submission = caller.visible("submission", found, |submission| submission.team)?;
    // An organiser gets at evidence as long as the file is there, whoever had it deleted.
    if !caller.is_organiser() {
        check_kept(&submission)?;
    }
    archived::check_kept(app, &submission.bundle.key, "submission").await?;
    Ok(submission)
}

fn check_kept(submission: &Submission) -> Result<(), Problem> {
    match &submission.archive_removed {
        Some(removed) => Err(Problem::removed("the archive of the submission", removed)),
        None => Ok(()),
    }
}

/// Has the archive of a valid submission removed, for good: nobody can play it again.
///
/// Its name, its hash, its log and what it has played stay, and so do rows on boards. By its team, or an organiser, who
/// says why.
#[utoipa::path(
    delete, path = "/submissions/{id}", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = SubmissionId, Path)),
    request_body(content = Option<DeleteSubmission>, content_type = "application/json"),
    responses(
        (status = 200, body = SubmissionView),
        (status = 404),
        (status = 409, description = "not confirmed with the name of its archive (nothing is done), active, queued or playing, needed by a day that is not released or by a proposal, kept as evidence, or gone"),
        (status = 422, description = "an organiser gave no reason"),
    )
)]
pub(crate) async fn delete_submission(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
    OptionalJson(wanted): OptionalJson<DeleteSubmission>,
) -> Result<Json<SubmissionView>, Problem> {
    let found = app.store.submission(id).await;
    caller.visible("submission", found, |submission| submission.team)?;
    let reason = match (caller.is_organiser(), wanted.reason.as_deref()) {
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
    let what = format!(
        "the archive {name:?} of {} bytes, uploaded on {}, would be removed for good, and nobody could play it again; its \
         name, hash and log, and all that it has played, would stay",
        submission.bundle.bytes,
        submission.created_at.strftime("%Y-%m-%d at %H:%M UTC")
    );
    Problem::check_confirmed(wanted.confirm.as_deref(), name, &what)?;
    let deleted = app
        .store
        .delete_submission(caller.actor(), id, &reason, now)
        .await?;
    tracing::info!(submission = %id, actor = %caller.actor(), reason, "submission deleted");
    submission::of(&app, deleted).await.map(Json)
}
