//! Permissions of server and workers in the shipped configuration of NATS, the message broker between them. Messages have
//! *subjects*, which the permissions name; *streams* store messages.
//!
//! Subjects of the worker `rack-1`: `faceoff.asks.rack-1` (its requests for jobs), `faceoff.outcomes.rack-1` (its results) and
//! `faceoff.shows.rack-1` (frames of running games). `faceoff.orders` has the jobs of all workers; subjects that begin with `$JS.API`
//! administer streams, and answers to requests go to `_INBOX`.

use super::{server_config, worker_config};
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

/// Creates a key pair for NATS. Writes the secret key to the file and returns the public key.
fn create_key_pair(file: &Path) -> String {
    let output = Command::new(program("faceoff"))
        .args(["worker", "--make-key"])
        .arg(file)
        .output()
        .expect("the program can be started");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let key = String::from_utf8(output.stdout).expect("a key is text");
    key.trim().to_owned()
}

#[test]
fn shipped_permissions_allow_only_what_workers_need() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let [server_key, worker_key, unknown_key] =
        ["server.nk", "rack-1.nk", "unknown.nk"].map(|name| scratch.path().join(name));
    let shipped_config = fs::read_to_string(repository().join("docker/nats/nats-server.conf"))
        .expect("it is shipped");
    // The test sets another address and folder, and the public keys.
    let config = shipped_config
        .replace("listen: \"0.0.0.0:4222\"", "")
        .replace("store_dir: \"/var/lib/nats\"", "")
        .replace("KEY_OF_THE_SERVER", &create_key_pair(&server_key))
        .replace("KEY_OF_RACK_1", &create_key_pair(&worker_key));
    let nats = Nats::start_with_config(&scratch.path().join("nats"), &config);
    let file_relay = Relay::start();
    let with_key =
        |config: String, key: &Path| format!("{config}nkey_file = \"{}\"\n", key.display());
    let config = with_key(server_config(&nats, file_relay.address()), &server_key);
    let server = Server::start(&scratch.path().join("data"), &config);
    file_relay.set_target(server.address().into());
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let worker = |name, key: &Path| {
        Worker::start(
            scratch.path(),
            name,
            &with_key(worker_config(nats.address(), 1), key),
        )
    };
    let _ = create_key_pair(&unknown_key);
    let unknown = worker("unknown", &unknown_key);
    unknown.wait_for_log("authorization violation", 1);
    let rack = worker("rack-1", &worker_key);
    let finished = team.wait_until_finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    assert!(rack.log().contains("committed"));
    assert!(!unknown.log().contains("started job="), "{}", unknown.log());
    drop(rack);

    // The server's key may read results from the stream, which is empty by now.
    let secret_key = fs::read_to_string(&server_key).expect("it was written");
    let runtime = Runtime::new().expect("a runtime starts");
    runtime.block_on(async {
        let client = ConnectOptions::with_nkey(secret_key.trim().to_owned())
            .custom_inbox_prefix("_INBOX.faceoff.server")
            .connect(nats.url())
            .await
            .expect("NATS accepts the key");
        let jetstream = jetstream::new(client);
        let stream = jetstream.get_stream_no_info("faceoff-outcomes").await;
        let found = stream.expect("it has a name").get_raw_message(1).await;
        let kind = found.expect_err("the result was accepted before").kind();
        assert_eq!(kind, RawMessageErrorKind::NoMessageFound);
    });

    // A worker's key does not allow the subjects of other workers, of the server, or for the administration of streams.
    let secret_key = fs::read_to_string(&worker_key).expect("it was written");
    runtime.block_on(async {
        let (sender, errors) = mpsc::channel();
        let client = ConnectOptions::with_nkey(secret_key.trim().to_owned())
            .event_callback(move |event| {
                let sender = sender.clone();
                async move {
                    if let Event::ServerError(error) = event {
                        // The test may have ended.
                        let _ = sender.send(error.to_string());
                    }
                }
            })
            .connect(nats.url())
            .await
            .expect("NATS accepts the key");
        let forbidden_subjects = [
            "faceoff.asks.rack-2",
            "faceoff.outcomes.rack-2",
            "faceoff.orders",
            "$JS.API.STREAM.INFO.faceoff-orders",
            "$JS.API.STREAM.MSG.GET.faceoff-orders",
            "$JS.API.CONSUMER.MSG.NEXT.faceoff-outcomes.server",
        ];
        for subject in forbidden_subjects {
            client
                .publish(subject, "".into())
                .await
                .expect("it is sent");
            client.flush().await.expect("it is sent");
            let refusal = errors.recv().expect("NATS answers");
            assert!(
                refusal
                    .to_lowercase()
                    .contains("permissions violation for publish"),
                "{refusal}"
            );
            assert!(refusal.contains(subject), "{refusal}");
        }
        for subject in [">", "faceoff.>", "_INBOX.>", "faceoff.shows.rack-1"] {
            let _subscribed = client.subscribe(subject).await.expect("it is sent");
            client.flush().await.expect("it is sent");
            let refusal = errors.recv().expect("NATS answers");
            assert!(
                refusal
                    .to_lowercase()
                    .contains("permissions violation for subscription"),
                "{refusal}"
            );
        }
    });
}
