//! Results of remote workers equal those of one local slot, bit for bit.

use super::{
    EPISODES, ReferenceRun, many_shards, resume, server_config, wait_for_workers, worker_config,
};
use crate::{Team, kills::copy_folder};
use async_nats::Message;
use bytes::Bytes;
use faceoff_tests::{nats::Nats, relay::Relay, repository, server::Server, worker::Worker};
use faceoff_wire::remote::{RemoteJob, WorkerRequest};
use futures::StreamExt as _;
use std::{thread, time::Duration};
use tokio::runtime::Runtime;

/// Numbers of slots: of the server, and of each worker.
struct Setup {
    name: &'static str,
    server: usize,
    workers: &'static [usize],
}

#[test]
fn remote_results_equal_local_results() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare_many_shards(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let setups = [
        Setup {
            name: "one",
            server: 0,
            workers: &[1],
        },
        Setup {
            name: "two-slots",
            server: 0,
            workers: &[2],
        },
        Setup {
            name: "beside-the-server",
            server: 1,
            workers: &[1, 1],
        },
        Setup {
            name: "four",
            server: 0,
            workers: &[1, 1, 1, 1],
        },
    ];
    for setup in setups {
        let folder = scratch.path().join(setup.name);
        let data = folder.join("data");
        copy_folder(&reference_run.data, &data);
        let files = Relay::start();
        // Each setup has separate streams.
        let with_name = |config: String| {
            config.replace("[nats]", &format!("[nats]\nname = \"{}\"", setup.name))
        };
        let mut config = many_shards(&with_name(server_config(&nats, files.address())));
        if setup.server > 0 {
            config = config.replace("play = false", "play = true");
        }
        let server = Server::start(&data, &config);
        files.set_target(server.address().into());
        let workers = (0..).zip(setup.workers).map(|(index, slots)| {
            let config = with_name(worker_config(nats.address(), *slots));
            Worker::start(&folder, &format!("worker-{index}"), &config)
        });
        let workers: Vec<Worker> = workers.collect();
        wait_for_workers(&server, workers.len());
        resume(&server);
        reference_run.assert_equal_result(&server);
        for (worker, slots) in workers.into_iter().zip(setup.workers) {
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
            has_local_episodes,
            setup.server > 0,
            "{}:\n{log}",
            setup.name
        );
    }
}

#[test]
fn idle_worker_starts_the_first_job_it_receives() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = Server::start(
        &scratch.path().join("data"),
        &server_config(&nats, files.address()),
    );
    files.set_target(server.address().into());
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
    // Most of the time that a request for a job stays open.
    thread::sleep(Duration::from_secs(3));
    let evaluation = team.evaluate(&server, &submission);
    let finished = team.wait_until_finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    worker.stop();
    let (mut published, mut started) = (Vec::new(), Vec::new());
    runtime.block_on(async {
        let end_marker = client.publish("faceoff.over", Bytes::new());
        end_marker.await.expect("NATS is there");
        while let Some(message) = messages.next().await {
            match message.subject.as_str() {
                "faceoff.over" => break,
                "faceoff.orders" => {
                    let job: RemoteJob =
                        serde_json::from_slice(&message.payload).expect("it is a job");
                    published.push(job.job.lease.nonce);
                }
                "faceoff.asks.worker" => {
                    let request = serde_json::from_slice(&message.payload);
                    if let WorkerRequest::StartJob { lease, .. } = request.expect("it is a request")
                    {
                        // A worker repeats a request that is not answered soon.
                        if started.last() != Some(&lease.nonce) {
                            started.push(lease.nonce);
                        }
                    }
                }
                _ => {}
            }
        }
    });
    assert!(
        published.len() >= 3 * EPISODES as usize,
        "{}",
        published.len()
    );
    assert_eq!(started, published);
}
