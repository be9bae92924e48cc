//! Workers on other machines that are asked to end (SIGTERM) in the middle of something: it goes back at once, and counts for nothing. Leases
//! last for an hour here, so that nobody else would have it if its end were waited for.

use super::{Contest, giving, resume, sized, taking};
use crate::{Team, dataset, entry, path_of, start_day};
use faceoff_tests::{bundle, nats::Nats, relay::Relay, repository, server::Server, worker::Worker};
use serde_json::json;
use std::net::TcpListener;

fn for_an_hour(config: &str) -> String {
    config.replace("lease_s = 10", "lease_s = 3600")
}

#[test]
fn what_waits_for_its_bundle_goes_back_and_is_played_by_the_same_worker_started_again() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    // Whoever comes there is let in, and never answered.
    let silent = TcpListener::bind(("127.0.0.1", 0)).expect("there is a port");
    files.lead_to(silent.local_addr().expect("it is bound"));
    let config = for_an_hour(&giving(&nats, files.address()));
    let server = Server::start(&contest.data, &config);
    let config = taking(nats.address(), 1);
    let worker = Worker::start(scratch.path(), "worker", &config);
    resume(&server);
    worker.wait_for_log("begun", 1);
    worker.ask_to_end();
    worker.wait_for_log("no longer this slot's", 1);
    server.wait_for_log("taken in", 1);
    let log = worker.log();
    worker.ends();
    assert!(!log.contains("platform fault"), "{log}");
    assert!(!log.contains("committed"), "{log}");

    files.lead_to(server.address().into());
    let again = Worker::start(scratch.path(), "worker", &config);
    let (evaluation, token) = (contest.evaluation.clone(), contest.team.token.clone());
    contest.ends_alike(&server);
    again.end();
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
fn what_is_being_played_goes_back_and_another_begins_it() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    // One shard of one task.
    let config = sized(&for_an_hour(&giving(&nats, files.address())), 40, 40)
        .replace("[evaluation]", "[evaluation]\ntasks = [\"hit\"]");
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    // No smoke run has so many control steps; the shard has more.
    let hangs = bundle::python_agent(
        "seen = globals().setdefault('seen', [0])\nseen[0] += 1\nif seen[0] > 3000: time.sleep(600)\nsay(hold)",
    );
    let hangs = bundle::python_bundle(scratch.path(), "hangs", &hangs);
    let team = Team::create(&server, "Slow");
    let submission = team.submit(&server, &hangs);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let [first, second] = ["first", "second"];
    let first = Worker::start(scratch.path(), first, &taking(nats.address(), 1));
    let evaluation = path_of(&start_day(&server), &submission);
    // It plays, and never comes to an end of it.
    let _ = server.poll(&evaluation, &team.token, |told| {
        told["progress"]["episodes_done"].as_u64() > Some(0)
    });
    first.ask_to_end();
    server.wait_for_log("taken in", 1);
    let second = Worker::start(scratch.path(), second, &taking(nats.address(), 1));
    second.wait_for_log("begun", 1);
    let log = first.log();
    first.ends();
    assert!(!log.contains("platform fault"), "{log}");
    assert!(!log.contains("committed"), "{log}");
}

#[test]
fn what_is_cancelled_stops_elsewhere_and_the_slot_goes_on() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let config = sized(&giving(&nats, files.address()), 40, 40);
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    // No smoke run has so many control steps; each shard here has more.
    let hangs = bundle::python_agent(
        "seen = globals().setdefault('seen', [0])\nseen[0] += 1\nif seen[0] > 3000: time.sleep(600)\nsay(hold)",
    );
    let hangs = bundle::python_bundle(scratch.path(), "hangs", &hangs);
    let (slow, quick) = (
        Team::create(&server, "Slow"),
        Team::create(&server, "Quick"),
    );
    let of_slow = slow.submit(&server, &hangs);
    let of_quick = quick.submit(&server, &repository().join("agents/hold"));
    assert_eq!(of_slow["state"], "valid", "{of_slow:#}");
    let worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    let day = start_day(&server);
    let [of_slow, of_quick] = [&of_slow, &of_quick].map(|submission| path_of(&day, submission));
    let _ = server.poll(&of_slow, &slow.token, |answer| answer["state"] == "running");
    let cancelled = server.post(
        &format!("{of_slow}/cancel"),
        &server.admin_token,
        &json!({ "reason": "Its team asked for it" }),
    );
    assert!(cancelled.status().is_success(), "{}", cancelled.status());
    worker.wait_for_log("no longer this slot's", 1);
    let finished = quick.finished(&server, &of_quick);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    worker.end();
}
