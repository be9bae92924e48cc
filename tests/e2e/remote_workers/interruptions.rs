//! Interruptions of remote workers: cut and slow network connections, full disks, wrong clocks. Each evaluation ends with the
//! same result as on a single machine, and no agent gets a fault.

use super::{ReferenceRun, resume, server_config, start_server, wait_for_workers, worker_config};
use crate::{dataset, entry};
use faceoff_tests::{
    nats::Nats,
    program,
    relay::{ConnectionBreaks, Relay},
    small_disk::{FilledDisk, MountedDisk},
    worker::Worker,
};
use jiff::Timestamp;
use std::{fs, path::PathBuf, process::Command, time::Duration};

/// Size of the small disk for a worker's temporary files.
const SCRATCH_DISK_BYTES: u64 = 64 << 20;
/// Seed for the relay of file transfers: the first connection breaks within 300 kB, inside a bundle of more than a megabyte.
const SEED_BREAKING_BUNDLE: u64 = 65;

#[test]
fn disconnected_worker_stops_and_another_gets_its_job() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let (file_relay, nats_relay) = (Relay::start(), Relay::start());
    nats_relay.set_target(nats.address());
    let server = start_server(
        &reference_run,
        &server_config(&nats, file_relay.address()),
        &file_relay,
    );
    let disconnected = Worker::start(
        scratch.path(),
        "disconnected",
        &worker_config(nats_relay.address(), 1),
    );
    resume(&server);
    disconnected.wait_for_log("committed", 1);
    disconnected.wait_for_log("started job=", 2);
    // The worker cannot send the result of its current job in time.
    nats_relay.disconnect();
    let other = Worker::start(scratch.path(), "other", &worker_config(nats.address(), 1));
    reference_run.assert_equal_result(&server);
    nats_relay.set_target(nats.address());
    other.stop();
    disconnected.stop();
}

#[test]
fn slow_and_breaking_connections_lose_no_result() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let server = start_server(
        &reference_run,
        &server_config(&nats, file_relay.address()),
        &file_relay,
    );
    let nats_relays = [Relay::start(), Relay::start()];
    for (seed, relay) in (0..).zip(&nats_relays) {
        relay.set_target(nats.address());
        relay.set_breaks(ConnectionBreaks {
            seed,
            refused_percent: 5,
            max_bytes: 64 << 10,
        });
        relay.set_delay(Duration::from_millis(200));
    }
    file_relay.set_breaks(ConnectionBreaks {
        seed: SEED_BREAKING_BUNDLE,
        refused_percent: 5,
        max_bytes: 16 << 20,
    });
    file_relay.set_delay(Duration::from_millis(200));
    let workers = [0, 1].map(|index: usize| {
        let name = format!("worker-{index}");
        Worker::start(
            scratch.path(),
            &name,
            &worker_config(nats_relays[index].address(), 1),
        )
    });
    resume(&server);
    reference_run.assert_equal_result(&server);
    for relay in nats_relays.iter().chain([&file_relay]) {
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
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let server = start_server(
        &reference_run,
        &server_config(&nats, file_relay.address()),
        &file_relay,
    );
    let disk = MountedDisk::at(&scratch.path().join("full/scratch"), SCRATCH_DISK_BYTES);
    let mut command = disk.namespace_command();
    command.arg(program("faceoff"));
    let config = worker_config(nats.address(), 1);
    let full_disk_worker =
        Worker::start_with_command(command, scratch.path(), "full", &config, &[]);
    wait_for_workers(&server, 1);
    let filled_disk = FilledDisk::fill(&disk.outside_path());
    resume(&server);
    full_disk_worker.wait_for_log("disk full: job released", 3);
    let other = Worker::start(scratch.path(), "other", &config);
    other.wait_for_log("committed", 2);
    assert!(
        !full_disk_worker.log().contains("committed"),
        "{}",
        full_disk_worker.log()
    );
    other.stop();
    drop(filled_disk);
    full_disk_worker.wait_for_log("committed", 1);

    let (evaluation, token) = (
        reference_run.evaluation.clone(),
        reference_run.team.token.clone(),
    );
    reference_run.assert_equal_result(&server);
    let shards = entry(
        &mut dataset(&server, &evaluation, &token),
        "calibration.json",
    );
    for shard in shards["shards"].as_array().expect("it lists the shards") {
        assert_eq!(
            shard.get("platform_retries"),
            None,
            "a full disk counts as no failure: {shards:#}"
        );
    }
}

/// The library that gives a program a wrong clock when it is preloaded.
fn faketime_library() -> PathBuf {
    let folders = fs::read_dir("/usr/lib").expect("/usr/lib can be read");
    folders
        .flatten()
        .map(|folder| folder.path().join("faketime/libfaketime.so.1"))
        .find(|library| library.exists())
        .expect("libfaketime is installed; `make setup-test` installs it")
}

#[test]
fn workers_with_wrong_clocks_run_jobs_normally() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let server = start_server(
        &reference_run,
        &server_config(&nats, file_relay.address()),
        &file_relay,
    );
    let started_at = Timestamp::now();
    let workers = [("behind", "-3600"), ("ahead", "+3600")].map(|(name, offset_s)| {
        let mut command = Command::new(program("faceoff"));
        command
            .env("LD_PRELOAD", faketime_library())
            .env("FAKETIME", offset_s)
            // Only the wall clock is wrong; the monotonic clock is right.
            .env("FAKETIME_DONT_FAKE_MONOTONIC", "1")
            .env("DONT_FAKE_MONOTONIC", "1")
            .env("FAKETIME_DISABLE_SHM", "1");
        Worker::start_with_command(
            command,
            scratch.path(),
            name,
            &worker_config(nats.address(), 1),
            &[],
        )
    });
    wait_for_workers(&server, workers.len());
    resume(&server);
    reference_run.assert_equal_result(&server);
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
