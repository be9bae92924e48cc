//! The client against a real server on a loopback port.

use super::*;
use crate::competition::{competition, parse_weights, simulator};
use faceoff_api::{
    requests::{ComparisonQuery, DeleteSubmission, NewStage, OrNull, StagePatch},
    token::hash_token,
    views::{evaluation::EvaluationStatus, submission::SubmissionStatus},
};
use faceoff_http::{
    AgentResources, Capacity, ConnectionLimits, HttpConfig, HttpLimits, LinkKey, RateLimits,
};
use faceoff_live::LiveState;
use faceoff_metrics::{Metrics, Process};
use faceoff_store::{RunPlan, Store};
use faceoff_testkit::{
    configure_stage, finish_validation, new_store, one_shard_plan, valid_outcome,
};
use faceoff_types::{Clock, CountingResult, DayDeadline, EvaluationId, TimeLimits};
use indicatif::ProgressBar;
use jiff::Timestamp;
use tempfile::TempDir;

/// The operator's token, which has an organiser's rights.
const ADMIN: &str = "fo_admin_test";
/// The bundle limit of servers on which nothing is uploaded, or only a bundle that is too large.
const SMALL_BUNDLE_BYTES: u64 = 64;
/// The bundle limit of servers that accept the bundle of these tests.
const BUNDLE_BYTES: u64 = 1 << 20;

mod download;
mod tls;

/// A running server with an open stage, and the client of its organiser.
struct Site {
    url: String,
    organiser: Client,
    store: Store,
    folder: TempDir,
}

/// A fixed time for server and tests, so that no lease expires and the date does not change.
fn now() -> Timestamp {
    "2026-03-01T10:00:00Z".parse().unwrap()
}

/// Starts a server that accepts bundles of at most `max_bundle_bytes`.
async fn start_site(max_bundle_bytes: u64) -> Site {
    let folder = tempfile::tempdir().unwrap();
    let store = new_store(folder.path()).await;
    assert!(
        store
            .set_operator_token(hash_token(ADMIN), now())
            .await
            .unwrap()
    );
    let plan = RunPlan {
        max_faults: 0,
        ..one_shard_plan()
    };
    configure_stage(&store, &plan, None, now()).await;
    let config = HttpConfig {
        simulator: simulator(),
        max_bundle_bytes,
        downloads: std::sync::Arc::default(),
        source_url: None,
        public_url: None,
        upload_dir: folder.path().to_owned(),
        clock: Clock::new(now),
        limits: HttpLimits::default(),
        capacity: Capacity {
            longest_episode_s: competition().longest_episode_s(),
            slots: 1,
            time: TimeLimits::default(),
            runtimes: ["native", "python3"].map(str::to_owned).to_vec(),
        },
        agent_resources: AgentResources::none(),
        rate_limits: RateLimits::default(),
        link_key: LinkKey::generate().unwrap(),
        metrics: Metrics::new("0.0.0"),
        process: Process::default,
        webhooks: Default::default(),
    };
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}/", listener.local_addr().unwrap());
    let router = faceoff_http::router(store.clone(), LiveState::default(), config);
    tokio::spawn(faceoff_http::serve(
        listener,
        router,
        ConnectionLimits::default(),
        std::future::pending(),
    ));
    Site {
        organiser: Client::new(&url, Some(ADMIN), None).unwrap(),
        url,
        store,
        folder,
    }
}

/// Creates the folder of a small agent.
fn create_bundle(site: &Site) -> std::path::PathBuf {
    let folder = site.folder.path().join("my-agent");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("agent.toml"), "name = \"mine\"\n").unwrap();
    std::fs::write(folder.join("agent.py"), "pass\n").unwrap();
    folder
}

#[tokio::test]
async fn submission_passes_from_upload_to_evaluation() {
    let site = start_site(BUNDLE_BYTES).await;
    site.organiser.health().await.unwrap();
    let team = site.organiser.create_team("Alpha").await.unwrap();
    let client = site.organiser.with_token(&team.token);
    let uploaded = client.upload(&create_bundle(&site)).await.unwrap();
    assert_eq!(uploaded.file_name, "my-agent.tar.gz");
    assert_eq!(uploaded.status, SubmissionStatus::Validating);

    // The stored bundle has the files of the folder.
    let stored = site.store.submission(uploaded.id).await.unwrap();
    let archive = site.folder.path().join("arrived.tar.gz");
    site.store
        .artifacts()
        .get_to_file(&stored.bundle.key, &archive)
        .await
        .unwrap();
    let gzip = flate2::read::GzDecoder::new(std::fs::File::open(&archive).unwrap());
    let mut files: Vec<_> = tar::Archive::new(gzip)
        .entries()
        .unwrap()
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.header().entry_type().is_file())
        .map(|entry| entry.path().unwrap().file_name().unwrap().to_owned())
        .collect();
    files.sort();
    assert_eq!(files, ["agent.py", "agent.toml"]);

    let outcome = valid_outcome("native", "mine", "hello");
    finish_validation(&site.store, outcome, now()).await;
    let valid = client.submission(uploaded.id).await.unwrap();
    assert_eq!(
        valid.status,
        SubmissionStatus::Valid {
            log: Some("hello".into())
        }
    );
    assert!(valid.active);
    assert_eq!(client.activate(uploaded.id).await.unwrap(), valid);
    let me = client.me().await.unwrap();
    assert_eq!(me.active_submission, Some(uploaded.id));
    let next_cutoff = me.next_cutoff.expect("the season is open");
    assert_eq!(
        next_cutoff.to_string(),
        "2026-03-01 (UTC) at the earliest (started by the organisers)"
    );

    let day = site.organiser.start_day(None).await.unwrap();
    assert_eq!(day.evaluations.len(), 1);
    assert_eq!(day.evaluations[0].progress.episodes_total, 1);
    let listed = site.organiser.evaluations(Some(day.day)).await.unwrap();
    assert_eq!(listed, day.evaluations);
    let id = day.evaluations[0].id;
    assert_eq!(
        client.evaluation(id).await.unwrap().status,
        EvaluationStatus::Queued
    );
    assert_eq!(
        site.organiser
            .board(None, &BoardQuery::default())
            .await
            .unwrap()
            .rows,
        []
    );

    let dataset = site.folder.path().join("dataset.zip");
    let bar = ProgressBar::hidden();
    let error = client.download_dataset(id, &dataset, None, &bar).await;
    let error = error.unwrap_err();
    assert_eq!(
        error.downcast_ref::<ApiError>().unwrap().status,
        StatusCode::CONFLICT
    );
    assert!(!dataset.exists());
    let cancelled = site
        .organiser
        .cancel(id, "enough".to_owned())
        .await
        .unwrap();
    assert!(cancelled.status.is_final());
    let refusal = site.organiser.start_day(None).await.unwrap_err();
    assert!(refusal.to_string().contains("2026-03-02"), "{refusal}");
    let rerun = site.organiser.rerun(id).await.unwrap();
    assert_eq!((rerun.rerun_of, rerun.submission), (Some(id), uploaded.id));

    // The bundle can be downloaded, uses disk space, and cannot be deleted while it is active.
    let copy = site.folder.path().join("copy.tar.gz");
    let downloaded = client
        .download_submission(uploaded.id, &copy, &uploaded.blake3, &bar)
        .await;
    assert_eq!(downloaded.unwrap().bytes, uploaded.bytes);
    assert_eq!(
        std::fs::read(&copy).unwrap(),
        std::fs::read(&archive).unwrap()
    );
    let storage = client.team_storage(team.team.id).await.unwrap();
    assert_eq!((storage.bundles, storage.bundle_bytes), (1, uploaded.bytes));
    let all = site.organiser.storage().await.unwrap();
    assert_eq!(
        all[0].proposal_bytes,
        Some(0),
        "organisers see the size of the datasets of evaluations that do not count; there are none"
    );
    let deletion = DeleteSubmission::default();
    let refusal = client.delete_submission(uploaded.id, &deletion).await;
    let refusal = refusal.unwrap_err().to_string();
    assert!(refusal.contains("it is active"), "{refusal}");
    let withdrawn = client.withdraw(uploaded.id).await.unwrap();
    assert!(!withdrawn.active);
    site.organiser
        .cancel(rerun.id, "enough".to_owned())
        .await
        .unwrap();
    let deletion = DeleteSubmission {
        confirm: Some(uploaded.file_name),
        ..DeleteSubmission::default()
    };
    let deleted = client.delete_submission(uploaded.id, &deletion).await;
    assert!(deleted.unwrap().deleted.is_some());
}

#[tokio::test]
async fn invalid_bundle_is_refused_before_the_upload() {
    let site = start_site(SMALL_BUNDLE_BYTES).await;
    let team = site.organiser.create_team("Alpha").await.unwrap();
    let client = site.organiser.with_token(&team.token);
    let folder = create_bundle(&site);
    let error = client.upload(&folder).await.unwrap_err().to_string();
    assert!(
        error.contains(&format!("at most {SMALL_BUNDLE_BYTES}")),
        "{error}"
    );
    std::fs::remove_file(folder.join("agent.toml")).unwrap();
    let error = client.upload(&folder).await.unwrap_err().to_string();
    assert!(error.contains("no agent.toml"), "{error}");
    let error = client
        .upload(&site.folder.path().join("gone"))
        .await
        .unwrap_err()
        .to_string();
    assert!(error.contains("cannot be found"), "{error}");
}

#[tokio::test]
async fn api_error_keeps_status_and_detail() {
    let site = start_site(SMALL_BUNDLE_BYTES).await;
    let stranger = site.organiser.with_token("fo_team_wrong");
    let error = stranger.me().await.unwrap_err();
    let refused = error.downcast_ref::<ApiError>().unwrap();
    assert_eq!(refused.status, StatusCode::UNAUTHORIZED);
    assert!(
        error.to_string().contains("ask an organiser for one"),
        "{error}"
    );
    assert!(Client::new("ftp://127.0.0.1", None, None).is_err());
    assert!(Client::new("no address", None, None).is_err());
}

#[tokio::test]
async fn season_is_closed_only_with_its_name() {
    let site = start_site(SMALL_BUNDLE_BYTES).await;
    let refused = site
        .organiser
        .close_season("Season".to_owned())
        .await
        .unwrap_err();
    assert!(refused.to_string().contains("Season 1"), "{refused}");
    assert_eq!(site.organiser.season().await.unwrap().secret, None);
    let closed = site
        .organiser
        .close_season("Season 1".to_owned())
        .await
        .unwrap();
    let secret = site.store.season().await.unwrap().secret;
    assert_eq!(closed.secret, Some(secret));
    assert_eq!(site.organiser.season().await.unwrap(), closed);
    let id = EvaluationId::new();
    let error = site
        .organiser
        .compare(id, id, ComparisonQuery::default())
        .await
        .unwrap_err();
    assert!(error.to_string().contains(&id.to_string()), "{error}");
}

#[tokio::test]
async fn stage_change_keeps_the_fields_it_leaves_out() {
    let site = start_site(SMALL_BUNDLE_BYTES).await;
    let new = NewStage {
        name: "Final".into(),
        settings: StagePatch {
            closes_at: Some(OrNull(Some("2026-03-09T08:00:00Z".parse().unwrap()))),
            zone: Some("Europe/Berlin".parse().unwrap()),
            weights: Some(parse_weights("0.5,0.5,0").unwrap()),
            schedule: Some(OrNull(Some(
                faceoff_types::Schedule::cron("0 6 * * 1-5").unwrap(),
            ))),
            day_deadline: Some(DayDeadline::Hours(30)),
            blind: Some(true),
            counting_result: Some(CountingResult::MeanOfLast(3)),
            retention: serde_json::from_str(r#"{"last":3}"#).unwrap(),
            ..StagePatch::default()
        },
    };
    let created = site.organiser.create_stage(&new).await.unwrap();
    let schedule = created.settings.schedule.clone();
    assert_eq!(Some(OrNull(schedule)), new.settings.schedule);
    let no_change = StagePatch::default();
    let same = site
        .organiser
        .change_stage(created.id, &no_change)
        .await
        .unwrap();
    assert_eq!(same, created);
    // An explicit null clears a field.
    let cleared = StagePatch {
        closes_at: Some(OrNull(None)),
        schedule: Some(OrNull(None)),
        ..StagePatch::default()
    };
    let changed = site
        .organiser
        .change_stage(created.id, &cleared)
        .await
        .unwrap();
    assert_eq!((changed.closes_at, changed.settings.schedule), (None, None));
    assert_eq!(changed.rules, created.rules);
}

#[tokio::test(start_paused = true)]
async fn request_is_retried_while_its_failures_are_temporary() {
    use std::sync::atomic::{AtomicU32, Ordering};
    let refused = |status: StatusCode| ApiError {
        status,
        kind: String::new(),
        title: String::new(),
        detail: String::new(),
    };
    let retry_timeout = Duration::from_mins(5);
    let requests = AtomicU32::new(0);
    // A restart: the server does not answer, then it and its proxy refuse, then it answers.
    let answer = retry_temporary(retry_timeout, async || {
        match requests.fetch_add(1, Ordering::Relaxed) {
            0 | 1 => Err(Unreachable("gone".to_owned()).into()),
            2 => Err(refused(StatusCode::SERVICE_UNAVAILABLE).into()),
            3 => Err(refused(StatusCode::BAD_GATEWAY).into()),
            _ => Ok("there"),
        }
    });
    assert_eq!(answer.await.unwrap(), "there");
    assert_eq!(requests.load(Ordering::Relaxed), 5);
    let started = Instant::now();
    let unreachable = async || -> anyhow::Result<()> { Err(Unreachable("gone".to_owned()).into()) };
    let last_error = retry_temporary(retry_timeout, unreachable)
        .await
        .unwrap_err();
    assert!(last_error.is::<Unreachable>() && started.elapsed() >= retry_timeout);
    // A refusal that is not temporary is not retried.
    let started = Instant::now();
    let forbidden = async || -> anyhow::Result<()> { Err(refused(StatusCode::FORBIDDEN).into()) };
    let final_error = retry_temporary(retry_timeout, forbidden).await.unwrap_err();
    assert!(is_refused_with(&final_error, StatusCode::FORBIDDEN));
    assert_eq!(started.elapsed(), Duration::ZERO);
}
