//! Workers, the server and the message broker NATS are killed, and network connections are cut, at random moments of an
//! evaluation. Its result does not change.

use super::{ReferenceRun, many_shards, resume, server_config, worker_config};
use crate::kills::draw;
use faceoff_tests::{nats::Nats, relay::Relay, server::Server, worker::Worker};
use std::time::Duration;

/// Committed shards (jobs of one episode each) between two faults: few enough that all faults fit into the evaluation.
const SHARDS_BETWEEN_FAULTS: u64 = 3;

/// What is killed or cut.
#[derive(Debug, Clone, Copy)]
enum Fault {
    Worker,
    Server,
    Nats,
    /// NATS loses its streams, with jobs and results.
    NatsAndStreams,
    /// NATS keeps its streams and loses their messages.
    NatsAndMessages,
    /// The connection of a worker to NATS.
    WorkerConnection,
}

#[test]
#[expect(clippy::print_stdout, reason = "the seed repeats a failed run")]
fn random_kills_and_cuts_lose_and_repeat_no_result() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare_many_shards(scratch.path());
    let mut nats = Nats::start(&scratch.path().join("nats"));
    let nats_address = nats.address();
    let (file_relay, nats_relay) = (Relay::start(), Relay::start());
    nats_relay.set_target(nats_address);
    let config = many_shards(&server_config(&nats, file_relay.address()));
    let mut server = Server::start(&reference_run.data_dir, &config);
    file_relay.set_target(server.address().into());
    let start_killed_worker =
        || Worker::start(scratch.path(), "killed", &worker_config(nats_address, 1));
    let mut killed_worker = start_killed_worker();
    let _other_worker = Worker::start(
        scratch.path(),
        "other",
        &worker_config(nats_relay.address(), 1),
    );
    resume(&server);

    // Order and moments of the faults are drawn: each after some shards, and some time into the next.
    let seed = std::env::var("KILL_SEED")
        .ok()
        .and_then(|seed| seed.parse().ok());
    let seed: u64 = seed.unwrap_or_else(|| {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        now.expect("the clock is right").as_secs()
    });
    println!("KILL_SEED={seed}");
    // Numbers in [0, 1).
    let mut draws = (seed << 20..).map(draw);
    let mut next_draw = || draws.next().unwrap_or_default();
    let mut faults = [
        Fault::Worker,
        Fault::Worker,
        Fault::Server,
        Fault::Server,
        Fault::Nats,
        Fault::NatsAndStreams,
        Fault::NatsAndMessages,
        Fault::WorkerConnection,
    ]
    .map(|fault| (next_draw(), fault));
    faults.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    for (number, (_, fault)) in (1..).zip(faults) {
        let _ = server.poll(&reference_run.evaluation, &server.admin_token, |view| {
            let done = view["progress"]["episodes_done"].as_u64();
            // A finished evaluation has no progress.
            done.is_none_or(|done| done >= SHARDS_BETWEEN_FAULTS * number)
        });
        std::thread::sleep(Duration::from_secs_f64(next_draw()));
        match fault {
            Fault::Worker => {
                drop(killed_worker);
                killed_worker = start_killed_worker();
            }
            // The new server has another port; the relay's address stays the same.
            Fault::Server => {
                server.kill();
                server = Server::start(&reference_run.data_dir, &config);
                file_relay.set_target(server.address().into());
            }
            Fault::Nats => nats.kill_and_restart(),
            Fault::NatsAndStreams => nats.lose_streams_and_restart(),
            Fault::NatsAndMessages => nats.lose_messages_and_restart(),
            // The connection is cut for some time, and slow afterwards.
            Fault::WorkerConnection => {
                nats_relay.disconnect();
                std::thread::sleep(Duration::from_secs_f64(3.0 * next_draw()));
                nats_relay.set_target(nats_address);
                nats_relay.set_delay(Duration::from_millis(200));
            }
        }
    }
    reference_run.assert_equal_result(&server);
}
