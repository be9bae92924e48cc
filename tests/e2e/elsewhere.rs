//! Work on other machines, by a real NATS: real workers, links that are cut, and everything that can be killed.

mod ablation;
mod alike;
mod allowed;
mod bucket;
mod ends;
mod killed;
mod lies;
mod streams;
mod trouble;
mod unlike;

use crate::{
    Team,
    kills::{Archive, assert_same, copy_folder, outcome},
    path_of, start_day,
};
use faceoff_tests::{bundle, nats::Nats, relay::Relay, server::Server};
use serde_json::{Value, json};
use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
};

/// Of each task, each a shard.
const EPISODES: u32 = 4;
/// Where many shards are to be handed out, or much is to happen between them: see [`many_shards`].
const MANY_EPISODES: u32 = 10;

const COMMON: &str = concat!(
    include_str!("../patient.toml"),
    r#"
[evaluation]
episodes_per_task = 4
episodes_per_shard = 1
[sandbox]
resident_bytes = 0
"#
);

/// Of a server whose own slots play.
fn alone() -> String {
    format!("{COMMON}[workers]\nslots = 1\n")
}

/// With so many episodes of each task and in each shard.
fn sized(config: &str, per_task: u32, per_shard: u32) -> String {
    let usual = format!("episodes_per_task = {EPISODES}\nepisodes_per_shard = 1\n");
    assert!(config.contains(&usual), "{config}");
    let other = format!("episodes_per_task = {per_task}\nepisodes_per_shard = {per_shard}\n");
    config.replace(&usual, &other)
}

/// With [`MANY_EPISODES`] of each task.
fn many_shards(config: &str) -> String {
    sized(config, MANY_EPISODES, 1)
}

/// Of a server for which others play, and which they reach at `files`.
fn giving(nats: &Nats, files: SocketAddr) -> String {
    format!(
        "{COMMON}[workers]\nslots = 1\nplay = false\nlease_s = 10\n[nats]\nurl = \"{}\"\nfiles_url = \"http://{files}\"\n",
        nats.url()
    )
}

/// Of a worker that reaches NATS there.
fn taking(nats: SocketAddr, slots: usize) -> String {
    format!("{COMMON}[workers]\nslots = {slots}\n[nats]\nurl = \"nats://{nats}\"\n")
}

/// An evaluation of striker that is queued and that nobody has begun, in a data folder: its path, and the team.
fn queued(data: &Path, scratch: &Path, config: &str) -> (String, Team) {
    let server = Server::start(data, config);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &bundle::reference("striker", scratch));
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let pause = json!({ "reason": "Until all are there" });
    let paused = server.post("/api/v1/queue/pause", &server.admin_token, &pause);
    assert!(paused.status().is_success(), "{}", paused.status());
    let path = path_of(&start_day(&server), &submission);
    (path, team)
}

fn resume(server: &Server) {
    let resumed = server.post("/api/v1/queue/resume", &server.admin_token, &json!({}));
    assert!(resumed.status().is_success(), "{}", resumed.status());
}

/// An evaluation that others are to play, and what a slot of the server's own made of it.
struct Contest {
    /// Of a server on which it is queued.
    data: PathBuf,
    evaluation: String,
    team: Team,
    expected: (Value, Archive),
    episodes: usize,
}

impl Contest {
    fn prepare(scratch: &Path) -> Self {
        Self::of(scratch, &alone(), 3 * EPISODES as usize)
    }

    fn of_many_shards(scratch: &Path) -> Self {
        Self::of(scratch, &many_shards(&alone()), 3 * MANY_EPISODES as usize)
    }

    fn of(scratch: &Path, config: &str, episodes: usize) -> Self {
        let [data, calm] = ["data", "calm"].map(|name| scratch.join(name));
        let (evaluation, team) = queued(&data, scratch, config);
        copy_folder(&data, &calm);
        let undisturbed = Server::start(&calm, config);
        resume(&undisturbed);
        let expected = outcome(&undisturbed, &team, &evaluation);
        undisturbed.kill();
        Self {
            data,
            evaluation,
            team,
            expected,
            episodes,
        }
    }

    /// Waits for the end, and compares.
    fn ends_alike(&self, server: &Server) {
        let found = outcome(server, &self.team, &self.evaluation);
        let evaluation = server.poll(&self.evaluation, &self.team.token, |_| true);
        let submission = evaluation["submission"].as_str().expect("it names it");
        let submission = self.team.verdict_so_far(server, submission);
        assert_eq!(submission["state"], "valid", "{submission:#}");
        assert_eq!(assert_same(found, self.expected.clone()), self.episodes);
    }
}

/// Starts a server on a contest's data, to which `files` leads.
fn serving(contest: &Contest, config: &str, files: &Relay) -> Server {
    let server = Server::start(&contest.data, config);
    files.lead_to(server.address().into());
    server
}

/// Waits until the server knows so many workers.
fn wait_for_workers(server: &Server, workers: usize) {
    let _ = server.poll("/api/v1/workers", &server.admin_token, |told| {
        told["workers"].as_array().map_or(0, Vec::len) == workers
    });
}
