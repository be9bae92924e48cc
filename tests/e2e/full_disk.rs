//! A disk that fills up while the server runs, and has free space again later: no data are lost, no agent gets a fault,
//! and each result equals that of an undisturbed run.
//!
//! The agent of these tests waits before the episode that the file `wait_before` in its folder describes. So a test controls when
//! the disk fills up.

use crate::{Team, dataset, entry, score_locally, upgrade, without_times};
use faceoff_tests::{
    bundle::{pack, python_bundle},
    server::{Server, TIMEOUT, http},
    small_disk::{FilledDisk, LogTarget, SmallDisk},
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

const KIB: u64 = 1 << 10;
const MIB: u64 = 1 << 20;
const DISK_BYTES: u64 = 96 * MIB;
/// The size of a file with which an agent's bundle is not copied into memory, so that the agent sees changes of its files.
const PADDING_BYTES: usize = 33 << 20;

/// Source of an agent that keeps still. It waits before an episode as long as the file `wait_before` in its folder describes that
/// episode. `prepare *`: each of the task. `first`: the first of a shard. `second N`: the second of a shard, if the file has not changed
/// since the shard began. Shards of two episodes are played in an order that is drawn.
const WAITING_AGENT: &str = r#"import json, os, sys, time

WAIT_FILE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "wait_before")

def say(answer):
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()

def description():
    try:
        return open(WAIT_FILE).read().split()
    except FileNotFoundError:
        return []

def wait_while_described(task, episode):
    while True:
        described = description()
        is_second = episode % 2 == 1 and described[:1] == ["second"] and described == at_begin
        if not (described == [task, "*"] or episode % 2 == 0 and described == ["first"] or is_second):
            return
        time.sleep(0.02)

task = start_position = None
at_begin = description()
for line in sys.stdin:
    message = json.loads(line)
    kind = message["type"]
    if kind == "hello":
        task = message["task"]
        say({"type": "ready", "protocol": 1, "interpolation": 3})
    elif kind == "reset":
        start_position = None
        wait_while_described(task, message["episode"])
        say({"type": "ready", "episode": message["episode"]})
    elif kind == "step":
        start_position = start_position or message["obs"][6:13]
        say({"type": "act", "step": message["step"], "action": [start_position, [0.0] * 7]})
    elif kind == "bye":
        break
"#;

/// The bundle of the waiting agent.
fn waiting_agent(folder: &Path) -> PathBuf {
    let agent = python_bundle(folder, "waits", WAITING_AGENT);
    fs::write(agent.join("filling"), vec![0; PADDING_BYTES])
        .expect("a scratch file can be written");
    agent
}

/// A configuration. With less than `min_free_bytes` of free space the server pauses the queue and refuses uploads.
/// `worker_settings` are further lines of the section `[workers]`.
fn config(min_free_bytes: u64, worker_settings: &str) -> String {
    format!(
        "{}\n[server]\nmin_free_bytes = {min_free_bytes}\n[evaluation]\nepisodes_per_task = 4\n\
         episodes_per_shard = 2\n[workers]\nslots = 1\nlease_s = 5\n{worker_settings}\n",
        include_str!("../long_time_limits.toml")
    )
}

/// The setting that puts scratch files on another disk, so that the small disk has only database and artifacts.
fn scratch_on_other_disk(folder: &Path) -> String {
    format!("scratch_dir = {:?}", folder.join("scratch"))
}

/// The file `wait_before` in the folder into which the only slot has unpacked the agent. It names the episodes before which the
/// agent waits.
struct WaitFile(PathBuf);

impl WaitFile {
    fn in_scratch(scratch: &Path) -> Self {
        Self(scratch.join("slot-0/bundle-1/unpacked/wait_before"))
    }

    fn write(&self, episodes: &str) {
        let new_file = self.0.with_extension("new");
        fs::write(&new_file, episodes).expect("the agent is unpacked");
        fs::rename(&new_file, &self.0).expect("the agent is unpacked");
    }

    fn remove(&self) {
        fs::remove_file(&self.0).expect("the agent waits");
    }
}

/// Status and body of the health response.
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

/// Creates teams until the database is not writable: on a full disk its write-ahead log may still have free pages. Returns the
/// number of refused requests.
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

/// Waits until this many episodes of an evaluation have ended; its agent waits before the next.
fn wait_for_episodes(disk: &SmallDisk, evaluation: &str, episodes: u64) {
    let token = &disk.server.admin_token;
    let _ = disk.server.poll(evaluation, token, |answer| {
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
    upgrade::verify_dataset(&disk.server, evaluation, &team.token, scratch);
    let mut dataset = dataset(&disk.server, evaluation, &team.token);
    let shards = entry(&mut dataset, "calibration.json");
    for shard in shards["shards"].as_array().expect("it lists the shards") {
        assert!(shard.get("longest_stall_s").is_some(), "{shards:#}");
        assert_eq!(shard.get("platform_retries"), None, "{shards:#}");
    }
    let manifest = entry(&mut dataset, "manifest.json");
    let local = score_locally(agent, &manifest, 4, &scratch.join("local"));
    // The day is released since the download of the dataset, so the result contains the seed.
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
    fn prepare(folder: &Path, config: &str, log: LogTarget) -> Self {
        let disk = SmallDisk::start(folder, DISK_BYTES, config, log);
        let agent = waiting_agent(folder);
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
    let setup = SmallDiskSetup::prepare(scratch.path(), &config(8 * MIB, ""), LogTarget::Test);
    let SmallDiskSetup { disk, team, .. } = &setup;
    let server = &disk.server;
    assert_eq!(wait_for_health(server, 200)["status"], "ok");
    let artifacts_before = disk.files("artifacts");

    let filled = disk.fill_except(6 * MIB);
    let refused = server.upload(&team.token, pack(&setup.agent));
    assert_eq!(refused.status(), 507);
    assert!(refused.headers().contains_key("retry-after"));
    let problem: Value = refused.json().expect("a problem is JSON");
    assert_eq!(problem["type"], "/problems#storage-full", "{problem:#}");
    assert_eq!(
        disk.files("artifacts"),
        artifacts_before,
        "nothing was stored"
    );
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
    // Health requests do not resume the queue.
    for _ in 0..20 {
        assert_eq!(health(server).0, 503);
    }
    let queued = server.poll(&evaluation, &team.token, |_| true);
    assert_eq!(queued["state"], "queued", "{queued:#}");
    drop(filled);

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

/// A request body that calls `on_half` once half of its bytes are read.
struct HalfwayReader<F> {
    bytes: io::Cursor<Vec<u8>>,
    on_half: Option<F>,
}

impl<F: FnOnce()> Read for HalfwayReader<F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.bytes.position() * 2 >= self.bytes.get_ref().len() as u64
            && let Some(on_half) = self.on_half.take()
        {
            on_half();
        }
        // Small reads, so that the call comes close to the half.
        let read_bytes = buffer.len().min(16 << 10);
        self.bytes.read(&mut buffer[..read_bytes])
    }
}

/// An agent with a file that does not compress.
fn large_agent(folder: &Path, bytes: usize) -> PathBuf {
    let agent = python_bundle(folder, "large", WAITING_AGENT);
    // A linear congruential generator.
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
    let disk = SmallDisk::start(folder, DISK_BYTES, &config(MIB, ""), LogTarget::Test);
    let team = Team::create(&disk.server, "Phoenix");
    let archive = pack(&large_agent(folder, 4 << 20));
    let (path, url) = ("/api/v1/submissions", &disk.server.url);

    let (fill_sender, fill_receiver) = std::sync::mpsc::channel();
    let length = archive.len() as u64;
    let root = disk.data_dir.clone();
    let body = HalfwayReader {
        bytes: io::Cursor::new(archive.clone()),
        on_half: Some(move || {
            fill_sender
                .send(FilledDisk::fill(&root))
                .expect("the test waits");
        }),
    };
    let refused = http()
        .timeout(TIMEOUT)
        .build()
        .expect("an HTTP client can be made")
        .post(format!("{url}{path}"))
        .bearer_auth(&team.token)
        .body(Body::sized(body, length))
        .send()
        .expect("the server answers");
    assert_eq!(refused.status(), 507);
    let filled = fill_receiver.recv().expect("half of the upload was sent");
    assert_eq!(wait_for_health(&disk.server, 503)["free_space"], "short");
    drop(filled);
    assert!(disk.files("uploads").is_empty());
    assert!(disk.files("artifacts").is_empty());
    let submissions: Value = disk
        .server
        .get(path, Some(&team.token))
        .json()
        .expect("the API speaks JSON");
    assert_eq!(submissions, json!([]), "no submission was created");

    let id = team.upload(&disk.server, archive);
    assert_eq!(team.verdict(&disk.server, &id)["state"], "valid");
    assert_eq!(wait_for_health(&disk.server, 200)["status"], "ok");
}

#[test]
fn validation_without_space_to_unpack_is_repeated() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = scratch.path();
    let disk = SmallDisk::start(folder, DISK_BYTES, &config(MIB, ""), LogTarget::Test);
    let team = Team::create(&disk.server, "Phoenix");
    let agent = python_bundle(folder, "swells", WAITING_AGENT);
    // This file is large, but its archive is small.
    fs::write(agent.join("zeros"), vec![0; 16 << 20]).expect("a scratch file can be written");
    let archive = pack(&agent);
    assert!(archive.len() < 1 << 20);

    // Enough for everything but the unpacked bundle. Files left by the first try would block the second.
    let filled = disk.fill_except(10 * MIB);
    let id = team.upload(&disk.server, archive);
    disk.server.wait_for_log("disk full: job released", 2);
    let pending = team.submission(&disk.server, &id);
    assert_eq!(pending["state"], "validating", "{pending:#}");
    drop(filled);
    let verdict = team.verdict(&disk.server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
}

/// Fills the disk while the agent waits before the episode that `episodes` describes (content of the wait file, such as `hit 1`).
/// `finished_episodes` is the number of episodes that have ended by then. Each task has four episodes in two shards (jobs).
fn fill_disk_during_shard(episodes: &str, finished_episodes: u64) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let setup = SmallDiskSetup::prepare(scratch.path(), &config(4 * MIB, ""), LogTarget::Test);
    let SmallDiskSetup { disk, team, .. } = &setup;
    let wait_file = WaitFile::in_scratch(&disk.data_dir.join("scratch"));
    wait_file.write(episodes);
    let evaluation = setup.evaluate();
    let _ = disk.server.poll(&evaluation, &team.token, |answer| {
        answer["state"] == "running"
    });
    wait_for_episodes(disk, &evaluation, finished_episodes);
    let filled = disk.fill();
    wait_file.remove();
    disk.server.wait_for_log("disk full: job released", 1);
    let not_ready = wait_for_health(&disk.server, 503);
    assert_eq!(not_ready["free_space"], "short", "{not_ready:#}");
    let running = disk.server.poll(&evaluation, &team.token, |_| true);
    assert_eq!(running["state"], "running", "{running:#}");
    drop(filled);
    assert_undisturbed(disk, team, &evaluation, &setup.agent, scratch.path());
}

#[test]
fn shard_interrupted_by_full_disk_is_repeated_without_fault() {
    fill_disk_during_shard("second", 1);
}

#[test]
fn unrecorded_shard_is_repeated_after_full_disk() {
    // The first episode of a shard, before any of its episodes is recorded.
    fill_disk_during_shard("first", 0);
}

#[test]
fn dataset_is_joined_once_space_is_free() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // The minimum of free space is so small that the queue does not pause before the dataset is written.
    let setup = SmallDiskSetup::prepare(scratch.path(), &config(4 * KIB, ""), LogTarget::Test);
    let SmallDiskSetup { disk, team, .. } = &setup;
    let wait_file = WaitFile::in_scratch(&disk.data_dir.join("scratch"));
    wait_file.write("second 0");
    let evaluation = setup.evaluate();
    // Each shard waits until the file changes. The last waits before the last of 12 episodes.
    for shard in 0..5 {
        wait_for_episodes(disk, &evaluation, 2 * shard + 1);
        wait_file.write(&format!("second {}", shard + 1));
    }
    wait_for_episodes(disk, &evaluation, 11);
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
    assert!(recorded > 400 * KIB, "{recorded} bytes of five recordings");
    let filled = disk.fill_except(recorded + recorded / 4);
    wait_file.remove();
    disk.server.wait_for_log("disk full: job released", 1);
    let pending = disk.server.poll(&evaluation, &team.token, |answer| {
        answer["state"] != "running"
    });
    assert_eq!(pending["state"], "finalising", "{pending:#}");
    assert!(
        disk.files("artifacts/datasets").is_empty(),
        "a dataset is stored completely or not at all"
    );
    drop(filled);
    assert_undisturbed(disk, team, &evaluation, &setup.agent, scratch.path());
}

/// Makes the database unwritable for longer than a lease, the time for which a job is assigned to a worker. The evaluation continues
/// once there is space. With `min_free_bytes` of 0 the server does not pause the queue before the disk is full.
fn block_database_writes(log: LogTarget, min_free_bytes: u64) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = config(min_free_bytes, &scratch_on_other_disk(scratch.path()));
    let setup = SmallDiskSetup::prepare(scratch.path(), &config, log);
    let SmallDiskSetup { disk, team, .. } = &setup;
    let server = &disk.server;
    let wait_file = WaitFile::in_scratch(&scratch.path().join("scratch"));
    wait_file.write("second");
    let evaluation = setup.evaluate();
    wait_for_episodes(disk, &evaluation, 1);

    let filled = disk.fill();
    let filled_at = Instant::now();
    let refused = exhaust_database(server);
    // Longer than the configured lease of 5 s.
    while filled_at.elapsed() < Duration::from_secs(8) {
        assert_eq!(
            try_create_team(server, "Refused"),
            507,
            "after {refused} refusals"
        );
    }
    assert_eq!(server.get("/api/v1/health/live", None).status(), 200);
    // Requests that need no space are answered.
    assert_eq!(server.get("/", None).status(), 200);
    assert_eq!(server.get(&evaluation, Some(&team.token)).status(), 200);
    drop(filled);

    // Writes succeed again.
    let created = loop {
        match try_create_team(server, "Successor") {
            // The last pages of the file that filled the disk may not be free yet.
            507 => thread::sleep(Duration::from_millis(20)),
            status => break status,
        }
    };
    assert_eq!(created, 201);
    wait_for_health(server, 200);
    wait_file.remove();
    assert_undisturbed(disk, team, &evaluation, &setup.agent, scratch.path());
    if log == LogTarget::Disk {
        let log = fs::read_to_string(disk.log_file()).expect("the log is there");
        assert!(!log.contains("panicked"), "{log}");
        let last_line = log.lines().last().unwrap_or_default();
        assert!(
            log.contains("serving"),
            "the log of the server's start is lost; the last line is {last_line}"
        );
    }
}

#[test]
fn unwritable_database_recovers_after_full_disk() {
    block_database_writes(LogTarget::Test, 4 * MIB);
}

#[test]
fn unwritable_database_recovers_without_min_free_bytes() {
    block_database_writes(LogTarget::Test, 0);
}

#[test]
fn server_survives_log_file_on_full_disk() {
    block_database_writes(LogTarget::Disk, 4 * MIB);
}

#[test]
fn verdict_is_committed_once_space_is_free() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = scratch.path();
    let config = config(4 * MIB, &scratch_on_other_disk(folder));
    let disk = SmallDisk::start(folder, DISK_BYTES, &config, LogTarget::Test);
    let team = Team::create(&disk.server, "Phoenix");
    let agent = waiting_agent(folder);
    fs::write(agent.join("wait_before"), "prepare *").expect("a scratch file can be written");
    let id = team.upload(&disk.server, pack(&agent));
    let wait_file = WaitFile::in_scratch(&folder.join("scratch"));
    // The file exists once the validation run has unpacked the bundle.
    while !wait_file.0.exists() {
        thread::sleep(Duration::from_millis(20));
    }
    let filled = disk.fill();
    let _ = exhaust_database(&disk.server);
    wait_file.remove();
    disk.server.wait_for_log("disk full: waiting to commit", 1);
    let pending = team.submission(&disk.server, &id);
    assert_eq!(pending["state"], "validating", "{pending:#}");
    drop(filled);
    let verdict = team.verdict(&disk.server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
    assert_eq!(
        disk.server.log().matches("started job=").count(),
        1,
        "it was validated once: {}",
        disk.server.log()
    );
}
