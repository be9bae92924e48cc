//! Bundles and recordings by a bucket of S3, in the place of the server's own HTTP.

use super::{Contest, giving, resume, taking};
use faceoff_tests::{bucket::Bucket, nats::Nats, relay::Relay, server::Server, worker::Worker};

#[test]
fn files_pass_by_a_bucket_and_a_worker_needs_no_way_to_the_server() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let (nats, bucket) = (Nats::start(&scratch.path().join("nats")), Bucket::start());
    // Nobody is where the server's files would be, and at first nobody is where the bucket is.
    let (files, link) = (Relay::start(), Relay::start());
    let config = giving(&nats, files.address()) + &format!("bucket = \"{}\"\n", bucket.url());
    let environment = Bucket::environment(link.address());
    let server = Server::start_with_environment(&contest.data, &config, &environment);
    let worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    resume(&server);
    server.wait_for_log("asking for the bucket", 1);
    assert!(!worker.log().contains("begun"), "{}", worker.log());
    link.lead_to(bucket.address());

    contest.ends_alike(&server);
    // What was taken over is not left there; the bundle is, for the next order.
    let keys = bucket.keys();
    assert_eq!(keys.len(), 1, "{keys:?}");
    assert!(keys[0].starts_with("of/ours/bundles/"), "{keys:?}");
    // The links open files by themselves, so no log tells them.
    for log in [worker.log(), server.log()] {
        assert!(!log.contains("X-Amz-Signature"), "{log}");
    }
    worker.end();
}
