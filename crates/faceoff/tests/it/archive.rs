//! The season's archive: exported from a server, imported into a data folder, and served read-only. The *public edition* has what
//! visitors may see, the *organiser edition* everything.

use crate::program::{command, faceoff_in};
use faceoff_airhockey::HIT;
use faceoff_api::token::hash_token;
use faceoff_archive::{Edition, Entry, FORMAT, Manifest, Writer};
use faceoff_http::{
    AgentResources, Capacity, ConnectionLimits, HttpConfig, HttpLimits, LinkKey, RateLimits,
};
use faceoff_live::LiveState;
use faceoff_metrics::{Metrics, Process};
use faceoff_store::{Actor, ClaimedJob, Job, MissingSummaries, RunPlan, Store};
use faceoff_testkit::{
    bundle_ref, create_team, new_store, one_shard_plan, outcome, rules_and_settings, shard_commit,
    shard_outcomes, submit, valid_outcome,
};
use faceoff_types::{
    Clock, EvaluationId, EvaluationResult, IanaTimeZone, StageSettings, TimeLimits,
};
use jiff::Timestamp;
use serde_json::Value;
use std::{
    fs,
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
};
use tempfile::TempDir;

/// The operator's token, which has an organiser's rights.
const ADMIN: &str = "fo_admin_test";
/// How long a claimed job is leased.
const LEASE_SECONDS: u32 = 60;

/// A fixed time for server and tests.
fn now() -> Timestamp {
    "2026-03-01T10:00:00Z".parse().unwrap()
}

/// Standard output of a command that succeeded.
#[track_caller]
fn stdout(output: &Output) -> String {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Checks that a command failed, with all of `expected` in its error.
#[track_caller]
fn assert_refused(output: &Output, expected: &[&str]) {
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let stderr = String::from_utf8_lossy(&output.stderr);
    for part in expected {
        assert!(stderr.contains(part), "{part:?} is not in {stderr:?}");
    }
}

/// A server with a season that has one evaluation with a real dataset.
struct TestServer {
    url: String,
    store: Store,
    folder: TempDir,
    evaluation: EvaluationId,
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/fixtures")
        .join(name)
}

async fn start_test_server() -> TestServer {
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
    let (rules, settings) = rules_and_settings(&plan);
    let settings = StageSettings {
        publishes: faceoff_types::Publication::AtRelease,
        ..settings
    };
    store
        .configure_stage(rules, settings, IanaTimeZone::UTC, now())
        .await
        .unwrap();
    let evaluation = run_day(&store).await;
    let config = HttpConfig {
        simulator: faceoff_airhockey::simulator(),
        max_bundle_bytes: 64,
        downloads: std::sync::Arc::default(),
        source_url: None,
        public_url: None,
        upload_dir: folder.path().to_owned(),
        clock: Clock::new(now),
        limits: HttpLimits::default(),
        capacity: Capacity {
            longest_episode_s: faceoff_airhockey::competition().longest_episode_s(),
            runtimes: Vec::new(),
            slots: 1,
            time: TimeLimits::default(),
        },
        agent_resources: AgentResources::none(),
        rate_limits: RateLimits::default(),
        link_key: LinkKey::generate().unwrap(),
        metrics: Metrics::new("0.0.0"),
        process: Process::default,
        webhooks: Default::default(),
    };
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let router = faceoff_http::router(store.clone(), LiveState::default(), config);
    tokio::spawn(faceoff_http::serve(
        listener,
        router,
        ConnectionLimits::default(),
        std::future::pending(),
    ));
    TestServer {
        url,
        store,
        folder,
        evaluation,
    }
}

/// Runs an evaluation day of one team.
async fn run_day(store: &Store) -> EvaluationId {
    let team = create_team(store, "Alpha", now()).await;
    let bundle = bundle_ref("bundles/abc", b"abc");
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), "abc").unwrap();
    store
        .artifacts()
        .put_file(&bundle.key, file.path())
        .await
        .unwrap();
    submit(store, team.id, bundle, now()).await;
    let mut stage = Some(store.stages().await.unwrap()[0].id);
    loop {
        let claimed = store.claim("slot 0", LEASE_SECONDS, now()).await.unwrap();
        let Some(ClaimedJob { claim, job }) = claimed else {
            panic!("there is no job, but the day is not over");
        };
        match job {
            Job::Game { .. } => panic!("no game is queued"),
            Job::Validation { .. } => {
                let outcome = valid_outcome("native", "striker", "");
                store
                    .commit_validation(&claim, outcome, now())
                    .await
                    .unwrap();
                let stage = stage.take().unwrap();
                store
                    .start_day(Actor::Operator, stage, now())
                    .await
                    .unwrap();
            }
            Job::Shard { run, shard, .. } => {
                let outcomes =
                    shard_outcomes(&shard, |task, episode| outcome(task, episode, false));
                let commit = shard_commit(outcomes, Some(claim.recording_key(run.id)));
                assert_eq!(shard.episodes(), 1);
                store.commit_shard(&claim, commit, now()).await.unwrap();
            }
            Job::Scoring {
                evaluation,
                run,
                seeds,
                ..
            } => {
                let outcomes = store.outcomes(run.id).await.unwrap();
                let bounds = faceoff_airhockey::competition().tier_bounds(&run.plan.variation);
                let task = faceoff_scoring::score_task(
                    &faceoff_airhockey::competition(),
                    &outcomes,
                    &Default::default(),
                    bounds,
                );
                let result: EvaluationResult = faceoff_scoring::score_evaluation(
                    run.ruleset,
                    run.plan.profile,
                    seeds.episodes,
                    &run.plan.variation,
                    &faceoff_airhockey::competition().weights(&run.plan.variation),
                    bounds,
                    [(HIT, task)].into(),
                );
                let dataset = fixture("dataset-layout-3.zip");
                let key = format!("datasets/{evaluation}.zip");
                store.artifacts().put_file(&key, &dataset).await.unwrap();
                let hash = blake3::hash(&fs::read(&dataset).unwrap()).to_string();
                store
                    .finish_evaluation(&claim, &result, &key, &hash, now())
                    .await
                    .unwrap();
                return evaluation;
            }
        }
    }
}

/// Runs a blocking function beside the runtime on which the server runs.
async fn blocking<T: Send + 'static>(function: impl FnOnce() -> T + Send + 'static) -> T {
    tokio::task::spawn_blocking(function).await.unwrap()
}

/// A running `faceoff serve`, killed on drop.
struct ServeProcess {
    child: Child,
    url: String,
}

impl ServeProcess {
    fn start(folder: &Path, data: &str) -> Self {
        let mut child = command(&["serve", "--data-dir", data, "--listen", "127.0.0.1:0"])
            .current_dir(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut url = String::new();
        BufReader::new(child.stdout.take().unwrap())
            .read_line(&mut url)
            .unwrap();
        Self {
            child,
            url: url.trim().to_owned(),
        }
    }

    /// Terminates the server like a service manager; returns its log.
    fn terminate(mut self) -> String {
        let pid = self.child.id().to_string();
        assert!(
            Command::new("kill")
                .args(["-TERM", &pid])
                .status()
                .unwrap()
                .success()
        );
        let mut log = String::new();
        self.child
            .stderr
            .take()
            .unwrap()
            .read_to_string(&mut log)
            .unwrap();
        assert!(self.child.wait().unwrap().success(), "{log}");
        log
    }
}

impl Drop for ServeProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Status and body of a GET request.
async fn get(url: String, token: Option<&str>) -> (u16, String) {
    let no_tls = rustls::ClientConfig::builder()
        .with_root_certificates(rustls::RootCertStore::empty())
        .with_no_client_auth();
    let client = reqwest::Client::builder()
        .no_proxy()
        .tls_backend_preconfigured(no_tls)
        .build()
        .unwrap();
    let request = client.get(url);
    let request = match token {
        Some(token) => request.bearer_auth(token),
        None => request,
    };
    let answer = request.send().await.unwrap();
    (answer.status().as_u16(), answer.text().await.unwrap())
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn exported_season_is_shown_on_another_host() {
    let server = start_test_server().await;
    let other_host = tempfile::tempdir().unwrap();
    let folder = other_host.path().to_owned();
    let url = server.url.clone();
    blocking(move || {
        let export = |arguments: &[&str]| {
            let command = ["admin", "--server", &url, "--token", ADMIN, "export"];
            faceoff_in(&folder, &[&command[..], arguments].concat())
        };
        let message = stdout(&export(&["public.tar.zst", "--public"]));
        assert!(
            message.contains("the public archive of \"Season 1\" of 2026-03-01 10:00:00"),
            "{message}"
        );
        assert_refused(
            &export(&["public.tar.zst"]),
            &["already exists and was not changed"],
        );
        let message: Value =
            serde_json::from_str(&stdout(&export(&["--json", "all.tar.zst"]))).unwrap();
        assert_eq!(message["edition"], "organiser");
        let mut files: Vec<_> = fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name())
            .collect();
        files.sort();
        assert_eq!(files, ["all.tar.zst", "public.tar.zst"]);
        for name in ["public", "all"] {
            let archive = format!("{name}.tar.zst");
            let message = stdout(&faceoff_in(&folder, &["import", &archive, "--data", name]));
            let manifest = fs::read(folder.join(name).join("archive/manifest.json")).unwrap();
            let manifest: Value = serde_json::from_slice(&manifest).unwrap();
            assert_eq!(manifest["season"], "Season 1");
            assert!(
                message.contains(&format!("faceoff serve --data-dir {name}")),
                "{message}"
            );
        }
        assert_refused(
            &faceoff_in(&folder, &["import", "all.tar.zst", "--data", "all"]),
            &["all is not empty", "its own folder"],
        );
        // The dataset can be verified without the server.
        let dataset = fs::read_dir(folder.join("public/artifacts/datasets"))
            .unwrap()
            .next();
        let dataset = dataset.unwrap().unwrap().path();
        assert_eq!(
            fs::read(&dataset).unwrap(),
            fs::read(fixture("dataset-layout-3.zip")).unwrap()
        );
        let verified = faceoff_in(&folder, &["verify", dataset.to_str().unwrap()]);
        let original = faceoff_in(
            &folder,
            &["verify", fixture("dataset-layout-3.zip").to_str().unwrap()],
        );
        assert_eq!(verified.status, original.status, "{verified:?}");
        assert!(verified.status.success(), "{verified:?}");
    })
    .await;

    let board = get(format!("{}/api/v1/board", server.url), None).await;
    assert!(board.1.contains("Alpha"), "{board:?}");
    for name in ["public", "all"] {
        let folder = other_host.path().to_owned();
        // Files of an export that was interrupted. The next start must remove them.
        let interrupted = folder.join(name).join("uploads/archive-left");
        fs::create_dir_all(&interrupted).unwrap();
        fs::write(interrupted.join("snapshot.sqlite3"), "with secrets").unwrap();
        let served = blocking(move || ServeProcess::start(&folder, name)).await;
        assert!(!interrupted.exists());
        assert_eq!(
            get(format!("{}/api/v1/board", served.url), None).await,
            board
        );
        let path = format!("/api/v1/evaluations/{}", server.evaluation);
        let (status, _) = get(format!("{}{path}/dataset", served.url), None).await;
        assert_eq!(status, 200, "{name}");
        let (_, page) = get(served.url.clone(), None).await;
        assert!(page.contains("Archived season"), "{page}");
        let token = fs::read_to_string(other_host.path().join(name).join("admin-token")).unwrap();
        let (status, events) =
            get(format!("{}/api/v1/events", served.url), Some(token.trim())).await;
        assert_eq!(status, 200, "{events}");
        let (status, _) = get(format!("{}/api/v1/events", served.url), Some(ADMIN)).await;
        assert_eq!(status, 401, "the token of the old server is invalid");
        let log = blocking(move || served.terminate()).await;
        assert!(
            log.contains("serving an archived season read-only"),
            "{log}"
        );
        assert!(
            !log.contains("runtime files"),
            "no runtimes are prepared: {log}"
        );
    }
    drop(server.folder);
    server.store.close().await;
}

/// Writes an archive with these files.
fn write_archive(folder: &Path, name: &str, files: &[(&str, &[u8])], edition: Edition) {
    let entries = files.iter().map(|(path, content)| Entry {
        path: (*path).to_owned(),
        bytes: content.len() as u64,
        blake3: blake3::hash(content).to_string(),
    });
    let manifest = Manifest {
        format: FORMAT,
        program: "a test".into(),
        season: "Season 1".into(),
        made_at: now(),
        edition,
        left_out: Vec::new(),
        files: entries.collect(),
    };
    let mut writer = Writer::begin(Vec::new(), &manifest).unwrap();
    let find = |entry: &Entry| {
        let found = files.iter().find(|(path, _)| *path == entry.path);
        Ok(found.unwrap().1)
    };
    while writer.next(find).unwrap() {}
    fs::write(folder.join(name), writer.finish().unwrap()).unwrap();
}

#[tokio::test]
async fn refused_import_leaves_nothing() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let store = Store::open(&folder.join("running")).await.unwrap();
    let snapshot = store
        .snapshot(
            folder,
            faceoff_store::Edition::Public,
            "a test",
            &MissingSummaries::default(),
            now(),
        )
        .await
        .unwrap();
    let database = folder.join("database");
    snapshot.finish(&database).await.unwrap();
    let database = fs::read(database).unwrap();
    // The database of a live server, which was not made for an archive.
    let live_database = {
        store.checkpoint().await.unwrap();
        store.close().await;
        fs::read(folder.join("running/faceoff.sqlite3")).unwrap()
    };
    fs::write(folder.join("text"), "no archive").unwrap();
    write_archive(
        folder,
        "without-database",
        &[("README.txt", b"")],
        Edition::Public,
    );
    write_archive(
        folder,
        "live-database.tar.zst",
        &[("database.sqlite3", &live_database)],
        Edition::Public,
    );
    write_archive(
        folder,
        "mixed-editions",
        &[("database.sqlite3", &database)],
        Edition::Organiser,
    );
    write_archive(
        folder,
        "good",
        &[("database.sqlite3", &database)],
        Edition::Public,
    );
    fs::create_dir(folder.join("empty")).unwrap();
    let import =
        |archive: &str, data: &str| faceoff_in(folder, &["import", archive, "--data", data]);
    for (archive, expected) in [
        ("none", &["none is not imported", "No such file"][..]),
        ("text", &["expected a .tar.zst"]),
        ("without-database", &["it contains no database.sqlite3"]),
        (
            "live-database.tar.zst",
            &[
                "database is refused",
                "description of the archive is missing",
            ],
        ),
        (
            "mixed-editions",
            &[
                "its manifest is of the organiser edition",
                "its database of the public edition",
            ],
        ),
    ] {
        for data in ["new", "empty"] {
            assert_refused(&import(archive, data), expected);
        }
        assert!(!folder.join("new").exists());
        assert!(!folder.join("new.importing").exists());
        assert_eq!(fs::read_dir(folder.join("empty")).unwrap().count(), 0);
    }
    assert_refused(&import("good", "/"), &["not empty"]);

    // A foreign folder with the temporary name is kept; that of an interrupted import is removed.
    fs::create_dir(folder.join("new.importing")).unwrap();
    assert_refused(&import("good", "new"), &["new.importing already exists"]);
    fs::write(folder.join("new.importing/faceoff-import.lock"), "").unwrap();
    fs::create_dir(folder.join("new.importing/data")).unwrap();
    for data in ["new", "empty"] {
        let message = stdout(&import("good", data));
        assert!(message.contains("imported the public archive"), "{message}");
        let found = Store::archived_in(&folder.join(data))
            .await
            .unwrap()
            .unwrap();
        assert!(found.imported_at.is_some());
    }
    assert!(!folder.join("new.importing").exists());
}

#[tokio::test]
async fn data_folder_of_an_earlier_version_can_be_archived() {
    let folder = tempfile::tempdir().unwrap();
    let file = fs::File::open(fixture("data-folder-e67a08c.tar.gz")).unwrap();
    tar::Archive::new(flate2::read::GzDecoder::new(file))
        .unpack(folder.path())
        .unwrap();
    let store = Store::open(&folder.path().join("data")).await.unwrap();
    let runs = store.unsummarised_runs(0).await.unwrap();
    let summaries = MissingSummaries {
        version: 0,
        json_by_run: runs.iter().map(|run| (*run, "{}".to_owned())).collect(),
    };
    for edition in [
        faceoff_store::Edition::Public,
        faceoff_store::Edition::Organiser,
    ] {
        let target = tempfile::tempdir().unwrap();
        let snapshot = store
            .snapshot(target.path(), edition, "a test", &summaries, now())
            .await
            .unwrap();
        let file = target.path().join("faceoff.sqlite3");
        snapshot.finish(&file).await.unwrap();
        let archived = Store::import(target.path(), now()).await.unwrap();
        assert_eq!(archived.imported_at, Some(now()));
        let imported = Store::open(target.path()).await.unwrap();
        let stage = store.stages().await.unwrap().remove(0);
        let revision = store.board_revision(&stage).await.unwrap();
        let rows = imported.board(stage.id, revision).await.unwrap();
        // The second day is unfinished, so the archive shows the first.
        assert_eq!(rows.len(), 1, "{rows:?}");
        for row in rows {
            let original = store.evaluation(row.evaluation).await.unwrap();
            assert!(original.released_at.is_some());
            assert_eq!(imported.evaluation(row.evaluation).await.unwrap(), original);
        }
    }
}

#[tokio::test]
async fn killed_import_creates_all_of_the_folder_or_none() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let store = Store::open(&folder.join("running")).await.unwrap();
    let edition = faceoff_store::Edition::Public;
    let snapshot = store
        .snapshot(
            folder,
            edition,
            "a test",
            &MissingSummaries::default(),
            now(),
        )
        .await;
    let database = folder.join("database");
    snapshot.unwrap().finish(&database).await.unwrap();
    let database = fs::read(database).unwrap();
    // Each file is synced to the disk, so with many files the import takes a while.
    let names: Vec<String> = (0..60)
        .map(|number| format!("artifacts/datasets/{number}.zip"))
        .collect();
    let mut files: Vec<(&str, &[u8])> = vec![("database.sqlite3", &database)];
    files.extend(names.iter().map(|name| (name.as_str(), &b"PK"[..])));
    write_archive(folder, "season.tar.zst", &files, Edition::Public);
    let (mut killed, mut complete) = (0, 0);
    for round in 0_u64.. {
        let mut child = command(&["import", "season.tar.zst", "--data", "imported"])
            .current_dir(folder)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // Killed later in each round, until the import finishes first.
        std::thread::sleep(std::time::Duration::from_millis(20 * round * round));
        child.kill().unwrap();
        let ended = child.wait().unwrap();
        let imported = folder.join("imported");
        if imported.exists() {
            let found = Store::archived_in(&imported).await.unwrap().unwrap();
            assert!(found.imported_at.is_some());
            let datasets = fs::read_dir(imported.join("artifacts/datasets")).unwrap();
            assert_eq!(datasets.count(), names.len());
            fs::remove_dir_all(&imported).unwrap();
            complete += 1;
        } else {
            assert!(!ended.success(), "{ended}");
            killed += 1;
        }
        if complete > 1 {
            break;
        }
    }
    assert!(killed > 0, "no import was killed before its end");
    // A complete import removes what the killed ones have left.
    stdout(&faceoff_in(
        folder,
        &["import", "season.tar.zst", "--data", "imported"],
    ));
    assert!(!folder.join("imported.importing").exists());
}
