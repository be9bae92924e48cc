//! File transfer of remote workers, which are processes on other machines that run jobs. A worker downloads the bundles
//! (uploaded agents) of its job, and uploads the job's recordings. The grant of a job (`Grant`) gives access to these files
//! only, and only while the worker holds the job's lease: the right to run it for a time. These routes are not part of the
//! API, because workers and server are the same program.

use axum::{
    Router,
    body::Body,
    extract::{FromRequestParts, Path, State},
    http::{StatusCode, header, request::Parts},
    response::{IntoResponse, Response},
    routing::{get, put},
};
use faceoff_dataset::{max_file_bytes, writable_files};
use faceoff_service::{
    app::App,
    credential, free_space,
    problem::{Problem, ProblemKind},
    services::bundle_stream,
};
use faceoff_store::Store;
use faceoff_types::WorkerName;
use faceoff_wire::grant::Grant;

pub(crate) fn router() -> Router<App> {
    Router::new()
        .route("/work/bundles/{blake3}", get(bundle))
        .route("/work/files/{name}", put(store_file))
}

/// The grant of a job whose lease the sender holds.
struct LeaseHolder(Grant);

impl FromRequestParts<App> for LeaseHolder {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        let forbidden = |reason| Problem::new(ProblemKind::Forbidden, reason);
        let grant = credential::sealed_grant(&parts.headers)
            .and_then(|text| Grant::open(text, &app.config.link_key.grant_key()));
        let grant = grant.ok_or_else(|| {
            forbidden("expected the grant of a job of this server (Authorization: Grant …)")
        })?;
        check_holder(&app.store, &grant).await?;
        Ok(Self(grant))
    }
}

/// Checks that the lease is held by a worker that has started the job and is not banned. A worker that has received the job
/// but not started it may read and write nothing.
async fn check_holder(store: &Store, grant: &Grant) -> Result<(), Problem> {
    let forbidden = |reason: &str| Err(Problem::new(ProblemKind::Forbidden, reason));
    let Some(holder) = store.lease_holder(grant.job_id, grant.nonce).await? else {
        return forbidden("this worker no longer holds the lease of the job");
    };
    match WorkerName::from_holder(&holder) {
        None => forbidden("no worker has started the job"),
        Some(worker) if store.ban_reason(&worker).await?.is_some() => {
            forbidden("this worker is banned")
        }
        Some(_) => Ok(()),
    }
}

async fn bundle(
    LeaseHolder(grant): LeaseHolder,
    State(app): State<App>,
    Path(blake3): Path<String>,
) -> Result<Response, Problem> {
    let bundle = grant.bundle(&blake3);
    let bundle = bundle.ok_or_else(|| Problem::not_found("bundle of this job"))?;
    let (bytes, stream) = app.store.artifacts().read(&bundle.key).await?;
    let headers = [(header::CONTENT_LENGTH, bytes.to_string())];
    Ok((headers, Body::from_stream(stream)).into_response())
}

async fn store_file(
    LeaseHolder(grant): LeaseHolder,
    State(app): State<App>,
    Path(name): Path<String>,
    body: Body,
) -> Result<StatusCode, Problem> {
    let is_writable = writable_files(&grant).contains(&&*name);
    let key = grant.storage_key(&name).filter(|_| is_writable);
    let key = key.ok_or_else(|| Problem::not_found("file of this job's recording"))?;
    free_space::check(&app)?;
    let (dir, rate) = (&app.config.upload_dir, app.config.limits.min_upload_rate);
    let file = bundle_stream::receive_file(body, dir, max_file_bytes(&name), rate).await?;
    // A body takes time to arrive. So the lease, and whether files may still change, are checked when it is complete. From
    // then on the storing is a task of its own, which a closed connection does not interrupt.
    let stored = tokio::spawn(async move {
        let upload_guard = app.live.workers.begin_upload(grant.nonce);
        let _upload_guard = upload_guard.ok_or_else(|| {
            Problem::new(
                ProblemKind::Forbidden,
                "the result of the job is being checked; its files cannot be changed any more",
            )
        })?;
        check_holder(&app.store, &grant).await?;
        app.store.artifacts().put_file(&key, file.path()).await?;
        Ok(StatusCode::NO_CONTENT)
    });
    stored.await.map_err(Problem::internal)?
}
