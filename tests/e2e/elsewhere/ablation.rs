//! Ablations, of which clips are kept and no recordings, are played elsewhere as by a slot of the server's own.

use super::{alone, giving, resume, taking};
use crate::{Team, commands::admin, kills::copy_folder};
use bytes::Bytes;
use faceoff_tests::{bundle, nats::Nats, relay::Relay, server::Server, worker::Worker};
use serde_json::{Value, json};
use std::{path::Path, thread, time::Duration};

/// Of each task in each profile.
const EPISODES: u32 = 4;

/// How an ablation ends on a server, without what no run can repeat, and all its clips: by profile, task and episode, `None` where there
/// is none.
fn ended(
    server: Server,
    (data, config): (&Path, &str),
    submission: &str,
) -> (Value, Vec<Option<Bytes>>) {
    let path = format!("/api/v1/submissions/{submission}/ablation");
    let mut told = server.poll(&path, &server.admin_token, |told| told["state"] != "open");
    assert_eq!(told["state"], "finished", "{told:#}");
    let _ = told["finished_at"].take();
    let mut keys = Vec::new();
    let mut differ = 0;
    let tasks = told["tasks"].as_object_mut().expect("it has tasks");
    for (task, profiles) in tasks {
        for effect in profiles.as_array_mut().expect("of each profile") {
            // Times have their part in it.
            let _ = effect["penalty_points"].take();
            differ += effect["lost"]
                .as_u64()
                .zip(effect["gained"].as_u64())
                .map_or(0, |(a, b)| a + b);
            let profile = effect["profile"].as_str().expect("it names it");
            keys.extend((0..EPISODES).map(|episode| format!("{profile}/{task}/{episode}")));
        }
    }
    assert!(
        differ > 0,
        "an episode ends otherwise than in the ideal simulator: {told:#}"
    );
    // Clips are joined from time to time, and at the start; the ideal simulator's come last.
    server.kill();
    let server = Server::start(data, config);
    let clip = |key: &String| {
        let clip = server.get(&format!("{path}/{key}/motion"), Some(&server.admin_token));
        match clip.status().as_u16() {
            200 => Some(clip.bytes().expect("the answer is whole")),
            // It ended as in the ideal simulator.
            404 => None,
            status => panic!("{key}: {status}"),
        }
    };
    let ideal = || keys.iter().filter(|key| key.starts_with("ideal/"));
    while ideal().all(|key| clip(key).is_none()) {
        thread::sleep(Duration::from_millis(100));
    }
    let clips = keys.iter().map(clip).collect();
    (told, clips)
}

#[test]
fn an_ablation_that_is_played_elsewhere_ends_as_one_here() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let [data, calm] = ["data", "calm"].map(|name| scratch.path().join(name));
    let server = Server::start(&data, &alone());
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &bundle::reference("striker", scratch.path()));
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let submission = submission["id"].as_str().expect("it has an id");
    let pause = json!({ "reason": "Until all are there" });
    let paused = server.post("/api/v1/queue/pause", &server.admin_token, &pause);
    assert!(paused.status().is_success(), "{}", paused.status());
    let episodes = EPISODES.to_string();
    let order = ["order-ablation", submission, "--episodes", &episodes];
    let _ = admin(&server, &order).done();
    server.kill();
    copy_folder(&data, &calm);

    let config = alone();
    let server = Server::start(&calm, &config);
    resume(&server);
    let expected = ended(server, (&calm, &config), submission);

    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let config = giving(&nats, files.address());
    let server = Server::start(&data, &config);
    files.lead_to(server.address().into());
    let worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    resume(&server);
    let found = ended(server, (&data, &config), submission);
    assert_eq!(found.0, expected.0);
    assert!(found.1 == expected.1, "its clips are others");
    assert!(worker.log().contains("committed"), "{}", worker.log());
    worker.end();
}
