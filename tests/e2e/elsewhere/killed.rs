//! Everything that can be killed, at drawn moments.

use super::{Contest, giving, many_shards, resume, taking};
use crate::kills::draw;
use faceoff_tests::{nats::Nats, relay::Relay, server::Server, worker::Worker};
use std::time::Duration;

/// Three times as many as there are ends are less than there are shards.
const SHARDS_BETWEEN: u64 = 3;

/// What ends, without a word.
#[derive(Debug, Clone, Copy)]
enum Ends {
    Worker,
    Server,
    Nats,
    /// It, and all that it had stored: streams, orders, outcomes.
    NatsAndStreams,
    /// It, and what was in its streams.
    NatsAndMessages,
    Link,
}

#[test]
#[expect(
    clippy::print_stdout,
    reason = "by its seed a run that failed is repeated"
)]
fn whoever_is_killed_or_cut_off_nothing_is_lost_and_nothing_done_twice() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::of_many_shards(scratch.path());
    let mut nats = Nats::start(&scratch.path().join("nats"));
    let nats_address = nats.address();
    let (files, link) = (Relay::start(), Relay::start());
    link.lead_to(nats_address);
    let config = many_shards(&giving(&nats, files.address()));
    let mut server = Server::start(&contest.data, &config);
    files.lead_to(server.address().into());
    let killed = || Worker::start(scratch.path(), "killed", &taking(nats_address, 1));
    let mut mortal = killed();
    let _stays = Worker::start(scratch.path(), "stays", &taking(link.address(), 1));
    resume(&server);

    // Who is killed when is drawn: in which order, each after some shards, and how far into the next.
    let seed = std::env::var("KILL_SEED")
        .ok()
        .and_then(|seed| seed.parse().ok());
    let seed: u64 = seed.unwrap_or_else(|| {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        now.expect("the clock is right").as_secs()
    });
    println!("KILL_SEED={seed}");
    let mut draws = (seed << 20..).map(draw);
    let mut drawn = || draws.next().unwrap_or_default();
    let mut ends = [
        Ends::Worker,
        Ends::Worker,
        Ends::Server,
        Ends::Server,
        Ends::Nats,
        Ends::NatsAndStreams,
        Ends::NatsAndMessages,
        Ends::Link,
    ]
    .map(|end| (drawn(), end));
    ends.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    for (number, (_, end)) in (1..).zip(ends) {
        let _ = server.poll(&contest.evaluation, &contest.team.token, |told| {
            let done = told["progress"]["episodes_done"].as_u64();
            // Without progress it is over already.
            done.is_none_or(|done| done >= SHARDS_BETWEEN * number)
        });
        std::thread::sleep(Duration::from_secs_f64(drawn()));
        match end {
            Ends::Worker => {
                drop(mortal);
                mortal = killed();
            }
            // It comes back at another place, to which the same address leads.
            Ends::Server => {
                server.kill();
                server = Server::start(&contest.data, &config);
                files.lead_to(server.address().into());
            }
            Ends::Nats => nats.kill_and_start(),
            Ends::NatsAndStreams => nats.lose_all_and_start(),
            Ends::NatsAndMessages => nats.lose_messages_and_start(),
            // For longer than nothing, and then it is a slow one.
            Ends::Link => {
                link.cut();
                std::thread::sleep(Duration::from_secs_f64(3.0 * drawn()));
                link.lead_to(nats_address);
                link.delay(Duration::from_millis(200));
            }
        }
    }
    contest.ends_alike(&server);
}
