//! Ablations on remote workers: results and clips equal those of a run on the server itself. An *ablation* plays the same
//! episodes in several *profiles*: the ideal simulator, and the simulator with each perturbation, such as noise. A *clip* is the
//! recorded motion of an episode; only episodes whose outcome differs from that in the ideal simulator have one.

use super::{local_config, resume, server_config, worker_config};
use crate::{Team, commands::admin};
use bytes::Bytes;
use faceoff_tests::{
    bundle::{self, copy_folder},
    nats::Nats,
    relay::Relay,
    server::Server,
    worker::Worker,
};
use serde_json::{Value, json};
use std::{path::Path, thread, time::Duration};

/// Episodes of each task in each profile.
const EPISODES: u32 = 4;

/// Waits for the end of an ablation. Returns its result without non-reproducible parts, and its clips by profile, task and
/// episode; `None` for an episode without a clip.
fn wait_for_result(
    server: Server,
    (data_dir, config): (&Path, &str),
    submission: &str,
) -> (Value, Vec<Option<Bytes>>) {
    let path = format!("/api/v1/submissions/{submission}/ablation");
    let mut view = server.poll(&path, &server.admin_token, |view| view["state"] != "open");
    assert_eq!(view["state"], "finished", "{view:#}");
    let _ = view["finished_at"].take();
    let mut clip_keys = Vec::new();
    let mut different_outcomes = 0;
    let tasks = view["tasks"].as_object_mut().expect("it has tasks");
    for (task, profiles) in tasks {
        for effect in profiles.as_array_mut().expect("a list of profiles") {
            // Penalty points depend on computation times. `lost` and `gained` count the episodes that fail or succeed other than in the
            // ideal simulator.
            let _ = effect["penalty_points"].take();
            different_outcomes += effect["lost"]
                .as_u64()
                .zip(effect["gained"].as_u64())
                .map_or(0, |(lost, gained)| lost + gained);
            let profile = effect["profile"]
                .as_str()
                .expect("an effect names its profile");
            clip_keys.extend((0..EPISODES).map(|episode| format!("{profile}/{task}/{episode}")));
        }
    }
    assert!(
        different_outcomes > 0,
        "no episode ends differently than in the ideal simulator: {view:#}"
    );
    // The server merges clips of single shards periodically and when it starts. It merges those of the ideal profile last.
    server.kill();
    let server = Server::start(data_dir, config);
    let clip = |key: &String| {
        let response = server.get(&format!("{path}/{key}/motion"), Some(&server.admin_token));
        match response.status().as_u16() {
            200 => Some(response.bytes().expect("the download completes")),
            // The episode ended as in the ideal simulator.
            404 => None,
            status => panic!("{key}: {status}"),
        }
    };
    let ideal_keys = || clip_keys.iter().filter(|key| key.starts_with("ideal/"));
    while ideal_keys().all(|key| clip(key).is_none()) {
        thread::sleep(Duration::from_millis(100));
    }
    let clips = clip_keys.iter().map(clip).collect();
    (view, clips)
}

#[test]
fn remote_ablation_equals_local_ablation() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let [data_dir, local_data_dir] = ["data", "local"].map(|name| scratch.path().join(name));
    let server = Server::start(&data_dir, &local_config());
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &bundle::example_agent("striker", scratch.path()));
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let submission = submission["id"].as_str().expect("it has an id");
    let pause = json!({ "reason": "Until the workers are connected" });
    let paused = server.post("/api/v1/queue/pause", &server.admin_token, &pause);
    assert!(paused.status().is_success(), "{}", paused.status());
    let episodes = EPISODES.to_string();
    let request = ["order-ablation", submission, "--episodes", &episodes];
    let _ = admin(&server, &request).expect_success();
    server.kill();
    copy_folder(&data_dir, &local_data_dir);

    let config = local_config();
    let server = Server::start(&local_data_dir, &config);
    resume(&server);
    let (expected_result, expected_clips) =
        wait_for_result(server, (&local_data_dir, &config), submission);

    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let config = server_config(&nats, file_relay.address());
    let server = Server::start(&data_dir, &config);
    file_relay.set_target(server.address().into());
    let worker = Worker::start(scratch.path(), "worker", &worker_config(nats.address(), 1));
    resume(&server);
    let (result, clips) = wait_for_result(server, (&data_dir, &config), submission);
    assert_eq!(result, expected_result);
    assert!(clips == expected_clips, "the clips differ");
    assert!(worker.log().contains("committed"), "{}", worker.log());
    worker.stop();
}
