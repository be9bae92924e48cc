//! Bundles and recordings in an S3 bucket instead of the server's HTTP transfer.

use super::{ReferenceRun, resume, server_config, worker_config};
use faceoff_tests::{bucket::Bucket, nats::Nats, relay::Relay, server::Server, worker::Worker};

#[test]
fn bucket_transfers_files_without_route_to_server() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let (nats, bucket) = (Nats::start(&scratch.path().join("nats")), Bucket::start());
    // No server is behind the address for files, and at first none behind that of the bucket.
    let (files, link) = (Relay::start(), Relay::start());
    let config =
        server_config(&nats, files.address()) + &format!("bucket = \"{}\"\n", bucket.url());
    let environment = Bucket::environment(link.address());
    let server = Server::start_with_environment(&reference_run.data, &config, &environment);
    let worker = Worker::start(scratch.path(), "worker", &worker_config(nats.address(), 1));
    resume(&server);
    server.wait_for_log("reaching the bucket", 1);
    assert!(!worker.log().contains("started job="), "{}", worker.log());
    link.set_target(bucket.address());

    reference_run.assert_equal_result(&server);
    // Accepted recordings are removed from the bucket; the bundle stays for later jobs.
    let keys = bucket.keys();
    assert_eq!(keys.len(), 1, "{keys:?}");
    assert!(keys[0].starts_with("of/season/bundles/"), "{keys:?}");
    // The signed links give access without a token, so logs must not contain them.
    for log in [worker.log(), server.log()] {
        assert!(!log.contains("X-Amz-Signature"), "{log}");
    }
    worker.stop();
}
