//! What goes wrong on the way to workers on other machines, or on them: each run ends as one of a slot of the server's own, but for
//! times, and nobody blames the agent.

use super::{Contest, giving, resume, serving, taking, wait_for_workers};
use crate::{dataset, entry};
use faceoff_tests::{
    nats::Nats,
    program,
    relay::{Breaks, Relay},
    small_disk::{Full, Mounted},
    worker::Worker,
};
use jiff::Timestamp;
use std::{fs, path::PathBuf, process::Command, time::Duration};

const SCRATCH_BYTES: u64 = 64 << 20;
/// By this seed the first of the connections for files breaks within 300 kB: in the middle of a bundle of more than a megabyte.
const CUT_IN_THE_BUNDLE: u64 = 65;

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
