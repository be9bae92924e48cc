//! What comes of work elsewhere is what one slot of the server's own makes of it, to the bit.

use super::{Contest, EPISODES, giving, many_shards, resume, taking, wait_for_workers};
use crate::{Team, kills::copy_folder};
use async_nats::Message;
use bytes::Bytes;
use faceoff_tests::{nats::Nats, relay::Relay, repository, server::Server, worker::Worker};
use faceoff_wire::remote::{Ask, RemoteOrder};
use futures::StreamExt as _;
use std::{thread, time::Duration};
use tokio::runtime::Runtime;

/// Who plays beside whom, each with so many slots.
struct Company {
    name: &'static str,
    server: usize,
    workers: &'static [usize],
}

#[test]
fn what_others_play_is_what_one_slot_plays() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::of_many_shards(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let companies = [
        Company {
            name: "one",
            server: 0,
            workers: &[1],
        },
        Company {
            name: "two-slots",
            server: 0,
            workers: &[2],
        },
        Company {
            name: "beside-the-server",
            server: 1,
            workers: &[1, 1],
        },
        Company {
            name: "four",
            server: 0,
            workers: &[1, 1, 1, 1],
        },
    ];
    for company in companies {
        let folder = scratch.path().join(company.name);
        let data = folder.join("data");
        copy_folder(&contest.data, &data);
        let files = Relay::start();
        // Each has streams of its own.
        let named = |config: String| {
            config.replace("[nats]", &format!("[nats]\nname = \"{}\"", company.name))
        };
        let mut config = many_shards(&named(giving(&nats, files.address())));
        if company.server > 0 {
            config = config.replace("play = false", "play = true");
        }
        let server = Server::start(&data, &config);
        files.lead_to(server.address().into());
        let workers = (0..).zip(company.workers).map(|(index, slots)| {
            let config = named(taking(nats.address(), *slots));
            Worker::start(&folder, &format!("worker-{index}"), &config)
        });
        let workers: Vec<Worker> = workers.collect();
        wait_for_workers(&server, workers.len());
        resume(&server);
        contest.ends_alike(&server);
        for (worker, slots) in workers.into_iter().zip(company.workers) {
            let log = worker.log();
            for slot in 0..*slots {
                let committed = log.lines().any(|line| {
                    line.contains("committed") && line.contains(&format!("slot-{slot}"))
                });
                assert!(committed, "{}: each slot has played:\n{log}", company.name);
            }
            worker.end();
        }
        let log = server.log();
        let own = log
            .lines()
            .any(|line| line.contains("committed") && line.contains(" episodes "));
        assert_eq!(own, company.server > 0, "{}:\n{log}", company.name);
    }
}

#[test]
fn a_worker_that_has_waited_begins_the_first_order_that_it_is_sent() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = Server::start(
        &scratch.path().join("data"),
        &giving(&nats, files.address()),
    );
    files.lead_to(server.address().into());
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let runtime = Runtime::new().expect("a runtime starts");
    let client = runtime.block_on(async_nats::connect(nats.url()));
    let client = client.expect("NATS is there");
    let heard = runtime.block_on(client.subscribe("faceoff.>"));
    let mut heard = heard.expect("anyone may listen here");
    let worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    runtime.block_on(async {
        let asks = |message: &Message| message.subject.starts_with("faceoff.free.");
        while !heard.next().await.is_some_and(|message| asks(&message)) {}
    });
    // Most of the time that a request for work is open.
    thread::sleep(Duration::from_secs(3));
    let evaluation = team.evaluate(&server, &submission);
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    worker.end();
    let (mut orders, mut begun) = (Vec::new(), Vec::new());
    runtime.block_on(async {
        let over = client.publish("faceoff.over", Bytes::new());
        over.await.expect("NATS is there");
        while let Some(message) = heard.next().await {
            match message.subject.as_str() {
                "faceoff.over" => break,
                "faceoff.orders" => {
                    let order: RemoteOrder =
                        serde_json::from_slice(&message.payload).expect("it is an order");
                    orders.push(order.order.lease.nonce);
                }
                "faceoff.asks.worker" => {
                    let ask = serde_json::from_slice(&message.payload);
                    if let Ask::Begin { lease, .. } = ask.expect("it is a question") {
                        // Who is not answered soon asks again.
                        if begun.last() != Some(&lease.nonce) {
                            begun.push(lease.nonce);
                        }
                    }
                }
                _ => {}
            }
        }
    });
    assert!(orders.len() >= 3 * EPISODES as usize, "{}", orders.len());
    assert_eq!(begun, orders);
}
