//! Problems of NATS, the message broker between server and remote workers: full streams (stored messages), payload limits, TLS,
//! changed streams, a missing NATS server. Each is reported, and jobs continue once it is fixed.

use super::{
    COMMON_CONFIG, ReferenceRun, RemoteSetup, resume, server_config, start_server,
    wait_for_workers, with_episodes, worker_config,
};
use crate::Team;
use async_nats::jetstream::{
    self,
    stream::{Config, RetentionPolicy},
};
use faceoff_tests::{
    bundle,
    nats::{ENOUGH_SPACE, Nats},
    relay::Relay,
    repository,
    server::{Server, TIMEOUT},
    worker::Worker,
};
use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, DnType, IsCa, KeyPair};
use serde_json::json;
use std::{
    fs,
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant},
};
use tokio::runtime::Runtime;

/// Waits until the server reports a problem with this text to organisers.
fn wait_for_problem(server: &Server, text: &str) {
    let _ = server.poll("/api/v1/workers", &server.admin_token, |view| {
        let problems = view["problems"].as_array().expect("a list of problems");
        problems
            .iter()
            .any(|problem| problem.as_str().is_some_and(|found| found.contains(text)))
    });
}

fn wait_for_no_problem(server: &Server) {
    let _ = server.poll("/api/v1/workers", &server.admin_token, |view| {
        view["problems"] == json!([])
    });
}

/// A NATS client that may change streams.
struct NatsAdministrator {
    runtime: Runtime,
    jetstream: jetstream::Context,
}

impl NatsAdministrator {
    fn connect(nats: &Nats) -> Self {
        let runtime = Runtime::new().expect("a runtime starts");
        let jetstream = runtime.block_on(async {
            let client = async_nats::connect(nats.url()).await;
            jetstream::new(client.expect("NATS is there"))
        });
        Self { runtime, jetstream }
    }

    /// The configuration of a stream, once the server has created it.
    fn stream_config(&self, name: &str) -> Config {
        let started = Instant::now();
        loop {
            let found = self.runtime.block_on(self.jetstream.get_stream(name));
            match found {
                Ok(stream) => return stream.cached_info().config.clone(),
                Err(error) => assert!(started.elapsed() < TIMEOUT, "{name}: {error}"),
            }
            // The server sends no event when it creates a stream.
            thread::sleep(Duration::from_millis(20));
        }
    }

    fn update_stream(&self, stream: &Config) {
        let updated = self.runtime.block_on(self.jetstream.update_stream(stream));
        let _ = updated.expect("NATS updates the stream");
    }

    fn create_stream(&self, stream: Config) {
        let created = self.runtime.block_on(self.jetstream.create_stream(stream));
        let _ = created.expect("NATS creates the stream");
    }

    fn delete_stream(&self, name: &str) {
        let deleted = self.runtime.block_on(self.jetstream.delete_stream(name));
        let _ = deleted.expect("NATS deletes the stream");
    }
}

#[test]
fn result_waits_while_stream_is_full() {
    let setup = RemoteSetup::start();
    let worker = setup.start_worker("worker");
    wait_for_workers(&setup.server, [&worker]);
    let administrator = NatsAdministrator::connect(&setup.nats);
    let original_config = administrator.stream_config("faceoff-outcomes");
    administrator.update_stream(&Config {
        max_bytes: 1,
        ..original_config.clone()
    });
    resume(&setup.server);
    let message = "the result is not stored by NATS yet; trying again";
    worker.wait_for_log(message, 1);
    assert!(worker.log().contains("maximum bytes"), "{}", worker.log());
    // The page of workers describes the problem, too. The health endpoints only say that there is one.
    wait_for_problem(&setup.server, "maximum bytes");
    for path in ["/api/v1/health", "/readyz"] {
        let _ = setup.server.poll(path, &setup.server.admin_token, |view| {
            let detail = view["detail"].as_str();
            detail.is_some_and(|detail| detail.contains("cannot exchange jobs or results"))
        });
    }
    // A lease (the worker's right to run the job) lasts 10 s. The worker must renew it during this pause.
    thread::sleep(Duration::from_secs(12));
    assert!(!worker.log().contains("committed"), "{}", worker.log());
    administrator.update_stream(&original_config);
    setup.assert_equal_result();
    let log = worker.log();
    let count = |word: &str| log.matches(word).count();
    assert!(count("platform fault") == 0, "{log}");
    // On a slow machine the worker may lose the lease, which the log reports.
    let lost_leases = count("lease lost");
    assert!(
        count(message) <= 1 + lost_leases,
        "the worker logs it once for each job:\n{log}"
    );
    assert_eq!(
        count("slot: started"),
        count("slot: committed") + lost_leases,
        "{log}"
    );
}

/// The configuration with all 30 episodes in one shard (job), so that its result is the only message over the payload limit.
/// All episodes may end with an agent fault.
fn with_one_shard(config: &str) -> String {
    with_episodes(config, 30, 30).replace(
        "[evaluation]",
        "[evaluation]\ntasks = [\"hit\"]\nmax_faults = 30",
    )
}

/// An agent that passes the validation run, which has at most 1500 control steps. Later it ends each episode at once, with
/// an agent fault.
fn failing_agent(scratch: &Path) -> PathBuf {
    let source = bundle::python_agent(
        "seen = globals().setdefault('seen', [0])\nseen[0] += 1\nsay(hold if seen[0] <= 1500 else {})",
    );
    bundle::python_bundle(scratch, "failing", &source)
}

#[test]
fn oversized_result_is_platform_fault_and_evaluation_is_rerun() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let mut nats = Nats::start_with_config(&scratch.path().join("nats"), "max_payload: 8192\n");
    let file_relay = Relay::start();
    let config = with_one_shard(&server_config(&nats, file_relay.address()));
    let server = Server::start(&scratch.path().join("data"), &config);
    file_relay.set_target(server.address().into());
    let team = Team::create(&server, "Alpha");
    let agent = failing_agent(scratch.path());
    let submission = team.submit(&server, &agent);
    let evaluation = team.evaluate(&server, &submission);
    let _worker = Worker::start(scratch.path(), "worker", &worker_config(nats.address(), 1));
    let failed = server.poll(&evaluation, &server.admin_token, |view| {
        view["state"] == "platform_failed"
    });
    let reason = failed["reason"].as_str().unwrap_or_default();
    assert!(
        reason.contains("exceeds the max_payload of NATS, which must be raised"),
        "{failed:#}"
    );
    nats.configure("");
    nats.kill_and_restart();
    // The server repeats the evaluation automatically.
    let _ = server.poll("/api/v1/evaluations", &server.admin_token, |view| {
        let evaluations = view.as_array().into_iter().flatten();
        evaluations
            .into_iter()
            .any(|evaluation| evaluation["state"] == "finished")
    });
}

#[test]
fn oversized_result_waits_until_limit_is_raised() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let mut nats = Nats::start_with_config(&scratch.path().join("nats"), "max_payload: 8192\n");
    let file_relay = Relay::start();
    // The lease is long enough for slow machines.
    let config = with_one_shard(&server_config(&nats, file_relay.address()))
        .replace("lease_s = 10", "lease_s = 3600");
    let server = Server::start(&scratch.path().join("data"), &config);
    file_relay.set_target(server.address().into());
    let team = Team::create(&server, "Alpha");
    let agent = failing_agent(scratch.path());
    let submission = team.submit(&server, &agent);
    let evaluation = team.evaluate(&server, &submission);
    let worker = Worker::start(scratch.path(), "worker", &worker_config(nats.address(), 1));
    worker.wait_for_log(
        "but NATS accepts messages of at most 8192: raise its max_payload",
        1,
    );
    nats.configure("");
    nats.kill_and_restart();
    let finished = team.wait_until_finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    let log = worker.log();
    assert_eq!(
        log.matches("started job=").count(),
        1,
        "the job ran more than once:\n{log}"
    );
    assert!(!log.contains("platform fault"), "{log}");
}

/// A certificate authority with this name.
fn certificate_authority(name: &str) -> CertifiedIssuer<'static, KeyPair> {
    let mut params = CertificateParams::default();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    params.distinguished_name.push(DnType::CommonName, name);
    let key = KeyPair::generate().expect("a key can be made");
    CertifiedIssuer::self_signed(params, key).expect("a certificate can be made")
}

#[test]
fn nats_certificate_is_verified_with_configured_authority() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let write_file = |name: &str, text: &str| {
        let file = scratch.path().join(name);
        fs::write(&file, text).expect("a scratch file can be written");
        file
    };
    let (trusted, untrusted) = (
        certificate_authority("trusted"),
        certificate_authority("untrusted"),
    );
    let key = KeyPair::generate().expect("a key can be made");
    let certificate = CertificateParams::new(["127.0.0.1".to_owned()])
        .and_then(|params| params.signed_by(&key, &trusted))
        .expect("a certificate can be made");
    let [trusted_file, untrusted_file] = [("trusted.pem", &trusted), ("untrusted.pem", &untrusted)]
        .map(|(name, authority)| write_file(name, &authority.pem()));
    let nats_config = format!(
        "tls {{\n  cert_file: {:?}\n  key_file: {:?}\n}}\n",
        write_file("nats.pem", &certificate.pem()),
        write_file("nats.key", &key.serialize_pem())
    );
    let nats = Nats::start_with_config(&scratch.path().join("nats"), &nats_config);
    let file_relay = Relay::start();
    let with_authority = |config: String, authority: &Path| {
        let config = config.replace("nats://", "tls://");
        format!("{config}ca_file = {authority:?}\n")
    };
    let refusal = "NATS cannot be reached: its certificate is not trusted";
    let server_config_with =
        |authority: &Path| with_authority(server_config(&nats, file_relay.address()), authority);
    let worker_config_with =
        |authority: &Path| with_authority(worker_config(nats.address(), 1), authority);

    let server = Server::start(
        &scratch.path().join("other"),
        &server_config_with(&untrusted_file),
    );
    server.wait_for_log(refusal, 1);
    drop(server);
    let worker = Worker::start(
        scratch.path(),
        "misconfigured",
        &worker_config_with(&untrusted_file),
    );
    worker.wait_for_log(refusal, 1);
    // The worker still stops when it is asked to.
    worker.stop();

    let server = start_server(
        &reference_run,
        &server_config_with(&trusted_file),
        &file_relay,
    );
    let worker = Worker::start(scratch.path(), "worker", &worker_config_with(&trusted_file));
    resume(&server);
    reference_run.assert_equal_result(&server);
    assert!(!worker.log().contains(refusal), "{}", worker.log());
}

#[test]
fn nats_without_space_for_results_is_reported() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let mut nats = Nats::start_with_config(
        &scratch.path().join("nats"),
        "jetstream: {max_file_store: 100MB}\n",
    );
    let file_relay = Relay::start();
    let config = server_config(&nats, file_relay.address());
    let server = start_server(&reference_run, &config, &file_relay);
    let problem = "NATS has no space for the stream faceoff-outcomes, which needs 256 MiB";
    wait_for_problem(&server, problem);
    resume(&server);
    let worker = Worker::start(scratch.path(), "worker", &worker_config(nats.address(), 1));
    nats.configure(ENOUGH_SPACE);
    nats.kill_and_restart();
    reference_run.assert_equal_result(&server);
    assert!(worker.log().contains("committed"), "{}", worker.log());
}

#[test]
fn stream_with_other_settings_is_reported_then_recreated() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let config = server_config(&nats, file_relay.address());
    let server = start_server(&reference_run, &config, &file_relay);
    let administrator = NatsAdministrator::connect(&nats);
    let streams = ["faceoff-orders", "faceoff-outcomes"]
        .map(|name| (name, administrator.stream_config(name)));
    server.kill();
    for (name, stream) in streams {
        administrator.delete_stream(name);
        administrator.create_stream(Config {
            retention: RetentionPolicy::Limits,
            ..stream
        });
    }
    let server = start_server(&reference_run, &config, &file_relay);
    let worker = Worker::start(scratch.path(), "worker", &worker_config(nats.address(), 1));
    wait_for_workers(&server, [&worker]);
    resume(&server);
    for name in ["faceoff-orders", "faceoff-outcomes"] {
        let message = format!("the stream {name} has other settings than this server needs");
        server.wait_for_log(&message, 1);
        wait_for_problem(&server, &message);
        let log = server.log();
        assert_eq!(
            log.matches(&message).count(),
            1,
            "the server logs it once:\n{log}"
        );
    }
    assert!(!worker.log().contains("started job="), "{}", worker.log());
    for name in ["faceoff-orders", "faceoff-outcomes"] {
        administrator.delete_stream(name);
    }
    wait_for_no_problem(&server);
    reference_run.assert_equal_result(&server);
}

#[test]
fn server_without_nats_starts_and_continues_once_connected() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (file_relay, nats_relay) = (Relay::start(), Relay::start());
    // With `play = false` the server's own slot only validates submissions and computes scores; the remote worker runs the episodes.
    let config = format!(
        "{COMMON_CONFIG}[workers]\nslots = 1\nplay = false\n[nats]\nurl = \"nats://{}\"\nfiles_url = \"http://{}\"\n",
        nats_relay.address(),
        file_relay.address()
    );
    let server = Server::start(&scratch.path().join("data"), &config);
    file_relay.set_target(server.address().into());
    server.wait_for_log("NATS cannot be reached", 1);
    // The health endpoint reports the problem, since no job would run.
    let wait_for_unhealthy = |word: &str| {
        let health = server.poll("/api/v1/health", &server.admin_token, |view| {
            view["detail"]
                .as_str()
                .is_some_and(|detail| detail.contains(word))
        });
        assert_eq!(health["status"], 503, "{health:#}");
    };
    wait_for_unhealthy("remote workers and the server cannot exchange jobs or results");
    let worker = Worker::start(
        scratch.path(),
        "worker",
        &worker_config(nats_relay.address(), 1),
    );
    worker.wait_for_log("NATS cannot be reached", 1);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let nats = Nats::start(&scratch.path().join("nats"));
    nats_relay.set_target(nats.address());
    let finished = team.wait_until_finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    // A worker with --drain-after-idle stops when no job is left.
    let options = ["--drain-after-idle", "1s"];
    Worker::start_with_arguments(
        scratch.path(),
        "idle",
        &worker_config(nats_relay.address(), 1),
        &options,
    )
    .wait_for_exit();
    let workers = server.poll("/api/v1/workers", &server.admin_token, |view| {
        view["problems"] == json!([])
    });
    let names = [0, 1].map(|index: usize| workers["workers"][index]["name"].clone());
    assert_eq!(names, ["idle", "worker"], "{workers:#}");
    let _ = server.poll("/api/v1/health", &server.admin_token, |view| {
        view["status"] == "ok"
    });
}
