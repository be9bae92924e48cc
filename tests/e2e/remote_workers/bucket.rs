//! Transfer of bundles (agents) and recordings (of episodes) through an S3 bucket, instead of HTTP requests of the workers to
//! the server.

use super::{ReferenceRun, resume, server_config, worker_config};
use faceoff_tests::{bucket::Bucket, nats::Nats, relay::Relay, server::Server, worker::Worker};

#[test]
fn bucket_transfers_files_without_route_to_server() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let (nats, bucket) = (Nats::start(&scratch.path().join("nats")), Bucket::start());
    // The relay for files stays without a target. The relay for the bucket gets its target later.
    let (file_relay, bucket_relay) = (Relay::start(), Relay::start());
    let config =
        server_config(&nats, file_relay.address()) + &format!("bucket = \"{}\"\n", bucket.url());
    let environment = Bucket::environment(bucket_relay.address());
    let server = Server::start_with_environment(&reference_run.data_dir, &config, &environment);
    let worker = Worker::start(scratch.path(), "worker", &worker_config(nats.address(), 1));
    resume(&server);
    server.wait_for_log("reaching the bucket", 1);
    assert!(!worker.log().contains("started job="), "{}", worker.log());
    bucket_relay.set_target(bucket.address());

    reference_run.assert_equal_result(&server);
    // Accepted recordings are removed from the bucket; the bundle stays for later jobs.
    let keys = bucket.keys();
    assert_eq!(keys.len(), 1, "{keys:?}");
    let bundles = format!("{}/bundles/", Bucket::PREFIX);
    assert!(keys[0].starts_with(&bundles), "{keys:?}");
    // The signed links give access without a token, so logs must not contain them.
    for log in [worker.log(), server.log()] {
        assert!(!log.contains("X-Amz-Signature"), "{log}");
    }
    worker.stop();
}
