//! Results of remote workers equal those of one local slot, bit for bit. A *slot* is the place in a process for one running job.

use super::{
    EPISODES, ReferenceRun, many_shards, resume, server_config, wait_for_workers, worker_config,
};
use crate::Team;
use async_nats::Message;
use bytes::Bytes;
use faceoff_tests::{
    bundle::copy_folder, nats::Nats, relay::Relay, repository, server::Server, worker::Worker,
};
use faceoff_wire::remote::{RemoteJob, WorkerRequest};
use futures::StreamExt as _;
use std::{thread, time::Duration};
use tokio::runtime::Runtime;

struct Setup {
    name: &'static str,
    /// The server has one slot. It always validates and scores; it also runs shards if this is set.
    server_runs_shards: bool,
    /// The number of slots of each worker.
    worker_slots: &'static [usize],
}

#[test]
fn remote_results_equal_local_results() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare_many_shards(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let setups = [
        Setup {
            name: "one-worker",
            server_runs_shards: false,
            worker_slots: &[1],
        },
        Setup {
            name: "one-worker-with-two-slots",
            server_runs_shards: false,
            worker_slots: &[2],
        },
        Setup {
            name: "two-workers-and-server",
            server_runs_shards: true,
            worker_slots: &[1, 1],
        },
        Setup {
            name: "four-workers",
            server_runs_shards: false,
            worker_slots: &[1, 1, 1, 1],
        },
    ];
    for setup in setups {
        let folder = scratch.path().join(setup.name);
        let data_dir = folder.join("data");
        copy_folder(&reference_run.data_dir, &data_dir);
        let file_relay = Relay::start();
        // All setups share one NATS server; each has its own streams there, which the setting `name` distinguishes.
        let with_name = |config: String| {
            config.replace("[nats]", &format!("[nats]\nname = \"{}\"", setup.name))
        };
        let mut config = many_shards(&with_name(server_config(&nats, file_relay.address())));
        if setup.server_runs_shards {
            // `play`: whether the server's own slot runs shards and games.
            config = config.replace("play = false", "play = true");
        }
        let server = Server::start(&data_dir, &config);
        file_relay.set_target(server.address().into());
        let workers = (0..).zip(setup.worker_slots).map(|(index, slots)| {
            let config = with_name(worker_config(nats.address(), *slots));
            Worker::start(&folder, &format!("worker-{index}"), &config)
        });
        let workers: Vec<Worker> = workers.collect();
        wait_for_workers(&server, &workers);
        resume(&server);
        reference_run.assert_equal_result(&server);
        for (worker, slots) in workers.into_iter().zip(setup.worker_slots) {
            let log = worker.log();
            for slot in 0..*slots {
                let committed = log.lines().any(|line| {
                    line.contains("committed") && line.contains(&format!("slot-{slot}"))
                });
                assert!(
                    committed,
                    "{}: slot {slot} has run no job:\n{log}",
                    setup.name
                );
            }
            worker.stop();
        }
        let log = server.log();
        let has_local_episodes = log
            .lines()
            .any(|line| line.contains("committed") && line.contains(" episodes "));
        assert_eq!(
            has_local_episodes, setup.server_runs_shards,
            "{}:\n{log}",
            setup.name
        );
    }
}

/// The subject of a message that the test sends to itself after all others, so that it knows their end.
const END_SUBJECT: &str = "faceoff.over";

#[test]
fn idle_worker_starts_the_first_job_it_receives() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let server = Server::start(
        &scratch.path().join("data"),
        &server_config(&nats, file_relay.address()),
    );
    file_relay.set_target(server.address().into());
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let runtime = Runtime::new().expect("a runtime starts");
    let client = runtime.block_on(async_nats::connect(nats.url()));
    let client = client.expect("NATS is there");
    let messages = runtime.block_on(client.subscribe("faceoff.>"));
    let mut messages = messages.expect("the test may subscribe");
    let worker = Worker::start(scratch.path(), "worker", &worker_config(nats.address(), 1));
    runtime.block_on(async {
        let is_job_request = |message: &Message| message.subject.starts_with("faceoff.free.");
        while !messages
            .next()
            .await
            .is_some_and(|message| is_job_request(&message))
        {}
    });
    // The job is published near the end of the time that a request for a job stays open.
    thread::sleep(Duration::from_secs(3));
    let evaluation = team.evaluate(&server, &submission);
    let finished = team.wait_until_finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    worker.stop();
    // The nonce is the random part of a lease, which is the right to run a job once.
    let (mut published_nonces, mut started_nonces) = (Vec::new(), Vec::new());
    runtime.block_on(async {
        let end_marker = client.publish(END_SUBJECT, Bytes::new());
        end_marker.await.expect("NATS is there");
        while let Some(message) = messages.next().await {
            match message.subject.as_str() {
                END_SUBJECT => break,
                // Jobs that the server publishes.
                "faceoff.orders" => {
                    let job: RemoteJob =
                        serde_json::from_slice(&message.payload).expect("it is a job");
                    published_nonces.push(job.job.lease.nonce);
                }
                // Requests of the worker named `worker`.
                "faceoff.asks.worker" => {
                    let request = serde_json::from_slice(&message.payload);
                    if let WorkerRequest::StartJob { lease, .. } = request.expect("it is a request")
                    {
                        // A worker repeats a request that is not answered soon.
                        if started_nonces.last() != Some(&lease.nonce) {
                            started_nonces.push(lease.nonce);
                        }
                    }
                }
                _ => {}
            }
        }
    });
    assert!(
        published_nonces.len() >= 3 * EPISODES as usize,
        "{}",
        published_nonces.len()
    );
    assert_eq!(started_nonces, published_nonces);
}
