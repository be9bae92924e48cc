//! Remote workers that are stopped (SIGTERM) or whose job is cancelled. A stopped worker releases its job at once, and the job
//! counts as no failure. A *lease* is a worker's right to run a job for a time. In most tests here leases last an hour, so
//! another worker gets the job only if it is released.

use super::{ReferenceRun, resume, server_config, with_episodes, worker_config};
use crate::{Team, evaluation_path, start_day};
use faceoff_tests::{bundle, nats::Nats, relay::Relay, repository, server::Server, worker::Worker};
use serde_json::json;
use std::{
    net::TcpListener,
    path::{Path, PathBuf},
};

/// Episodes of a shard (job) that the hanging agent does not complete.
const EPISODES: u32 = 40;

/// An agent that hangs after 3000 control steps: validation runs are shorter, a shard of [`EPISODES`] is longer.
fn hanging_bundle(scratch: &Path) -> PathBuf {
    let source = bundle::python_agent(
        "seen = globals().setdefault('seen', [0])\nseen[0] += 1\nif seen[0] > 3000: time.sleep(600)\nsay(hold)",
    );
    bundle::python_bundle(scratch, "hangs", &source)
}

fn with_hour_leases(config: &str) -> String {
    config.replace("lease_s = 10", "lease_s = 3600")
}

#[test]
fn job_waiting_for_bundle_is_released_and_rerun_after_restart() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    // This listener accepts connections and never answers.
    let silent_listener = TcpListener::bind(("127.0.0.1", 0)).expect("there is a port");
    file_relay.set_target(silent_listener.local_addr().expect("it is bound"));
    let config = with_hour_leases(&server_config(&nats, file_relay.address()));
    let server = Server::start(&reference_run.data_dir, &config);
    let config = worker_config(nats.address(), 1);
    let worker = Worker::start(scratch.path(), "worker", &config);
    resume(&server);
    worker.wait_for_log("started job=", 1);
    worker.request_stop();
    worker.wait_for_log("lease lost", 1);
    server.wait_for_log("result accepted", 1);
    let log = worker.log();
    worker.wait_for_exit();
    assert!(!log.contains("platform fault"), "{log}");
    assert!(!log.contains("committed"), "{log}");

    file_relay.set_target(server.address().into());
    let restarted = Worker::start(scratch.path(), "worker", &config);
    reference_run.assert_equal_result(&server);
    restarted.stop();
    // The release counts as no failure.
    reference_run.assert_no_retries(&server);
}

#[test]
fn running_job_is_released_and_started_by_another_worker() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    // One shard of one task.
    let config = with_episodes(
        &with_hour_leases(&server_config(&nats, file_relay.address())),
        EPISODES,
        EPISODES,
    )
    .replace("[evaluation]", "[evaluation]\ntasks = [\"hit\"]");
    let server = Server::start(&scratch.path().join("data"), &config);
    file_relay.set_target(server.address().into());
    let hanging_bundle = hanging_bundle(scratch.path());
    let team = Team::create(&server, "Slow");
    let submission = team.submit(&server, &hanging_bundle);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let first = Worker::start(scratch.path(), "first", &worker_config(nats.address(), 1));
    let evaluation = evaluation_path(&start_day(&server), &submission);
    // The shard has started, and will never end.
    let _ = server.poll(&evaluation, &server.admin_token, |view| {
        view["progress"]["episodes_done"].as_u64() > Some(0)
    });
    first.request_stop();
    server.wait_for_log("result accepted", 1);
    let second = Worker::start(scratch.path(), "second", &worker_config(nats.address(), 1));
    second.wait_for_log("started job=", 1);
    let log = first.log();
    first.wait_for_exit();
    assert!(!log.contains("platform fault"), "{log}");
    assert!(!log.contains("committed"), "{log}");
}

#[test]
fn cancelled_job_stops_on_worker_and_frees_its_slot() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let config = with_episodes(
        &server_config(&nats, file_relay.address()),
        EPISODES,
        EPISODES,
    );
    let server = Server::start(&scratch.path().join("data"), &config);
    file_relay.set_target(server.address().into());
    let hanging_bundle = hanging_bundle(scratch.path());
    let (slow, quick) = (
        Team::create(&server, "Slow"),
        Team::create(&server, "Quick"),
    );
    let slow_submission = slow.submit(&server, &hanging_bundle);
    let quick_submission = quick.submit(&server, &repository().join("agents/hold"));
    assert_eq!(slow_submission["state"], "valid", "{slow_submission:#}");
    let worker = Worker::start(scratch.path(), "worker", &worker_config(nats.address(), 1));
    let day = start_day(&server);
    let [slow_evaluation, quick_evaluation] =
        [&slow_submission, &quick_submission].map(|submission| evaluation_path(&day, submission));
    let _ = server.poll(&slow_evaluation, &slow.token, |answer| {
        answer["state"] == "running"
    });
    let cancelled = server.post(
        &format!("{slow_evaluation}/cancel"),
        &server.admin_token,
        &json!({ "reason": "Its team asked for it" }),
    );
    assert!(cancelled.status().is_success(), "{}", cancelled.status());
    worker.wait_for_log("lease lost", 1);
    let finished = quick.wait_until_finished(&server, &quick_evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    worker.stop();
}
