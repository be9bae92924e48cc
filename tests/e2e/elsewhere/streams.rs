//! What NATS refuses, lacks or is: each has its words where one looks, and what waits for it goes on once it is mended.

use super::{COMMON, Contest, giving, resume, serving, sized, taking, wait_for_workers};
use crate::Team;
use async_nats::jetstream::{
    self,
    stream::{Config, RetentionPolicy},
};
use faceoff_tests::{
    bundle,
    nats::Nats,
    relay::Relay,
    repository,
    server::{PATIENCE, Server},
    worker::Worker,
};
use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, DnType, IsCa, KeyPair};
use serde_json::json;
use std::{
    fs,
    path::Path,
    thread,
    time::{Duration, Instant},
};
use tokio::runtime::Runtime;

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
    // So do page and health.
    wait_for_trouble(&server, "maximum bytes");
    for path in ["/api/v1/health", "/readyz"] {
        let _ = server.poll(path, &server.admin_token, |told| {
            let detail = told["detail"].as_str();
            detail.is_some_and(|detail| detail.contains("maximum bytes"))
        });
    }
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
    sized(config, 60, 60).replace("[evaluation]", "[evaluation]\ntasks = [\"hit\"]")
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

#[test]
fn without_nats_a_server_starts_waits_and_goes_on_once_it_is_there() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (files, link) = (Relay::start(), Relay::start());
    let config = format!(
        "{COMMON}[workers]\nslots = 1\nplay = false\n[nats]\nurl = \"nats://{}\"\nfiles_url = \"http://{}\"\n",
        link.address(),
        files.address()
    );
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    server.wait_for_log("NATS cannot be reached", 1);
    // Whoever watches it is told: nobody would play.
    let not_ready = |word: &str| {
        let health = server.poll("/api/v1/health", &server.admin_token, |told| {
            told["detail"]
                .as_str()
                .is_some_and(|detail| detail.contains(word))
        });
        assert_eq!(health["status"], 503, "{health:#}");
    };
    not_ready("The server cannot reach NATS: nats://");
    let worker = Worker::start(scratch.path(), "worker", &taking(link.address(), 1));
    worker.wait_for_log("NATS cannot be reached", 1);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let nats = Nats::start(&scratch.path().join("nats"));
    link.lead_to(nats.address());
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    // One that is paid by the hour goes when there is nothing to do.
    let words = ["--drain-after-idle", "1s"];
    Worker::start_with(scratch.path(), "idle", &taking(link.address(), 1), &words).ends();
    let workers = server.poll("/api/v1/workers", &server.admin_token, |told| {
        told["troubles"] == json!([])
    });
    let names = [0, 1].map(|index: usize| workers["workers"][index]["name"].clone());
    assert_eq!(names, ["idle", "worker"], "{workers:#}");
    let _ = server.poll("/api/v1/health", &server.admin_token, |told| {
        told["status"] == "ok"
    });
}
