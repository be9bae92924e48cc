//! A disk that fills up while the server works, and has room again some time later: nothing is lost,
//! nobody is blamed, and every result is that of an undisturbed run.
//!
//! The agent of these tests waits wherever a file in its folder tells it to. So a test knows in the
//! middle of what the disk is full.

use crate::{Team, dataset, entry, scored_locally, upgrade, without_times};
use faceoff_tests::{
    bundle::{packed, python_bundle},
    server::{PATIENCE, Server, http},
    small_disk::{Full, LogTo, SmallDisk},
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

def wait_if_told(task, episode):
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
        wait_if_told(task, message["episode"])
        say({"type": "ready", "episode": message["episode"]})
    elif kind == "step":
        held = held or message["obs"][6:13]
        say({"type": "act", "step": message["step"], "action": [held, [0.0] * 7]})
    elif kind == "bye":
        break
"#;

/// As in the other tests, with so many bytes to be kept free, and more of the section `[workers]`.
fn config(min_free_bytes: u64, workers: &str) -> String {
    format!(
        "{}\n[server]\nmin_free_bytes = {min_free_bytes}\n[evaluation]\nepisodes_per_task = 4\n\
         episodes_per_shard = 2\n[workers]\nslots = 1\nlease_s = 5\n{workers}\n",
        include_str!("../patient.toml")
    )
}

/// Scratch files on another disk: of the small one only database and artifacts remain.
fn scratch_beside(folder: &Path) -> String {
    format!("scratch_dir = {:?}", folder.join("scratch"))
}

/// Where the unpacked agent reads what to wait for.
struct Hold(PathBuf);

impl Hold {
    fn in_scratch(scratch: &Path) -> Self {
        Self(scratch.join("slot-0/bundle-1/unpacked/hold"))
    }

    fn at(&self, episode: &str) {
        let beside = self.0.with_extension("new");
        fs::write(&beside, episode).expect("the agent is unpacked");
        fs::rename(&beside, &self.0).expect("the agent is unpacked");
    }

    fn go_on(&self) {
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
        assert!(started.elapsed() < PATIENCE, "still {found}: {answer:#}");
        thread::sleep(Duration::from_millis(50));
    }
}

/// A new team, if the database can be written.
fn try_team(server: &Server, name: &str) -> u16 {
    let path = "/api/v1/teams";
    let answer = server.post(path, &server.admin_token, &json!({ "name": name }));
    answer.status().as_u16()
}

/// Writes until not a page of the database can be written: its log may have pages to spare that are on
/// the disk already. How often that was refused.
fn use_up(server: &Server) -> u32 {
    let started = Instant::now();
    let (mut number, mut refused) = (0, 0);
    loop {
        match try_team(server, &format!("Team {number}")) {
            201 => number += 1,
            507 => refused += 1,
            other => panic!("creating a team on a full disk: {other}"),
        }
        if refused > 0 && health(server).1["database"] == "not writable" {
            return refused;
        }
        assert!(
            started.elapsed() < PATIENCE,
            "{number} teams on a full disk"
        );
    }
}

/// Waits until an evaluation is so far, and stays there: its agent was told to wait.
fn played(disk: &SmallDisk, team: &Team, evaluation: &str, episodes: u64) {
    let _ = disk.server.poll(evaluation, &team.token, |answer| {
        answer["progress"]["episodes_done"].as_u64() >= Some(episodes)
    });
}

/// The evaluation ends as if nothing had been: the result of anyone's undisturbed run of the same seeds, a
/// dataset that stands up to verification, and no fault or retry in it.
fn assert_undisturbed(
    disk: &SmallDisk,
    team: &Team,
    evaluation: &str,
    agent: &Path,
    scratch: &Path,
) {
    let finished = team.finished(&disk.server, evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    upgrade::verify(&disk.server, evaluation, &team.token, scratch);
    let mut dataset = dataset(&disk.server, evaluation, &team.token);
    let shards = entry(&mut dataset, "calibration.json");
    for shard in shards["shards"].as_array().expect("it lists the shards") {
        assert!(shard.get("longest_stall_s").is_some(), "{shards:#}");
        assert_eq!(shard.get("platform_retries"), None, "{shards:#}");
    }
    let manifest = entry(&mut dataset, "manifest.json");
    let local = scored_locally(agent, &manifest, 4, &scratch.join("local"));
    // the dataset released the seed
    let finished = team.finished(&disk.server, evaluation);
    assert_eq!(without_times(&finished["result"]), without_times(&local));
}

/// A team with a valid agent on a small disk.
struct Contest {
    disk: SmallDisk,
    team: Team,
    submission: Value,
    agent: PathBuf,
}

impl Contest {
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
fn uploads_are_refused_below_the_watermark_and_the_queue_goes_on_by_itself() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path(), &config(8 << 20, ""), LogTo::Test);
    let Contest { disk, team, .. } = &contest;
    let server = &disk.server;
    assert_eq!(wait_for_health(server, 200)["status"], "ok");
    let before = disk.files("artifacts");

    let short = disk.all_but(6 << 20);
    let refused = server.upload(&team.token, packed(&contest.agent));
    assert_eq!(refused.status(), 507);
    assert!(refused.headers().contains_key("retry-after"));
    let problem: Value = refused.json().expect("a problem is JSON");
    assert_eq!(problem["type"], "/problems#storage-full", "{problem:#}");
    assert_eq!(disk.files("artifacts"), before, "nothing was stored");
    assert!(disk.files("uploads").is_empty());

    let not_ready = wait_for_health(server, 503);
    assert_eq!(not_ready["room"], "short", "{not_ready:#}");
    assert_eq!(not_ready["queue"], "paused");
    assert_eq!(not_ready["database"], "writable", "there are 6 MiB left");
    assert_eq!(server.get("/api/v1/health/live", None).status(), 200);
    for page in ["/", "/season", "/tasks/hit"] {
        let page = server.get(page, None).text().expect("a page is text");
        assert!(page.contains("too little room"), "{page}");
    }
    // A day can be started: it is queued, and waits.
    let evaluation = contest.evaluate();
    // many looks at the disk, by all who ask
    for _ in 0..20 {
        assert_eq!(health(server).0, 503);
    }
    let waiting = server.poll(&evaluation, &team.token, |_| true);
    assert_eq!(waiting["state"], "queued", "{waiting:#}");
    drop(short);

    assert_undisturbed(disk, team, &evaluation, &contest.agent, scratch.path());
    assert_eq!(health(server).0, 200);
    let page = server.get("/", None).text().expect("a page is text");
    assert!(!page.contains("too little room"), "{page}");
    let again = team.submit(server, &contest.agent);
    assert_eq!(again["state"], "valid", "{again:#}");
    let log = server.log();
    for change in ["the queue pauses", "the queue goes on"] {
        assert_eq!(log.matches(change).count(), 1, "{change}: {log}");
    }
}

/// Does something when half of it has been read.
struct HalfWay<F> {
    bytes: io::Cursor<Vec<u8>>,
    then: Option<F>,
}

impl<F: FnOnce()> Read for HalfWay<F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.bytes.position() * 2 >= self.bytes.get_ref().len() as u64
            && let Some(then) = self.then.take()
        {
            then();
        }
        // in small pieces
        let most = buffer.len().min(16 << 10);
        self.bytes.read(&mut buffer[..most])
    }
}

/// An agent with a file that no archive makes smaller.
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
fn a_disk_that_fills_up_under_an_upload_leaves_nothing_of_it() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = scratch.path();
    let disk = SmallDisk::start(folder, DISK_BYTES, &config(1 << 20, ""), LogTo::Test);
    let team = Team::create(&disk.server, "Phoenix");
    let archive = packed(&large_agent(folder, 4 << 20));
    let (path, url) = ("/api/v1/submissions", &disk.server.url);

    let (sender, filled) = std::sync::mpsc::channel();
    let length = archive.len() as u64;
    let root = disk.data_dir.clone();
    let body = HalfWay {
        bytes: io::Cursor::new(archive.clone()),
        then: Some(move || {
            sender.send(Full::of(&root)).expect("the test waits");
        }),
    };
    let refused = http()
        .timeout(PATIENCE)
        .build()
        .expect("a client needs nothing")
        .post(format!("{url}{path}"))
        .bearer_auth(&team.token)
        .body(Body::sized(body, length))
        .send()
        .expect("the server answers");
    assert_eq!(refused.status(), 507);
    let full = filled.recv().expect("half of it was sent");
    assert_eq!(wait_for_health(&disk.server, 503)["room"], "short");
    drop(full);
    assert!(disk.files("uploads").is_empty());
    assert!(disk.files("artifacts").is_empty());
    let own: Value = disk
        .server
        .get(path, Some(&team.token))
        .json()
        .expect("the API speaks JSON");
    assert_eq!(own, json!([]), "no submission came of it");

    let id = team.upload(&disk.server, archive);
    assert_eq!(team.verdict(&disk.server, &id)["state"], "valid");
    assert_eq!(wait_for_health(&disk.server, 200)["status"], "ok");
}

#[test]
fn a_bundle_that_finds_no_room_to_be_unpacked_is_not_invalid() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = scratch.path();
    let disk = SmallDisk::start(folder, DISK_BYTES, &config(1 << 20, ""), LogTo::Test);
    let team = Team::create(&disk.server, "Phoenix");
    let agent = python_bundle(folder, "swells", WAITING_AGENT);
    // packed, it is small
    fs::write(agent.join("zeros"), vec![0; 16 << 20]).expect("a scratch file can be written");
    let archive = packed(&agent);
    assert!(archive.len() < 1 << 20);

    // Enough for everything else. What is left of the first try would keep the queue from a second one.
    let short = disk.all_but(10 << 20);
    let id = team.upload(&disk.server, archive);
    disk.server.wait_for_log("no room for the unit", 2);
    let waiting = team.verdict_so_far(&disk.server, &id);
    assert_eq!(waiting["state"], "validating", "{waiting:#}");
    drop(short);
    let verdict = team.verdict(&disk.server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
}

/// The disk is full when the agent, which waits before `episode` with so many `done`, goes on.
fn interrupted_shard(episode: &str, done: u64) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path(), &config(4 << 20, ""), LogTo::Test);
    let Contest { disk, team, .. } = &contest;
    let hold = Hold::in_scratch(&disk.data_dir.join("scratch"));
    hold.at(episode);
    let evaluation = contest.evaluate();
    played(disk, team, &evaluation, done);
    let full = disk.full();
    hold.go_on();
    disk.server.wait_for_log("no room for the unit", 1);
    let not_ready = wait_for_health(&disk.server, 503);
    assert_eq!(not_ready["room"], "short", "{not_ready:#}");
    let running = disk.server.poll(&evaluation, &team.token, |_| true);
    assert_eq!(running["state"], "running", "{running:#}");
    drop(full);
    assert_undisturbed(disk, team, &evaluation, &contest.agent, scratch.path());
}

#[test]
fn a_shard_in_whose_middle_the_disk_fills_up_is_played_as_if_nothing_had_been() {
    interrupted_shard("hit 1", 1);
}

#[test]
fn so_is_one_that_has_recorded_nothing_yet() {
    interrupted_shard("defend 2", 6);
}

#[test]
fn a_dataset_that_finds_no_room_is_joined_when_there_is() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // so little to be kept free that the queue does not pause before the dataset is begun
    let contest = Contest::prepare(scratch.path(), &config(4 << 10, ""), LogTo::Test);
    let Contest { disk, team, .. } = &contest;
    let hold = Hold::in_scratch(&disk.data_dir.join("scratch"));
    hold.at("prepare 3");
    let evaluation = contest.evaluate();
    played(disk, team, &evaluation, 11);
    let bytes = |folder| -> u64 {
        let files = disk.files(folder);
        files
            .iter()
            .filter_map(|file| file.metadata().ok())
            .map(|found| found.len())
            .sum()
    };
    // Five of six shards are stored. The sixth needs room for itself twice, here and in the scratch
    // folder, and some for the database; the dataset for six of them, three times.
    let recorded = bytes("artifacts/recordings");
    assert!(recorded > 400 << 10, "{recorded} bytes of five recordings");
    let short = disk.all_but(recorded + recorded / 4);
    hold.go_on();
    disk.server.wait_for_log("no room for the unit", 1);
    let waiting = disk.server.poll(&evaluation, &team.token, |answer| {
        answer["state"] != "running"
    });
    assert_eq!(waiting["state"], "finalising", "{waiting:#}");
    assert!(
        disk.files("artifacts/datasets").is_empty(),
        "a dataset appears whole or not at all"
    );
    drop(short);
    assert_undisturbed(disk, team, &evaluation, &contest.agent, scratch.path());
}

/// The database cannot be written for longer than a lease lasts.
fn only_the_database(log: LogTo, min_free_bytes: u64) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = config(min_free_bytes, &scratch_beside(scratch.path()));
    let contest = Contest::prepare(scratch.path(), &config, log);
    let Contest { disk, team, .. } = &contest;
    let server = &disk.server;
    let hold = Hold::in_scratch(&scratch.path().join("scratch"));
    hold.at("hit 1");
    let evaluation = contest.evaluate();
    played(disk, team, &evaluation, 1);

    let full = disk.full();
    let since = Instant::now();
    let refused = use_up(server);
    // not to wait for something: a lease is 5 s
    while since.elapsed() < Duration::from_secs(8) {
        assert_eq!(try_team(server, "Nobody"), 507, "after {refused} refusals");
    }
    assert_eq!(server.get("/api/v1/health/live", None).status(), 200);
    // what needs no room is there
    assert_eq!(server.get("/", None).status(), 200);
    assert_eq!(server.get(&evaluation, Some(&team.token)).status(), 200);
    drop(full);

    // the writer is as good as new
    let created = loop {
        match try_team(server, "Successor") {
            // the filler's last pages may be on their way out
            507 => thread::sleep(Duration::from_millis(20)),
            status => break status,
        }
    };
    assert_eq!(created, 201);
    wait_for_health(server, 200);
    hold.go_on();
    assert_undisturbed(disk, team, &evaluation, &contest.agent, scratch.path());
    if log == LogTo::Disk {
        let log = fs::read_to_string(disk.log_file()).expect("the log is there");
        assert!(!log.contains("panicked"), "{log}");
        let told = log.lines().last().unwrap_or_default();
        assert!(
            log.contains("serving"),
            "it logged before, and after: {told}"
        );
    }
}

#[test]
fn a_database_that_cannot_be_written_for_a_while_is_written_again_afterwards() {
    only_the_database(LogTo::Test, 4 << 20);
}

#[test]
fn so_it_is_where_nothing_is_to_be_kept_free() {
    only_the_database(LogTo::Test, 0);
}

#[test]
fn a_log_on_the_full_disk_ends_no_part_of_the_server() {
    only_the_database(LogTo::Disk, 4 << 20);
}

#[test]
fn a_verdict_waits_for_room_to_be_written_down() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = scratch.path();
    let config = config(4 << 20, &scratch_beside(folder));
    let disk = SmallDisk::start(folder, DISK_BYTES, &config, LogTo::Test);
    let team = Team::create(&disk.server, "Phoenix");
    let agent = python_bundle(folder, "waits", WAITING_AGENT);
    fs::write(agent.join("hold"), "prepare *").expect("a scratch file can be written");
    let id = team.upload(&disk.server, packed(&agent));
    let hold = Hold::in_scratch(&folder.join("scratch"));
    // its smoke run is under way from then on
    while !hold.0.exists() {
        thread::sleep(Duration::from_millis(20));
    }
    let full = disk.full();
    let _ = use_up(&disk.server);
    hold.go_on();
    disk.server.wait_for_log("no room to commit", 1);
    let waiting = team.verdict_so_far(&disk.server, &id);
    assert_eq!(waiting["state"], "validating", "{waiting:#}");
    drop(full);
    let verdict = team.verdict(&disk.server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
    assert_eq!(
        disk.server.log().matches("begun").count(),
        1,
        "it was checked once: {}",
        disk.server.log()
    );
}
