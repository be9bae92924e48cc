//! Files for workers on other machines: the bundles that their orders name, and what they have recorded. An order opens nothing
//! else (`Grant`), and nothing once it is not its holder's any more. No part of the API: both sides are this program.

use axum::{
    Router,
    body::Body,
    extract::{FromRequestParts, Path, State},
    http::{StatusCode, header, request::Parts},
    response::{IntoResponse, Response},
    routing::{get, put},
};
use faceoff_dataset::files_of;
use faceoff_service::{
    acts::bundle_stream,
    app::App,
    problem::{Problem, ProblemKind},
    room,
};
use faceoff_store::{Store, WorkerName};
use faceoff_wire::grant::Grant;

/// The largest file of a recording, in bytes: far more than any shard has.
const LARGEST_BYTES: u64 = 4 << 30;

pub(crate) fn router() -> Router<App> {
    Router::new()
        .route("/work/bundles/{blake3}", get(bundle))
        .route("/work/files/{name}", put(store))
}

/// An order that is its sender's.
struct Holder(Grant);

impl FromRequestParts<App> for Holder {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        let refused = |why| Problem::new(ProblemKind::Forbidden, why);
        let sent = parts.headers.get(header::AUTHORIZATION);
        let sent = sent.and_then(|value| value.to_str().ok()?.strip_prefix("Grant "));
        let grant = sent.and_then(|text| Grant::open(text, &app.config.link_key.of_grants()));
        let grant = grant.ok_or_else(|| {
            refused("only workers of this server come here, with the grant of their order")
        })?;
        check_holder(&app.store, &grant).await?;
        Ok(Self(grant))
    }
}

/// The order is to be a worker's who has begun it, and who is not banned: whoever merely received it reads and writes nothing.
async fn check_holder(store: &Store, grant: &Grant) -> Result<(), Problem> {
    let refused = |why: &str| Err(Problem::new(ProblemKind::Forbidden, why));
    let Some(holder) = store.lease_holder(grant.unit, grant.nonce).await? else {
        return refused("the order is no longer this worker's");
    };
    match WorkerName::of_holder(&holder) {
        None => refused("the order is not begun by a worker"),
        Some(worker) if store.workers().ban_of(worker.as_str()).is_some() => {
            refused("the server takes nothing of this worker")
        }
        Some(_) => Ok(()),
    }
}

async fn bundle(
    Holder(grant): Holder,
    State(app): State<App>,
    Path(blake3): Path<String>,
) -> Result<Response, Problem> {
    let bundle = grant.bundle(&blake3);
    let bundle = bundle.ok_or_else(|| Problem::not_found("bundle of this order"))?;
    let (bytes, stream) = app.store.artifacts().read(&bundle.key).await?;
    let headers = [(header::CONTENT_LENGTH, bytes.to_string())];
    Ok((headers, Body::from_stream(stream)).into_response())
}

async fn store(
    Holder(grant): Holder,
    State(app): State<App>,
    Path(name): Path<String>,
    body: Body,
) -> Result<StatusCode, Problem> {
    let is_its = files_of(&grant).contains(&&*name);
    let key = grant.key_of(&name).filter(|_| is_its);
    let key = key.ok_or_else(|| Problem::not_found("file that this order stores"))?;
    if let Err(refused) = room::check(&app) {
        bundle_stream::discard(body, app.config.limits.upload_rate).await;
        return Err(refused);
    }
    let (dir, rate) = (&app.config.upload_dir, app.config.limits.upload_rate);
    let file = bundle_stream::receive_file(body, dir, LARGEST_BYTES, rate).await?;
    // Bodies take their time: whose the order is, and whether its files may change yet, is asked when all of it is here. What then
    // happens is not this connection's to interrupt.
    let stored = tokio::spawn(async move {
        let storing = app.store.workers().storing(grant.nonce);
        let _storing = storing.ok_or_else(|| {
            Problem::new(
                ProblemKind::Forbidden,
                "what came of the order is being looked at: its files stay what they are",
            )
        })?;
        check_holder(&app.store, &grant).await?;
        app.store.artifacts().put_file(&key, file.path()).await?;
        Ok(StatusCode::NO_CONTENT)
    });
    stored.await.map_err(Problem::internal)?
}
