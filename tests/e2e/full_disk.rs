//! A disk that fills up while the server runs, and has free space again later: no data are lost, no agent gets a fault,
//! and each result equals that of an undisturbed run.
//!
//! The agent of these tests waits before the episode that a file in its folder names. So a test controls when the disk
//! fills up.

use crate::{Team, dataset, entry, score_locally, upgrade, without_times};
use faceoff_tests::{
    bundle::{pack, python_bundle},
    server::{Server, TIMEOUT, http},
    small_disk::{FilledDisk, LogTo, SmallDisk},
};
use reqwest::blocking::Body;
use serde_json::{Value, json};
use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant},
};

const DISK_BYTES: u64 = 48 << 20;

/// Keeps still; waits before an episode as long as the file `hold` in its folder names that episode,
/// or any of the task: `hit 1`, `hit *`.
const WAITING_AGENT: &str = r#"import json, os, sys, time

HOLD = os.path.join(os.path.dirname(os.path.abspath(__file__)), "hold")

def say(answer):
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()

def wait_while_held(task, episode):
    while os.path.exists(HOLD):
        try:
            named = open(HOLD).read().split()
        except FileNotFoundError:
            return
        if named not in ([task, str(episode)], [task, "*"]):
            return
        time.sleep(0.02)

task = held = None
for line in sys.stdin:
    message = json.loads(line)
    kind = message["type"]
    if kind == "hello":
        task = message["task"]
        say({"type": "ready", "protocol": 1, "interpolation": 3})
    elif kind == "reset":
        held = None
        wait_while_held(task, message["episode"])
        say({"type": "ready", "episode": message["episode"]})
    elif kind == "step":
        held = held or message["obs"][6:13]
        say({"type": "act", "step": message["step"], "action": [held, [0.0] * 7]})
    elif kind == "bye":
        break
"#;

/// The configuration with this minimum of free bytes, and more lines for the section `[workers]`.
fn config(min_free_bytes: u64, workers: &str) -> String {
    format!(
        "{}\n[server]\nmin_free_bytes = {min_free_bytes}\n[evaluation]\nepisodes_per_task = 4\n\
         episodes_per_shard = 2\n[workers]\nslots = 1\nlease_s = 5\n{workers}\n",
        include_str!("../patient.toml")
    )
}

/// Puts scratch files on another disk, so that the small one holds only database and artifacts.
fn scratch_on_other_disk(folder: &Path) -> String {
    format!("scratch_dir = {:?}", folder.join("scratch"))
}

/// The file in which the unpacked agent reads before which episode to wait.
struct HoldFile(PathBuf);

impl HoldFile {
    fn in_scratch(scratch: &Path) -> Self {
        Self(scratch.join("slot-0/bundle-1/unpacked/hold"))
    }

    fn hold_before(&self, episode: &str) {
        let beside = self.0.with_extension("new");
        fs::write(&beside, episode).expect("the agent is unpacked");
        fs::rename(&beside, &self.0).expect("the agent is unpacked");
    }

    fn release(&self) {
        fs::remove_file(&self.0).expect("the agent is held");
    }
}

fn health(server: &Server) -> (u16, Value) {
    let answer = server.get("/api/v1/health", None);
    (
        answer.status().as_u16(),
        answer.json().expect("the API speaks JSON"),
    )
}

fn wait_for_health(server: &Server, status: u16) -> Value {
    let started = Instant::now();
    loop {
        let (found, answer) = health(server);
        if found == status {
            return answer;
        }
        assert!(started.elapsed() < TIMEOUT, "still {found}: {answer:#}");
        thread::sleep(Duration::from_millis(50));
    }
}

/// Tries to create a team, which needs a write to the database; returns the status.
fn try_create_team(server: &Server, name: &str) -> u16 {
    let path = "/api/v1/teams";
    let answer = server.post(path, &server.admin_token, &json!({ "name": name }));
    answer.status().as_u16()
}

/// Writes until the database is not writable: its log may still have allocated pages. Returns the number of refused
/// writes.
fn exhaust_database(server: &Server) -> u32 {
    let started = Instant::now();
    let (mut number, mut refused) = (0, 0);
    loop {
        match try_create_team(server, &format!("Team {number}")) {
            201 => number += 1,
            507 => refused += 1,
            other => panic!("creating a team on a full disk: {other}"),
        }
        if refused > 0 && health(server).1["database"] == "not writable" {
            return refused;
        }
        assert!(started.elapsed() < TIMEOUT, "{number} teams on a full disk");
    }
}

/// Waits until an evaluation has this many episodes; its agent waits before the next.
fn wait_for_episodes(disk: &SmallDisk, team: &Team, evaluation: &str, episodes: u64) {
    let _ = disk.server.poll(evaluation, &team.token, |answer| {
        answer["progress"]["episodes_done"].as_u64() >= Some(episodes)
    });
}

/// Asserts that the evaluation ends like an undisturbed run: same result as a local evaluation with the same seeds, a
/// dataset that passes verification, no fault and no retry.
fn assert_undisturbed(
    disk: &SmallDisk,
    team: &Team,
    evaluation: &str,
    agent: &Path,
    scratch: &Path,
) {
    let finished = team.wait_until_finished(&disk.server, evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    upgrade::verify(&disk.server, evaluation, &team.token, scratch);
    let mut dataset = dataset(&disk.server, evaluation, &team.token);
    let shards = entry(&mut dataset, "calibration.json");
    for shard in shards["shards"].as_array().expect("it lists the shards") {
        assert!(shard.get("longest_stall_s").is_some(), "{shards:#}");
        assert_eq!(shard.get("platform_retries"), None, "{shards:#}");
    }
    let manifest = entry(&mut dataset, "manifest.json");
    let local = score_locally(agent, &manifest, 4, &scratch.join("local"));
    // the dataset released the seed
    let finished = team.wait_until_finished(&disk.server, evaluation);
    assert_eq!(without_times(&finished["result"]), without_times(&local));
}

/// A team with a valid agent on a small disk.
struct SmallDiskSetup {
    disk: SmallDisk,
    team: Team,
    submission: Value,
    agent: PathBuf,
}

impl SmallDiskSetup {
    fn prepare(folder: &Path, config: &str, log: LogTo) -> Self {
        let disk = SmallDisk::start(folder, DISK_BYTES, config, log);
        let agent = python_bundle(folder, "waits", WAITING_AGENT);
        let team = Team::create(&disk.server, "Phoenix");
        let submission = team.submit(&disk.server, &agent);
        assert_eq!(submission["state"], "valid", "{submission:#}");
        Self {
            disk,
            team,
            submission,
            agent,
        }
    }

    fn evaluate(&self) -> String {
        self.team.evaluate(&self.disk.server, &self.submission)
    }
}

#[test]
fn low_space_refuses_uploads_and_queue_resumes_automatically() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let setup = SmallDiskSetup::prepare(scratch.path(), &config(8 << 20, ""), LogTo::Test);
    let SmallDiskSetup { disk, team, .. } = &setup;
    let server = &disk.server;
    assert_eq!(wait_for_health(server, 200)["status"], "ok");
    let before = disk.files("artifacts");

    let short = disk.fill_except(6 << 20);
    let refused = server.upload(&team.token, pack(&setup.agent));
    assert_eq!(refused.status(), 507);
    assert!(refused.headers().contains_key("retry-after"));
    let problem: Value = refused.json().expect("a problem is JSON");
    assert_eq!(problem["type"], "/problems#storage-full", "{problem:#}");
    assert_eq!(disk.files("artifacts"), before, "nothing was stored");
    assert!(disk.files("uploads").is_empty());

    let not_ready = wait_for_health(server, 503);
    assert_eq!(not_ready["free_space"], "short", "{not_ready:#}");
    assert_eq!(not_ready["queue"], "paused");
    assert_eq!(not_ready["database"], "writable", "there are 6 MiB left");
    assert_eq!(server.get("/api/v1/health/live", None).status(), 200);
    for page in ["/", "/season", "/tasks/hit"] {
        let page = server.get(page, None).text().expect("a page is text");
        assert!(page.contains("almost full"), "{page}");
    }
    // A day can be started; its evaluations stay queued.
    let evaluation = setup.evaluate();
    // repeated health requests do not resume the queue
    for _ in 0..20 {
        assert_eq!(health(server).0, 503);
    }
    let queued = server.poll(&evaluation, &team.token, |_| true);
    assert_eq!(queued["state"], "queued", "{queued:#}");
    drop(short);

    assert_undisturbed(disk, team, &evaluation, &setup.agent, scratch.path());
    assert_eq!(health(server).0, 200);
    let page = server.get("/", None).text().expect("a page is text");
    assert!(!page.contains("almost full"), "{page}");
    let next = team.submit(server, &setup.agent);
    assert_eq!(next["state"], "valid", "{next:#}");
    let log = server.log();
    for change in ["disk space: the queue pauses", "again: the queue resumes"] {
        assert_eq!(log.matches(change).count(), 1, "{change}: {log}");
    }
}

/// A reader that calls `at_half` once half of its bytes are read.
struct HalfwayReader<F> {
    bytes: io::Cursor<Vec<u8>>,
    at_half: Option<F>,
}

impl<F: FnOnce()> Read for HalfwayReader<F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.bytes.position() * 2 >= self.bytes.get_ref().len() as u64
            && let Some(at_half) = self.at_half.take()
        {
            at_half();
        }
        // in small pieces
        let most = buffer.len().min(16 << 10);
        self.bytes.read(&mut buffer[..most])
    }
}

/// An agent with a file that does not compress.
fn large_agent(folder: &Path, bytes: usize) -> PathBuf {
    let agent = python_bundle(folder, "large", WAITING_AGENT);
    let mut state = 1_u64;
    let noise: Vec<u8> = std::iter::repeat_with(|| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 56) as u8
    })
    .take(bytes)
    .collect();
    fs::write(agent.join("weights"), noise).expect("a scratch file can be written");
    agent
}

#[test]
fn upload_on_disk_that_fills_up_leaves_no_files() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = scratch.path();
    let disk = SmallDisk::start(folder, DISK_BYTES, &config(1 << 20, ""), LogTo::Test);
    let team = Team::create(&disk.server, "Phoenix");
    let archive = pack(&large_agent(folder, 4 << 20));
    let (path, url) = ("/api/v1/submissions", &disk.server.url);

    let (sender, filled) = std::sync::mpsc::channel();
    let length = archive.len() as u64;
    let root = disk.data_dir.clone();
    let body = HalfwayReader {
        bytes: io::Cursor::new(archive.clone()),
        at_half: Some(move || {
            sender
                .send(FilledDisk::fill(&root))
                .expect("the test waits");
        }),
    };
    let refused = http()
        .timeout(TIMEOUT)
        .build()
        .expect("a client needs nothing")
        .post(format!("{url}{path}"))
        .bearer_auth(&team.token)
        .body(Body::sized(body, length))
        .send()
        .expect("the server answers");
    assert_eq!(refused.status(), 507);
    let full = filled.recv().expect("half of the upload was sent");
    assert_eq!(wait_for_health(&disk.server, 503)["free_space"], "short");
    drop(full);
    assert!(disk.files("uploads").is_empty());
    assert!(disk.files("artifacts").is_empty());
    let own: Value = disk
        .server
        .get(path, Some(&team.token))
        .json()
        .expect("the API speaks JSON");
    assert_eq!(own, json!([]), "no submission was created");

    let id = team.upload(&disk.server, archive);
    assert_eq!(team.verdict(&disk.server, &id)["state"], "valid");
    assert_eq!(wait_for_health(&disk.server, 200)["status"], "ok");
}

#[test]
fn validation_without_space_to_unpack_is_repeated() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = scratch.path();
    let disk = SmallDisk::start(folder, DISK_BYTES, &config(1 << 20, ""), LogTo::Test);
    let team = Team::create(&disk.server, "Phoenix");
    let agent = python_bundle(folder, "swells", WAITING_AGENT);
    // its archive is small
    fs::write(agent.join("zeros"), vec![0; 16 << 20]).expect("a scratch file can be written");
    let archive = pack(&agent);
    assert!(archive.len() < 1 << 20);

    // Enough for everything but the unpacked bundle. Files left by the first try would block the second.
    let short = disk.fill_except(10 << 20);
    let id = team.upload(&disk.server, archive);
    disk.server.wait_for_log("disk full: job released", 2);
    let pending = team.submission(&disk.server, &id);
    assert_eq!(pending["state"], "validating", "{pending:#}");
    drop(short);
    let verdict = team.verdict(&disk.server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
}

/// Fills the disk while the agent waits before `episode`, with `done` episodes finished.
fn fill_disk_during_shard(episode: &str, done: u64) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let setup = SmallDiskSetup::prepare(scratch.path(), &config(4 << 20, ""), LogTo::Test);
    let SmallDiskSetup { disk, team, .. } = &setup;
    let hold = HoldFile::in_scratch(&disk.data_dir.join("scratch"));
    hold.hold_before(episode);
    let evaluation = setup.evaluate();
    wait_for_episodes(disk, team, &evaluation, done);
    let full = disk.fill();
    hold.release();
    disk.server.wait_for_log("disk full: job released", 1);
    let not_ready = wait_for_health(&disk.server, 503);
    assert_eq!(not_ready["free_space"], "short", "{not_ready:#}");
    let running = disk.server.poll(&evaluation, &team.token, |_| true);
    assert_eq!(running["state"], "running", "{running:#}");
    drop(full);
    assert_undisturbed(disk, team, &evaluation, &setup.agent, scratch.path());
}

#[test]
fn shard_interrupted_by_full_disk_is_repeated_without_fault() {
    fill_disk_during_shard("hit 1", 1);
}

#[test]
fn unrecorded_shard_is_repeated_after_full_disk() {
    fill_disk_during_shard("defend 2", 6);
}

#[test]
fn dataset_is_joined_once_space_is_free() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // a minimum so small that the queue does not pause before the dataset is written
    let setup = SmallDiskSetup::prepare(scratch.path(), &config(4 << 10, ""), LogTo::Test);
    let SmallDiskSetup { disk, team, .. } = &setup;
    let hold = HoldFile::in_scratch(&disk.data_dir.join("scratch"));
    hold.hold_before("prepare 3");
    let evaluation = setup.evaluate();
    wait_for_episodes(disk, team, &evaluation, 11);
    let bytes = |folder| -> u64 {
        let files = disk.files(folder);
        files
            .iter()
            .filter_map(|file| file.metadata().ok())
            .map(|found| found.len())
            .sum()
    };
    // Five of six shards are stored. The sixth needs its size twice, in the artifacts and in the scratch folder, and some
    // space for the database. The dataset needs the size of all six three times.
    let recorded = bytes("artifacts/recordings");
    assert!(recorded > 400 << 10, "{recorded} bytes of five recordings");
    let short = disk.fill_except(recorded + recorded / 4);
    hold.release();
    disk.server.wait_for_log("disk full: job released", 1);
    let pending = disk.server.poll(&evaluation, &team.token, |answer| {
        answer["state"] != "running"
    });
    assert_eq!(pending["state"], "finalising", "{pending:#}");
    assert!(
        disk.files("artifacts/datasets").is_empty(),
        "a dataset is stored completely or not at all"
    );
    drop(short);
    assert_undisturbed(disk, team, &evaluation, &setup.agent, scratch.path());
}

/// Makes the database unwritable for longer than a lease.
fn block_database_writes(log: LogTo, min_free_bytes: u64) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = config(min_free_bytes, &scratch_on_other_disk(scratch.path()));
    let setup = SmallDiskSetup::prepare(scratch.path(), &config, log);
    let SmallDiskSetup { disk, team, .. } = &setup;
    let server = &disk.server;
    let hold = HoldFile::in_scratch(&scratch.path().join("scratch"));
    hold.hold_before("hit 1");
    let evaluation = setup.evaluate();
    wait_for_episodes(disk, team, &evaluation, 1);

    let full = disk.fill();
    let since = Instant::now();
    let refused = exhaust_database(server);
    // waits longer than a lease of 5 s
    while since.elapsed() < Duration::from_secs(8) {
        assert_eq!(
            try_create_team(server, "Refused"),
            507,
            "after {refused} refusals"
        );
    }
    assert_eq!(server.get("/api/v1/health/live", None).status(), 200);
    // requests that need no space are answered
    assert_eq!(server.get("/", None).status(), 200);
    assert_eq!(server.get(&evaluation, Some(&team.token)).status(), 200);
    drop(full);

    // writes succeed again
    let created = loop {
        match try_create_team(server, "Successor") {
            // the filler's last pages may not be freed yet
            507 => thread::sleep(Duration::from_millis(20)),
            status => break status,
        }
    };
    assert_eq!(created, 201);
    wait_for_health(server, 200);
    hold.release();
    assert_undisturbed(disk, team, &evaluation, &setup.agent, scratch.path());
    if log == LogTo::Disk {
        let log = fs::read_to_string(disk.log_file()).expect("the log is there");
        assert!(!log.contains("panicked"), "{log}");
        let last_line = log.lines().last().unwrap_or_default();
        assert!(
            log.contains("serving"),
            "it logged before and after: {last_line}"
        );
    }
}

#[test]
fn unwritable_database_recovers_after_full_disk() {
    block_database_writes(LogTo::Test, 4 << 20);
}

#[test]
fn unwritable_database_recovers_without_reserved_space() {
    block_database_writes(LogTo::Test, 0);
}

#[test]
fn server_survives_log_file_on_full_disk() {
    block_database_writes(LogTo::Disk, 4 << 20);
}

#[test]
fn verdict_is_committed_once_space_is_free() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = scratch.path();
    let config = config(4 << 20, &scratch_on_other_disk(folder));
    let disk = SmallDisk::start(folder, DISK_BYTES, &config, LogTo::Test);
    let team = Team::create(&disk.server, "Phoenix");
    let agent = python_bundle(folder, "waits", WAITING_AGENT);
    fs::write(agent.join("hold"), "prepare *").expect("a scratch file can be written");
    let id = team.upload(&disk.server, pack(&agent));
    let hold = HoldFile::in_scratch(&folder.join("scratch"));
    // the file exists once the validation run has unpacked the bundle
    while !hold.0.exists() {
        thread::sleep(Duration::from_millis(20));
    }
    let full = disk.fill();
    let _ = exhaust_database(&disk.server);
    hold.release();
    disk.server.wait_for_log("disk full: waiting to commit", 1);
    let pending = team.submission(&disk.server, &id);
    assert_eq!(pending["state"], "validating", "{pending:#}");
    drop(full);
    let verdict = team.verdict(&disk.server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
    assert_eq!(
        disk.server.log().matches("started job=").count(),
        1,
        "it was validated once: {}",
        disk.server.log()
    );
}
