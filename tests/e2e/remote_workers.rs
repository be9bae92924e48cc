//! Remote workers with a real NATS server: equal results, network faults, kills, and workers that send false results. A *remote
//! worker* is a process on another machine that runs jobs for the server. Jobs and results travel as messages through the
//! message broker NATS, files through HTTP. A [`Relay`] is a TCP proxy between them that can delay and break connections.

mod ablation;
mod bucket;
mod equal_results;
pub(crate) mod fake_worker;
mod false_results;
mod incompatible_workers;
mod interruptions;
mod kills;
mod nats_permissions;
mod nats_problems;
mod shutdown;

use crate::{
    Team, dataset, entry, evaluation_path,
    kills::{Archive, assert_same, wait_for_outcome},
    shared_folder::shared_folder,
    start_day,
};
use faceoff_tests::{
    bundle::{self, copy_folder},
    nats::Nats,
    relay::Relay,
    server::Server,
    worker::Worker,
};
use serde_json::{Value, json};
use std::{
    fs,
    io::Cursor,
    net::SocketAddr,
    path::{Path, PathBuf},
};
use tempfile::TempDir;

/// Episodes of each of the three tasks. Each episode is a shard, the job that a worker runs.
const EPISODES: u32 = 4;
/// Episodes of each task in tests that need many shards: see [`many_shards`].
const MANY_EPISODES: u32 = 10;

/// Settings of servers and workers.
const COMMON_CONFIG: &str = concat!(
    include_str!("../long_time_limits.toml"),
    r#"
[evaluation]
episodes_per_task = 4
episodes_per_shard = 1
[sandbox]
resident_bytes = 0
"#
);

/// Configuration of a server that runs all jobs itself, one at a time.
fn local_config() -> String {
    format!("{COMMON_CONFIG}[workers]\nslots = 1\n")
}

/// The configuration with this number of episodes per task and per shard.
fn with_episodes(config: &str, per_task: u32, per_shard: u32) -> String {
    let default = format!("episodes_per_task = {EPISODES}\nepisodes_per_shard = 1\n");
    assert!(config.contains(&default), "{config}");
    let changed = format!("episodes_per_task = {per_task}\nepisodes_per_shard = {per_shard}\n");
    config.replace(&default, &changed)
}

/// The configuration with [`MANY_EPISODES`] of each task.
fn many_shards(config: &str) -> String {
    with_episodes(config, MANY_EPISODES, 1)
}

/// Configuration of a server that runs no jobs itself (`play = false`). Remote workers transfer files at `files_address`.
fn server_config(nats: &Nats, files_address: SocketAddr) -> String {
    format!(
        "{COMMON_CONFIG}[workers]\nslots = 1\nplay = false\nlease_s = 10\n[nats]\nurl = \"{}\"\nfiles_url = \"http://{files_address}\"\n",
        nats.url()
    )
}

/// Configuration of a worker that runs `slots` jobs at the same time and connects to NATS at this address.
fn worker_config(nats_address: SocketAddr, slots: usize) -> String {
    format!("{COMMON_CONFIG}[workers]\nslots = {slots}\n[nats]\nurl = \"nats://{nats_address}\"\n")
}

/// Creates a server's data folder with an evaluation of the agent `striker` that is queued. Its jobs are paused. Returns the
/// API path of the evaluation, and its team.
fn queue_evaluation(data_dir: &Path, scratch: &Path, config: &str) -> (String, Team) {
    let server = Server::start(data_dir, config);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &bundle::example_agent("striker", scratch));
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let pause = json!({ "reason": "Until the workers are connected" });
    let paused = server.post("/api/v1/queue/pause", &server.admin_token, &pause);
    assert!(paused.status().is_success(), "{}", paused.status());
    let path = evaluation_path(&start_day(&server), &submission);
    (path, team)
}

/// Lets jobs start.
fn resume(server: &Server) {
    let resumed = server.post("/api/v1/queue/resume", &server.admin_token, &json!({}));
    assert!(resumed.status().is_success(), "{}", resumed.status());
}

/// An evaluation for remote workers, and its result from a local slot.
struct ReferenceRun {
    /// The data folder of a server on which the evaluation is queued.
    data_dir: PathBuf,
    /// The API path of the evaluation.
    evaluation: String,
    team: Team,
    /// Result and dataset from the local slot.
    expected: (Value, Archive),
    /// Number of episodes of all tasks.
    episodes: usize,
}

impl ReferenceRun {
    fn prepare(scratch: &Path) -> Self {
        Self::prepare_with(scratch, &local_config(), 3 * EPISODES as usize)
    }

    fn prepare_many_shards(scratch: &Path) -> Self {
        Self::prepare_with(
            scratch,
            &many_shards(&local_config()),
            3 * MANY_EPISODES as usize,
        )
    }

    fn prepare_with(scratch: &Path, config: &str, episodes: usize) -> Self {
        // All tests of a run share the evaluation and its local result; each gets a copy of the data folder.
        let shared = shared_folder(&format!("reference-run-of-{episodes}"), |folder| {
            let [data_dir, local_data_dir] = ["data", "local"].map(|name| folder.join(name));
            let (evaluation, team) = queue_evaluation(&data_dir, folder, config);
            copy_folder(&data_dir, &local_data_dir);
            let local_server = Server::start(&local_data_dir, config);
            resume(&local_server);
            let (result, archive) = wait_for_outcome(&local_server, &team, &evaluation);
            local_server.kill();
            let run = json!({ "evaluation": evaluation, "token": team.token, "result": result });
            fs::write(folder.join("run.json"), run.to_string()).expect("test data can be written");
            fs::write(
                folder.join("dataset.zip"),
                archive.into_inner().into_inner(),
            )
            .expect("test data can be written");
        });
        let data_dir = scratch.join("data");
        copy_folder(&shared.join("data"), &data_dir);
        let read = |name| fs::read(shared.join(name)).expect("test data can be read");
        let run: Value = serde_json::from_slice(&read("run.json")).expect("it is JSON");
        let text = |name: &str| run[name].as_str().expect("it is a string").to_owned();
        let archive = Archive::new(Cursor::new(read("dataset.zip"))).expect("a dataset is a zip");
        Self {
            data_dir,
            evaluation: text("evaluation"),
            team: Team {
                token: text("token"),
            },
            expected: (run["result"].clone(), archive),
            episodes,
        }
    }

    /// Waits for the end of the evaluation, and asserts that result and dataset equal the reference.
    fn assert_equal_result(&self, server: &Server) {
        let found = wait_for_outcome(server, &self.team, &self.evaluation);
        let evaluation = server.poll(&self.evaluation, &self.team.token, |_| true);
        let submission = evaluation["submission"]
            .as_str()
            .expect("an evaluation names its submission");
        let submission = self.team.submission(server, submission);
        assert_eq!(submission["state"], "valid", "{submission:#}");
        assert_eq!(assert_same(found, self.expected.clone()), self.episodes);
    }

    /// Asserts that no shard of the finished evaluation counts a retry because of a platform fault.
    fn assert_no_retries(&self, server: &Server) {
        let mut dataset = dataset(server, &self.evaluation, &self.team.token);
        let shards = entry(&mut dataset, "calibration.json");
        for shard in shards["shards"].as_array().expect("it lists the shards") {
            assert_eq!(shard.get("platform_retries"), None, "{shards:#}");
        }
    }
}

/// Starts a server on the data of a reference run, and connects the relay for files to it.
fn start_server(reference_run: &ReferenceRun, config: &str, file_relay: &Relay) -> Server {
    let server = Server::start(&reference_run.data_dir, config);
    file_relay.set_target(server.address().into());
    server
}

/// A server with the data of a reference run, and the connections that its workers need. Fields are dropped in their order.
struct RemoteSetup {
    server: Server,
    file_relay: Relay,
    nats: Nats,
    reference_run: ReferenceRun,
    scratch: TempDir,
}

impl RemoteSetup {
    fn start() -> Self {
        let scratch = tempfile::tempdir().expect("a scratch folder can be made");
        let reference_run = ReferenceRun::prepare(scratch.path());
        let nats = Nats::start(&scratch.path().join("nats"));
        let file_relay = Relay::start();
        let config = server_config(&nats, file_relay.address());
        Self {
            server: start_server(&reference_run, &config, &file_relay),
            file_relay,
            nats,
            reference_run,
            scratch,
        }
    }

    /// Starts a worker with one slot.
    fn start_worker(&self, name: &str) -> Worker {
        let config = worker_config(self.nats.address(), 1);
        Worker::start(self.scratch.path(), name, &config)
    }

    /// Waits for the end of the evaluation, and asserts that result and dataset equal the reference.
    fn assert_equal_result(&self) {
        self.reference_run.assert_equal_result(&self.server);
    }
}

/// Waits until the server lists these workers.
fn wait_for_workers<'a>(server: &Server, workers: impl IntoIterator<Item = &'a Worker>) {
    let workers: Vec<&Worker> = workers.into_iter().collect();
    let _ = server.poll("/api/v1/workers", &server.admin_token, |view| {
        assert!(
            !workers.iter().any(|worker| worker.has_ended()),
            "a worker has ended"
        );
        view["workers"].as_array().map_or(0, Vec::len) == workers.len()
    });
}
