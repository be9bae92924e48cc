//! Interruptions of remote workers: cut and slow network connections, full disks, wrong clocks. Each evaluation ends with the
//! same result as on a single machine, and no agent gets a fault.

use super::{RemoteSetup, resume, wait_for_workers, worker_config};
use faceoff_tests::{
    faketime, program,
    relay::{ConnectionBreaks, Relay},
    small_disk::{FilledDisk, MountedDisk},
    worker::Worker,
};
use jiff::Timestamp;
use std::{process::Command, time::Duration};

/// Size of the small disk for a worker's temporary files.
const SCRATCH_DISK_BYTES: u64 = 64 << 20;
/// Seed for the relay of file transfers: the first connection breaks within 300 kB, inside a bundle of more than a megabyte.
const SEED_BREAKING_BUNDLE: u64 = 65;

#[test]
fn disconnected_worker_stops_and_another_gets_its_job() {
    let setup = RemoteSetup::start();
    let nats_relay = Relay::start();
    nats_relay.set_target(setup.nats.address());
    let disconnected = Worker::start(
        setup.scratch.path(),
        "disconnected",
        &worker_config(nats_relay.address(), 1),
    );
    resume(&setup.server);
    disconnected.wait_for_log("committed", 1);
    disconnected.wait_for_log("started job=", 2);
    // The worker cannot send the result of its current job in time.
    nats_relay.disconnect();
    let other = setup.start_worker("other");
    setup.assert_equal_result();
    nats_relay.set_target(setup.nats.address());
    other.stop();
    disconnected.stop();
}

#[test]
fn slow_and_breaking_connections_lose_no_result() {
    let setup = RemoteSetup::start();
    let nats_relays = [Relay::start(), Relay::start()];
    for (seed, relay) in (0..).zip(&nats_relays) {
        relay.set_target(setup.nats.address());
        relay.set_breaks(ConnectionBreaks {
            seed,
            refused_percent: 5,
            max_bytes: 64 << 10,
        });
        relay.set_delay(Duration::from_millis(200));
    }
    setup.file_relay.set_breaks(ConnectionBreaks {
        seed: SEED_BREAKING_BUNDLE,
        refused_percent: 5,
        max_bytes: 16 << 20,
    });
    setup.file_relay.set_delay(Duration::from_millis(200));
    let workers = [0, 1].map(|index: usize| {
        let name = format!("worker-{index}");
        Worker::start(
            setup.scratch.path(),
            &name,
            &worker_config(nats_relays[index].address(), 1),
        )
    });
    resume(&setup.server);
    setup.assert_equal_result();
    for relay in nats_relays.iter().chain([&setup.file_relay]) {
        assert!(
            relay.broken_connections() > 0,
            "a relay had no broken connection"
        );
    }
    for worker in workers {
        let log = worker.log();
        assert!(log.contains("committed"), "a worker has run no job:\n{log}");
    }
}

#[test]
fn worker_with_full_disk_releases_jobs_until_it_has_space() {
    let setup = RemoteSetup::start();
    let disk = MountedDisk::at(
        &setup.scratch.path().join("full/scratch"),
        SCRATCH_DISK_BYTES,
    );
    let mut command = disk.namespace_command();
    command.arg(program("faceoff"));
    let config = worker_config(setup.nats.address(), 1);
    let full_disk_worker =
        Worker::start_with_command(command, setup.scratch.path(), "full", &config, &[]);
    wait_for_workers(&setup.server, [&full_disk_worker]);
    let filled_disk = FilledDisk::fill(&disk.outside_path());
    resume(&setup.server);
    full_disk_worker.wait_for_log("disk full: job released", 3);
    let other = Worker::start(setup.scratch.path(), "other", &config);
    other.wait_for_log("committed", 2);
    assert!(
        !full_disk_worker.log().contains("committed"),
        "{}",
        full_disk_worker.log()
    );
    other.stop();
    drop(filled_disk);
    full_disk_worker.wait_for_log("committed", 1);

    setup.assert_equal_result();
    // A full disk counts as no failure.
    setup.reference_run.assert_no_retries(&setup.server);
}

#[test]
fn workers_with_wrong_clocks_run_jobs_normally() {
    let setup = RemoteSetup::start();
    let started_at = Timestamp::now();
    let workers = [("behind", "-3600"), ("ahead", "+3600")].map(|(name, offset_s)| {
        let mut command = Command::new(program("faceoff"));
        command
            .env("LD_PRELOAD", faketime::library())
            .env("FAKETIME", offset_s)
            // Only the wall clock is wrong; the monotonic clock is right.
            .env("FAKETIME_DONT_FAKE_MONOTONIC", "1")
            .env("DONT_FAKE_MONOTONIC", "1")
            .env("FAKETIME_DISABLE_SHM", "1");
        Worker::start_with_command(
            command,
            setup.scratch.path(),
            name,
            &worker_config(setup.nats.address(), 1),
            &[],
        )
    });
    wait_for_workers(&setup.server, &workers);
    resume(&setup.server);
    setup.assert_equal_result();
    for (worker, expected_offset_h) in workers.into_iter().zip([-1.0, 1.0]) {
        let log = worker.log();
        assert!(log.contains("committed"), "a worker has run no job:\n{log}");
        assert!(!log.contains("lease lost"), "{log}");
        // A log line begins with its time.
        let time = log.split_whitespace().next().expect("the log has a line");
        let time: Timestamp = time.parse().expect("a log line begins with its time");
        let offset_h = (time.as_second() - started_at.as_second()) as f64 / 3600.0;
        assert!(
            (offset_h - expected_offset_h).abs() < 0.5,
            "the worker's clock is not {expected_offset_h} h off:\n{log}"
        );
    }
}
