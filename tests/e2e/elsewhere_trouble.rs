//! What goes wrong on the way to workers on other machines, or on them: each run ends as one of a slot of the server's own, but for
//! times, and nobody blames the agent.

use crate::{
    Team, dataset,
    elsewhere::{Contest, giving, resume, taking},
    entry,
};
use async_nats::jetstream::{
    self,
    stream::{Config, RetentionPolicy},
};
use faceoff_tests::{
    bundle,
    nats::Nats,
    program,
    relay::{Breaks, Relay},
    server::{PATIENCE, Server},
    small_disk::{Full, Mounted},
    worker::Worker,
};
use jiff::Timestamp;
use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, DnType, IsCa, KeyPair};
use serde_json::json;
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    thread,
    time::{Duration, Instant},
};
use tokio::runtime::Runtime;

const SCRATCH_BYTES: u64 = 64 << 20;
/// By this seed the first of the connections for files breaks within 300 kB: in the middle of a bundle of more than a megabyte.
const CUT_IN_THE_BUNDLE: u64 = 65;

/// Starts a server on a contest's data, to which `files` leads.
fn serving(contest: &Contest, config: &str, files: &Relay) -> Server {
    let server = Server::start(&contest.data, config);
    files.lead_to(server.address().into());
    server
}

/// Waits until the server knows so many workers.
fn wait_for_workers(server: &Server, workers: usize) {
    let _ = server.poll("/api/v1/workers", &server.admin_token, |told| {
        told["workers"].as_array().map_or(0, Vec::len) == workers
    });
}

/// Waits until those who look after the server read these words of what it cannot do.
fn wait_for_trouble(server: &Server, words: &str) {
    let _ = server.poll("/api/v1/workers", &server.admin_token, |told| {
        let troubles = told["troubles"].as_array().expect("it lists them");
        troubles
            .iter()
            .any(|trouble| trouble.as_str().is_some_and(|text| text.contains(words)))
    });
}

fn wait_for_no_trouble(server: &Server) {
    let _ = server.poll("/api/v1/workers", &server.admin_token, |told| {
        told["troubles"] == json!([])
    });
}

/// Whoever may change streams.
struct Administrator {
    runtime: Runtime,
    jetstream: jetstream::Context,
}

impl Administrator {
    fn of(nats: &Nats) -> Self {
        let runtime = Runtime::new().expect("a runtime starts");
        let jetstream = runtime.block_on(async {
            let client = async_nats::connect(nats.url()).await;
            jetstream::new(client.expect("NATS is there"))
        });
        Self { runtime, jetstream }
    }

    /// How a stream is made, once it is.
    fn stream(&self, name: &str) -> Config {
        let started = Instant::now();
        loop {
            let found = self.runtime.block_on(self.jetstream.get_stream(name));
            match found {
                Ok(stream) => return stream.cached_info().config.clone(),
                Err(error) => assert!(started.elapsed() < PATIENCE, "{name}: {error}"),
            }
            // Nobody tells when the server has made it.
            thread::sleep(Duration::from_millis(20));
        }
    }

    fn change(&self, stream: &Config) {
        let changed = self.runtime.block_on(self.jetstream.update_stream(stream));
        let _ = changed.expect("NATS changes it");
    }

    fn make(&self, stream: Config) {
        let made = self.runtime.block_on(self.jetstream.create_stream(stream));
        let _ = made.expect("NATS makes it");
    }

    fn delete(&self, name: &str) {
        let deleted = self.runtime.block_on(self.jetstream.delete_stream(name));
        let _ = deleted.expect("NATS deletes it");
    }
}

#[test]
fn four_workers_play_what_one_slot_plays() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = serving(&contest, &giving(&nats, files.address()), &files);
    let workers = [0, 1, 2, 3].map(|index| {
        let name = format!("worker-{index}");
        Worker::start(scratch.path(), &name, &taking(nats.address(), 1))
    });
    wait_for_workers(&server, workers.len());
    resume(&server);
    contest.ends_alike(&server);
    for worker in workers {
        let log = worker.log();
        assert!(log.contains("committed"), "each has played:\n{log}");
        worker.end();
    }
}

#[test]
fn who_is_cut_off_for_longer_than_a_lease_stops_and_another_plays_its_work() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let (files, link) = (Relay::start(), Relay::start());
    link.lead_to(nats.address());
    let server = serving(&contest, &giving(&nats, files.address()), &files);
    let cut = Worker::start(scratch.path(), "cut", &taking(link.address(), 1));
    resume(&server);
    cut.wait_for_log("committed", 1);
    cut.wait_for_log("begun", 2);
    // Whatever it is at now, what comes of it cannot be told in time.
    link.cut();
    let other = Worker::start(scratch.path(), "other", &taking(nats.address(), 1));
    contest.ends_alike(&server);
    link.lead_to(nats.address());
    other.end();
    cut.end();
}

#[test]
fn links_that_are_slow_and_break_lose_nothing() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = serving(&contest, &giving(&nats, files.address()), &files);
    let links = [Relay::start(), Relay::start()];
    for (seed, link) in (0..).zip(&links) {
        link.lead_to(nats.address());
        link.breaks(Breaks {
            seed,
            refused_percent: 5,
            most_bytes: 64 << 10,
        });
        link.delay(Duration::from_millis(200));
    }
    files.breaks(Breaks {
        seed: CUT_IN_THE_BUNDLE,
        refused_percent: 5,
        most_bytes: 16 << 20,
    });
    files.delay(Duration::from_millis(200));
    let workers = [0, 1].map(|index: usize| {
        let name = format!("worker-{index}");
        Worker::start(scratch.path(), &name, &taking(links[index].address(), 1))
    });
    resume(&server);
    contest.ends_alike(&server);
    for link in links.iter().chain([&files]) {
        assert!(link.broken() > 0, "each link was broken");
    }
    for worker in workers {
        let log = worker.log();
        assert!(log.contains("committed"), "each has played:\n{log}");
    }
}

#[test]
fn a_worker_whose_disk_is_full_leaves_the_work_to_others_until_it_has_room() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = serving(&contest, &giving(&nats, files.address()), &files);
    let disk = Mounted::at(&scratch.path().join("full/scratch"), SCRATCH_BYTES);
    let mut command = disk.in_sight();
    command.arg(program("faceoff"));
    let config = taking(nats.address(), 1);
    let full = Worker::start_by(command, scratch.path(), "full", &config, &[]);
    wait_for_workers(&server, 1);
    let no_room = Full::of(&disk.seen_from_here());
    resume(&server);
    full.wait_for_log("no room for the unit: it is given back", 3);
    let roomy = Worker::start(scratch.path(), "roomy", &config);
    roomy.wait_for_log("committed", 2);
    assert!(!full.log().contains("committed"), "{}", full.log());
    roomy.end();
    drop(no_room);
    full.wait_for_log("committed", 1);

    let (evaluation, token) = (contest.evaluation.clone(), contest.team.token.clone());
    contest.ends_alike(&server);
    let shards = entry(
        &mut dataset(&server, &evaluation, &token),
        "calibration.json",
    );
    for shard in shards["shards"].as_array().expect("it lists the shards") {
        assert_eq!(
            shard.get("platform_retries"),
            None,
            "it counts as no failure: {shards:#}"
        );
    }
}

#[test]
fn what_came_of_work_waits_for_a_stream_that_is_full() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let config = giving(&nats, files.address());
    let server = serving(&contest, &config, &files);
    let worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    wait_for_workers(&server, 1);
    let administrator = Administrator::of(&nats);
    let as_it_was = administrator.stream("faceoff-outcomes");
    administrator.change(&Config {
        max_bytes: 1,
        ..as_it_was.clone()
    });
    resume(&server);
    let waits = "what came of the order is not stored by NATS yet; trying again";
    worker.wait_for_log(waits, 1);
    assert!(worker.log().contains("maximum bytes"), "{}", worker.log());
    // Longer than a lease: it is renewed meanwhile.
    thread::sleep(Duration::from_secs(12));
    assert!(!worker.log().contains("committed"), "{}", worker.log());
    administrator.change(&as_it_was);
    contest.ends_alike(&server);
    let log = worker.log();
    let times = |word: &str| log.matches(word).count();
    assert!(times("platform fault") == 0, "{log}");
    // A machine that is slow enough loses the lease, and is told so.
    let lost = times("no longer this slot's");
    assert!(
        times(waits) <= 1 + lost,
        "it is told once of each unit:\n{log}"
    );
    assert_eq!(times("begun"), times("committed") + lost, "{log}");
}

/// So many episodes in one message, and none of the others so large.
fn larger(config: &str) -> String {
    config
        .replace("episodes_per_task = 10", "episodes_per_task = 60")
        .replace("episodes_per_shard = 1", "episodes_per_shard = 60")
        .replace("[evaluation]", "[evaluation]\ntasks = [\"hit\"]")
}

#[test]
fn what_stays_larger_than_nats_takes_is_a_fault_of_ours_that_is_told_and_played_again() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let mut nats = Nats::configured(&scratch.path().join("nats"), "max_payload: 8192\n");
    let files = Relay::start();
    let config = larger(&giving(&nats, files.address()));
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    let team = Team::create(&server, "Alpha");
    let agent = bundle::reference("striker", scratch.path());
    let submission = team.submit(&server, &agent);
    let evaluation = team.evaluate(&server, &submission);
    let _worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    let failed = server.poll(&evaluation, &server.admin_token, |told| {
        told["state"] == "platform_failed"
    });
    let reason = failed["reason"].as_str().unwrap_or_default();
    assert!(
        reason.contains("larger than NATS takes: its max_payload is to be raised"),
        "{failed:#}"
    );
    nats.configure("");
    nats.kill_and_start();
    // The server has it played again by itself.
    let _ = server.poll("/api/v1/evaluations", &server.admin_token, |told| {
        let evaluations = told.as_array().into_iter().flatten();
        evaluations
            .into_iter()
            .any(|evaluation| evaluation["state"] == "finished")
    });
}

#[test]
fn what_is_larger_than_nats_takes_waits_until_it_takes_it() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let mut nats = Nats::configured(&scratch.path().join("nats"), "max_payload: 8192\n");
    let files = Relay::start();
    // However slow the machine, it is not given up in this time.
    let config = larger(&giving(&nats, files.address())).replace("lease_s = 10", "lease_s = 3600");
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    let team = Team::create(&server, "Alpha");
    let agent = bundle::reference("striker", scratch.path());
    let submission = team.submit(&server, &agent);
    let evaluation = team.evaluate(&server, &submission);
    let worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    worker.wait_for_log(
        "and NATS takes messages of 8192 at most: raise its max_payload",
        1,
    );
    nats.configure("");
    nats.kill_and_start();
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    let log = worker.log();
    assert_eq!(
        log.matches("begun").count(),
        1,
        "it was played once:\n{log}"
    );
    assert!(!log.contains("platform fault"), "{log}");
}

/// An authority of this name.
fn authority(name: &str) -> CertifiedIssuer<'static, KeyPair> {
    let mut params = CertificateParams::default();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    params.distinguished_name.push(DnType::CommonName, name);
    let key = KeyPair::generate().expect("a key can be made");
    CertifiedIssuer::self_signed(params, key).expect("a certificate can be made")
}

#[test]
fn nats_behind_tls_is_believed_by_the_authority_that_is_named() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let file = |name: &str, text: &str| {
        let file = scratch.path().join(name);
        fs::write(&file, text).expect("a scratch file can be written");
        file
    };
    let (ours, theirs) = (authority("ours"), authority("theirs"));
    let key = KeyPair::generate().expect("a key can be made");
    let certificate = CertificateParams::new(["127.0.0.1".to_owned()])
        .and_then(|params| params.signed_by(&key, &ours))
        .expect("a certificate can be made");
    let [right, wrong] = [("ours.pem", &ours), ("theirs.pem", &theirs)]
        .map(|(name, authority)| file(name, &authority.pem()));
    let nats = format!(
        "tls {{\n  cert_file: {:?}\n  key_file: {:?}\n}}\n",
        file("nats.pem", &certificate.pem()),
        file("nats.key", &key.serialize_pem())
    );
    let nats = Nats::configured(&scratch.path().join("nats"), &nats);
    let files = Relay::start();
    let by = |config: String, authority: &Path| {
        let config = config.replace("nats://", "tls://");
        format!("{config}ca_file = {authority:?}\n")
    };
    let refused = "NATS cannot be reached: its certificate is not believed";
    let giving_by = |authority: &Path| by(giving(&nats, files.address()), authority);
    let taking_by = |authority: &Path| by(taking(nats.address(), 1), authority);

    let server = Server::start(&scratch.path().join("other"), &giving_by(&wrong));
    server.wait_for_log(refused, 1);
    drop(server);
    let worker = Worker::start(scratch.path(), "misled", &taking_by(&wrong));
    worker.wait_for_log(refused, 1);
    // It ends all the same when it is asked to.
    worker.end();

    let server = serving(&contest, &giving_by(&right), &files);
    let worker = Worker::start(scratch.path(), "worker", &taking_by(&right));
    resume(&server);
    contest.ends_alike(&server);
    assert!(!worker.log().contains(refused), "{}", worker.log());
}

/// What gives a program another clock, if it is loaded before the others.
fn another_clock() -> PathBuf {
    let folders = fs::read_dir("/usr/lib").expect("every host has it");
    folders
        .flatten()
        .map(|folder| folder.path().join("faketime/libfaketime.so.1"))
        .find(|library| library.exists())
        .expect("libfaketime is installed; `make setup-test` installs it")
}

#[test]
fn workers_whose_clocks_are_an_hour_off_work_as_any_other() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = serving(&contest, &giving(&nats, files.address()), &files);
    let began = Timestamp::now();
    let workers = [("early", "-3600"), ("late", "+3600")].map(|(name, offset)| {
        let mut command = Command::new(program("faceoff"));
        command
            .env("LD_PRELOAD", another_clock())
            .env("FAKETIME", offset)
            // The clock on the wall is wrong; time passes as everywhere.
            .env("FAKETIME_DONT_FAKE_MONOTONIC", "1")
            .env("DONT_FAKE_MONOTONIC", "1")
            .env("FAKETIME_DISABLE_SHM", "1");
        Worker::start_by(
            command,
            scratch.path(),
            name,
            &taking(nats.address(), 1),
            &[],
        )
    });
    wait_for_workers(&server, workers.len());
    resume(&server);
    contest.ends_alike(&server);
    for (worker, hours) in workers.into_iter().zip([-1.0, 1.0]) {
        let log = worker.log();
        assert!(log.contains("committed"), "each has played:\n{log}");
        assert!(!log.contains("no longer this slot's"), "{log}");
        // A line begins with the time.
        let time = log.split_whitespace().next().expect("it has logged");
        let time: Timestamp = time.parse().expect("a line of a log tells when");
        let off = (time.as_second() - began.as_second()) as f64 / 3600.0;
        assert!((off - hours).abs() < 0.5, "its clock is not off:\n{log}");
    }
}

#[test]
fn a_stream_that_was_made_otherwise_is_told_and_made_anew_once_it_is_deleted() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let config = giving(&nats, files.address());
    let server = serving(&contest, &config, &files);
    let administrator = Administrator::of(&nats);
    let streams =
        ["faceoff-orders", "faceoff-outcomes"].map(|name| (name, administrator.stream(name)));
    server.kill();
    for (name, stream) in streams {
        administrator.delete(name);
        administrator.make(Config {
            retention: RetentionPolicy::Limits,
            ..stream
        });
    }
    let server = serving(&contest, &config, &files);
    let worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    wait_for_workers(&server, 1);
    resume(&server);
    for name in ["faceoff-orders", "faceoff-outcomes"] {
        let told = format!("the stream {name} was made otherwise than this server needs it");
        server.wait_for_log(&told, 1);
        wait_for_trouble(&server, &told);
        let log = server.log();
        assert_eq!(log.matches(&told).count(), 1, "it is told once:\n{log}");
    }
    assert!(!worker.log().contains("begun"), "{}", worker.log());
    for name in ["faceoff-orders", "faceoff-outcomes"] {
        administrator.delete(name);
    }
    wait_for_no_trouble(&server);
    contest.ends_alike(&server);
}
