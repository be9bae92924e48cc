//! Who may do what, by the configuration of NATS that is shipped.

use super::{giving, taking};
use crate::Team;
use async_nats::{
    ConnectOptions, Event,
    jetstream::{self, stream::RawMessageErrorKind},
};
use faceoff_tests::{
    nats::Nats, program, relay::Relay, repository, server::Server, worker::Worker,
};
use std::{fs, path::Path, process::Command, sync::mpsc};
use tokio::runtime::Runtime;

/// A key for NATS: its public half; the secret one is in the file.
fn key(file: &Path) -> String {
    let made = Command::new(program("faceoff"))
        .args(["worker", "--make-key"])
        .arg(file)
        .output()
        .expect("the program can be started");
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let key = String::from_utf8(made.stdout).expect("a key is text");
    key.trim().to_owned()
}

#[test]
fn by_the_shipped_permissions_a_worker_works_and_may_do_nothing_else() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let [of_server, of_worker, of_stranger] =
        ["server.nk", "rack-1.nk", "stranger.nk"].map(|name| scratch.path().join(name));
    let shipped = fs::read_to_string(repository().join("docker/nats/nats-server.conf"))
        .expect("it is shipped");
    // Port and folder are the test's.
    let config = shipped
        .replace("listen: \"0.0.0.0:4222\"", "")
        .replace("store_dir: \"/var/lib/nats\"", "")
        .replace("KEY_OF_THE_SERVER", &key(&of_server))
        .replace("KEY_OF_RACK_1", &key(&of_worker));
    let nats = Nats::configured(&scratch.path().join("nats"), &config);
    let files = Relay::start();
    let by = |config: String, key: &Path| format!("{config}nkey_file = \"{}\"\n", key.display());
    let config = by(giving(&nats, files.address()), &of_server);
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let worker =
        |name, key: &Path| Worker::start(scratch.path(), name, &by(taking(nats.address(), 1), key));
    let _ = key(&of_stranger);
    let stranger = worker("stranger", &of_stranger);
    stranger.wait_for_log("authorization violation", 1);
    let rack = worker("rack-1", &of_worker);
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    assert!(rack.log().contains("committed"));
    assert!(!stranger.log().contains("begun"), "{}", stranger.log());
    drop(rack);

    // The server may look for an outcome that waits for it, as it does of none here.
    let seed = fs::read_to_string(&of_server).expect("it was written");
    let runtime = Runtime::new().expect("a runtime starts");
    runtime.block_on(async {
        let client = ConnectOptions::with_nkey(seed.trim().to_owned())
            .custom_inbox_prefix("_INBOX.faceoff.server")
            .connect(nats.url())
            .await
            .expect("it is known");
        let jetstream = jetstream::new(client);
        let stream = jetstream.get_stream_no_info("faceoff-outcomes").await;
        let found = stream.expect("it has a name").get_raw_message(1).await;
        let kind = found.expect_err("it was taken in").kind();
        assert_eq!(kind, RawMessageErrorKind::NoMessageFound);
    });

    // With the worker's own key, what is somebody else's is refused.
    let seed = fs::read_to_string(&of_worker).expect("it was written");
    runtime.block_on(async {
        let (tell, told) = mpsc::channel();
        let client = ConnectOptions::with_nkey(seed.trim().to_owned())
            .event_callback(move |event| {
                let tell = tell.clone();
                async move {
                    if let Event::ServerError(error) = event {
                        // The test may be over.
                        let _ = tell.send(error.to_string());
                    }
                }
            })
            .connect(nats.url())
            .await
            .expect("it is known");
        let forbidden = [
            "faceoff.asks.rack-2",
            "faceoff.outcomes.rack-2",
            "faceoff.orders",
            "$JS.API.STREAM.INFO.faceoff-orders",
            "$JS.API.STREAM.MSG.GET.faceoff-orders",
            "$JS.API.CONSUMER.MSG.NEXT.faceoff-outcomes.server",
        ];
        for subject in forbidden {
            client
                .publish(subject, "".into())
                .await
                .expect("it is sent");
            client.flush().await.expect("it is sent");
            let refused = told.recv().expect("NATS answers");
            assert!(
                refused
                    .to_lowercase()
                    .contains("permissions violation for publish"),
                "{refused}"
            );
            assert!(refused.contains(subject), "{refused}");
        }
        for subject in [">", "faceoff.>", "_INBOX.>", "faceoff.shows.rack-1"] {
            let _subscribed = client.subscribe(subject).await.expect("it is sent");
            client.flush().await.expect("it is sent");
            let refused = told.recv().expect("NATS answers");
            assert!(
                refused
                    .to_lowercase()
                    .contains("permissions violation for subscription"),
                "{refused}"
            );
        }
    });
}
