//! Tests of the file transfer of remote workers (processes on other machines that run jobs). The grant of a job gives access to
//! the job's files while the worker holds the lease, the right to run the job for a time.

use crate::site::{Answer, GZIP, Site};
use faceoff_store::{Actor, ClaimedJob, Job, JobClaim};
use faceoff_types::BundleRef;
use faceoff_wire::{
    game::GameSpec,
    grant::{ExpectedRecording, Grant, GrantKey, WriteScope},
};
use reqwest::{Body, Method};
use serde_json::json;

/// How long a worker's lease lasts, in seconds.
const WORKER_LEASE_S: u32 = 30;

/// Sends a request with a grant.
async fn send(
    site: &Site,
    method: Method,
    path: &str,
    grant: &str,
    body: impl Into<Body>,
) -> Answer {
    let request = site
        .request(method, path, None)
        .header("authorization", format!("Grant {grant}"))
        .body(body);
    Answer::read(request.send().await.unwrap()).await
}

/// Starts an evaluation and claims its first shard. Returns also the shard's bundle, and its grant, which does not allow to
/// store files.
async fn claim_shard(site: &Site) -> (JobClaim, BundleRef, Grant) {
    site.team_with_evaluation("Alpha", "hold").await;
    let ClaimedJob { claim, job } = site.claim().await;
    let Job::Shard { bundle, .. } = job else {
        panic!("expected a shard");
    };
    let grant = Grant {
        job_id: claim.job,
        nonce: claim.nonce,
        bundles: vec![bundle.clone()],
        write_scope: WriteScope::None,
        expected_recording: ExpectedRecording::None,
        program_blake3: String::new(),
    };
    (claim, bundle, grant)
}

/// Starts the job on a remote worker, which takes the lease over.
async fn start_job(site: &Site, claim: &JobClaim) {
    let slot = "remote/rack-1/slot-0";
    let transferred = site
        .store
        .transfer_lease(claim, slot, WORKER_LEASE_S, site.now());
    assert!(transferred.await.unwrap());
}

#[tokio::test]
async fn grant_opens_its_files_while_the_lease_is_held() {
    let site = Site::start().await;
    let (claim, bundle, grant) = claim_shard(&site).await;
    let grant = Grant {
        write_scope: WriteScope::Folder("runs/of-this/lease".into()),
        expected_recording: ExpectedRecording::Game(game()),
        ..grant
    };
    let sealed = grant.seal(&site.grant_key()).unwrap();
    let bundle_path = |bundle: &BundleRef| format!("/work/bundles/{}", bundle.blake3);

    // Before a worker starts the job, the grant gives no access: several workers may have received it.
    for (method, path) in [
        (Method::GET, bundle_path(&bundle)),
        (Method::PUT, "/work/files/game.zip".to_owned()),
    ] {
        let answer = send(&site, method, &path, &sealed, "").await;
        answer.problem(403, "forbidden", &["no worker has started the job"]);
    }
    start_job(&site, &claim).await;
    let fetched = send(&site, Method::GET, &bundle_path(&bundle), &sealed, "").await;
    assert_eq!(fetched.status, 200, "{}", fetched.body);
    assert_eq!(fetched.header("content-length"), GZIP.len().to_string());
    let other_bundle = format!("/work/bundles/{}", "0".repeat(64));
    send(&site, Method::GET, &other_bundle, &sealed, "")
        .await
        .problem(404, "not-found", &["bundle of this job"]);
    let put = async |name: &str, grant: &str| {
        send(
            &site,
            Method::PUT,
            &format!("/work/files/{name}"),
            grant,
            "rows",
        )
        .await
    };
    assert_eq!(put("game.zip", &sealed).await.status, 204);
    let stored_bytes = async || {
        let key = "runs/of-this/lease/game.zip";
        site.store.artifacts().size_bytes(key).await.unwrap()
    };
    assert_eq!(stored_bytes().await, Some(b"rows".len() as u64));
    for outside in ["..%2Fanother", ".hidden", "a%20b", "steps.parquet"] {
        put(outside, &sealed).await.problem(404, "not-found", &[]);
    }

    // Refused are: a grant sealed by another server, one with the seal of another grant, and no grant.
    let foreign = grant.seal(&GrantKey::from_secret(&[7; 32])).unwrap();
    let (content, _) = sealed.split_once('.').unwrap();
    let (_, other_seal) = foreign.split_once('.').unwrap();
    for forged in [&foreign, &format!("{content}.{other_seal}"), ""] {
        put("game.zip", forged)
            .await
            .problem(403, "forbidden", &["expected the grant of a job"]);
    }
    // Also refused is a grant of another lease of the same job. The nonce identifies the lease.
    let other_lease = Grant {
        nonce: claim.job,
        ..grant
    };
    let other_lease = other_lease.seal(&site.grant_key()).unwrap();
    put("game.zip", &other_lease)
        .await
        .problem(403, "forbidden", &["no longer holds the lease"]);

    site.store.release(&claim, site.now()).await.unwrap();
    for (method, path) in [
        (Method::GET, bundle_path(&bundle)),
        (Method::PUT, "/work/files/game.zip".to_owned()),
    ] {
        send(&site, method, &path, &sealed, "").await.problem(
            403,
            "forbidden",
            &["no longer holds the lease"],
        );
    }
}

#[tokio::test]
async fn files_that_are_read_whole_are_small() {
    let site = Site::start().await;
    let (claim, _, grant) = claim_shard(&site).await;
    let spec = json!({
        "task": "hit", "episodes": { "start": 0, "end": 1 }, "profile": "ideal", "seed": "0".repeat(64),
        "mismatch_seed": "0".repeat(64), "max_faults": 3,
    });
    let grant = Grant {
        write_scope: WriteScope::Folder("runs/of-this/lease".into()),
        expected_recording: ExpectedRecording::Shard(serde_json::from_value(spec).unwrap()),
        ..grant
    };
    let sealed = grant.seal(&site.grant_key()).unwrap();
    start_job(&site, &claim).await;
    let put = async |bytes| {
        let path = "/work/files/shard.json";
        send(&site, Method::PUT, path, &sealed, vec![b' '; bytes]).await
    };
    assert_eq!(put(1 << 20).await.status, 204);
    put((1 << 20) + 1)
        .await
        .problem(413, "too-large", &["1048576"]);
}

/// A worker may report a job as done while it still sends a file. Such a file must not replace the one that was checked.
#[tokio::test]
async fn late_upload_does_not_replace_a_checked_file() {
    let site = Site::start().await;
    let (claim, _, grant) = claim_shard(&site).await;
    start_job(&site, &claim).await;
    let grant = Grant {
        bundles: Vec::new(),
        write_scope: WriteScope::Folder("runs/of-this/lease".into()),
        expected_recording: ExpectedRecording::Game(game()),
        ..grant
    };
    let sealed = grant.seal(&site.grant_key()).unwrap();
    let stored_bytes = async |name: &str| {
        let key = format!("runs/of-this/lease/{name}");
        site.store.artifacts().size_bytes(&key).await.unwrap()
    };
    // Starts an upload and sends its first half. Returns a sender for the rest, and the task that gets the answer.
    let start_upload = async |name: &'static str| {
        let (rest, body) = tokio::sync::mpsc::channel::<Result<&'static [u8], std::io::Error>>(1);
        rest.send(Ok(b"forged ")).await.unwrap();
        let body = futures::stream::unfold(body, async |mut body| Some((body.recv().await?, body)));
        let request = site
            .request(Method::PUT, &format!("/work/files/{name}"), None)
            .header("authorization", format!("Grant {sealed}"))
            .body(reqwest::Body::wrap_stream(body));
        let answer = tokio::spawn(request.send());
        // The server receives the upload once there is a temporary file.
        while std::fs::read_dir(site.folder.path().join("uploads"))
            .unwrap()
            .count()
            == 0
        {
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
        }
        (rest, answer)
    };
    let (rest, answer) = start_upload("game.zip").await;
    assert!(
        site.live.workers.close_files(claim.nonce),
        "nothing is being stored"
    );
    rest.send(Ok(b"rows")).await.unwrap();
    drop(rest);
    let answer = Answer::read(answer.await.unwrap().unwrap()).await;
    answer.problem(403, "forbidden", &["its files cannot be changed"]);
    assert_eq!(stored_bytes("game.zip").await, None);

    // After the check, when the lease is over, the file cannot be replaced either.
    site.live.workers.forget_files(claim.nonce);
    let (rest, answer) = start_upload("game.zip").await;
    site.store.release(&claim, site.now()).await.unwrap();
    rest.send(Ok(b"rows")).await.unwrap();
    drop(rest);
    let answer = Answer::read(answer.await.unwrap().unwrap()).await;
    answer.problem(403, "forbidden", &["no longer holds the lease"]);
    assert_eq!(stored_bytes("game.zip").await, None);
}

#[tokio::test]
async fn banned_worker_loses_access() {
    let site = Site::start().await;
    let (claim, bundle, grant) = claim_shard(&site).await;
    let sealed = grant.seal(&site.grant_key()).unwrap();
    let path = format!("/work/bundles/{}", bundle.blake3);
    start_job(&site, &claim).await;
    assert_eq!(
        send(&site, Method::GET, &path, &sealed, "").await.status,
        200
    );
    let worker = "rack-1".parse().unwrap();
    let ban = site
        .store
        .ban_worker(Actor::Operator, &worker, "it lies", site.now());
    ban.await.unwrap();
    send(&site, Method::GET, &path, &sealed, "").await.problem(
        403,
        "forbidden",
        &["no longer holds the lease"],
    );
    // A job that the worker starts at the moment of the ban, so that its lease is newer than the ban.
    let ClaimedJob { claim, .. } = site.claim().await;
    start_job(&site, &claim).await;
    let grant = Grant {
        job_id: claim.job,
        nonce: claim.nonce,
        ..grant
    };
    let sealed = grant.seal(&site.grant_key()).unwrap();
    send(&site, Method::GET, &path, &sealed, "").await.problem(
        403,
        "forbidden",
        &["this worker is banned"],
    );
}

/// The spec of a game job.
fn game() -> GameSpec {
    let spec = json!({
        "ruleset": "airhockey-2023.3", "steps": 500, "profile": "ideal", "seed": "0".repeat(64),
        "mismatch_seed": "0".repeat(64), "perturbations": {},
    });
    serde_json::from_value(spec).unwrap()
}
