//! A server for tests: a store, a worker with slots that run jobs, and teams with the agent `agent.py`. The variables of its environment
//! (`GOOD_EPISODES`, `SWING`, `MISCHIEF`), which a test sets in the manifest, decide how the agent behaves; `agent.py` describes them.

use faceoff_live::LiveState;
use faceoff_metrics::Metrics;
use faceoff_runner::{AgentEnvironment, TimeLimits, bundle::BundleLimits};
use faceoff_sandbox::{Isolation, Limits, Runtime};
use faceoff_store::*;
use faceoff_testkit::{
    bundle_ref, configure_stage, create_team, finish_validation, submit, valid_outcome,
    wait_for_evaluation, wait_for_validation,
};
use faceoff_types::*;
use faceoff_worker::{CpuLayout, SlotThreads, SlotsConfig, WorkerConfig};
use jiff::Timestamp;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

pub struct Server {
    pub store: Store,
    folder: PathBuf,
    /// Removes the folder at the end, if this server created it.
    _guard: Option<tempfile::TempDir>,
}

/// A running worker.
pub struct Worker {
    shutdown: CancellationToken,
    task: JoinHandle<anyhow::Result<()>>,
}

impl Worker {
    pub async fn stop(self) {
        self.shutdown.cancel();
        self.task.await.unwrap().unwrap();
    }
}

impl Server {
    pub async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let server = Self::at(folder.path()).await;
        Self {
            _guard: Some(folder),
            ..server
        }
    }

    /// A server on an existing folder, which another process may use too.
    pub async fn at(folder: &Path) -> Self {
        let store = Store::open(&folder.join("data")).await.unwrap();
        Self {
            store,
            folder: folder.to_owned(),
            _guard: None,
        }
    }

    pub fn path(&self) -> &Path {
        &self.folder
    }

    pub fn start_worker(&self, slots: usize) -> Worker {
        let runtimes = BTreeMap::from([(
            "python3".to_owned(),
            Runtime::python3().expect("this machine has Python"),
        )]);
        let config = WorkerConfig {
            slots: SlotsConfig {
                cpus: CpuLayout::for_server(slots, &[]),
                threads: SlotThreads::from_caller(),
                scratch_dir: self.path().join("scratch"),
                agent: AgentEnvironment {
                    limits: Limits::default(),
                    // So long that a busy machine does not affect the agent.
                    time: TimeLimits {
                        startup_s: 600.0,
                        reset_s: 600.0,
                        step_s: 600.0,
                        bye_s: 600.0,
                        mean_s: 600.0,
                        episode_extra_s: 600.0,
                        resets_extra_s: 600.0,
                        ..TimeLimits::default()
                    },
                    isolation: Isolation::Sandboxed {
                        disabled_layers: Vec::new(),
                    },
                    runtimes,
                    images: false,
                    agent_cpus: Vec::new(),
                    supervision: faceoff_runner::Supervision::default(),
                    simulator: faceoff_airhockey::simulator(),
                },
                metrics: Metrics::new("0.0.0"),
            },
            job_filter: JobFilter::All,
            // Long, since the successor of a killed worker releases its leases at once.
            lease_s: 3600,
            bundle_limits: BundleLimits::default(),
        };
        let shutdown = CancellationToken::new();
        let clock = Clock::new(Timestamp::now);
        let run = faceoff_worker::run(
            self.store.clone(),
            LiveState::default(),
            clock,
            config,
            shutdown.clone(),
        );
        Worker {
            shutdown,
            task: tokio::spawn(run),
        }
    }

    /// Uploads the agent with these lines in the `[env]` of its manifest, as the HTTP server does. The agent is not validated
    /// yet.
    pub async fn upload(&self, team: &str, env: &str) -> SubmissionId {
        let archive = self.path().join("upload.tar.gz");
        write_bundle(&archive, env);
        let content = std::fs::read(&archive).unwrap();
        let key = format!("bundles/{}", blake3::hash(&content));
        let bundle = bundle_ref(key, &content);
        self.store
            .artifacts()
            .put_file(&bundle.key, &archive)
            .await
            .unwrap();
        let now = Timestamp::now();
        let team = create_team(&self.store, team, now).await;
        submit(&self.store, team.id, bundle, now).await.id
    }

    /// Uploads an agent, commits a validation run with the verdict “valid”, and returns the agent's team.
    pub async fn upload_valid(&self, team: &str, env: &str) -> TeamId {
        self.upload(team, env).await;
        let outcome = valid_outcome("python3", "passive", "");
        finish_validation(&self.store, outcome, Timestamp::now())
            .await
            .team
    }

    /// Starts a day with this plan. Returns the evaluations in the order of the uploads.
    pub async fn start_day(&self, plan: &RunPlan, now: Timestamp) -> Vec<Evaluation> {
        let stage = configure_stage(&self.store, plan, None, now).await;
        let started = self.store.start_day(Actor::Operator, stage, now);
        started.await.unwrap()
    }

    /// A copy in another folder. Closes the store of this server.
    pub async fn copy(&self) -> Self {
        self.store.close().await;
        let folder = tempfile::tempdir().unwrap();
        let (from, to) = (self.path().join("data"), folder.path().join("data"));
        let copied = std::process::Command::new("cp")
            .arg("-a")
            .args([from, to])
            .status();
        assert!(copied.unwrap().success());
        let copy = Self::at(folder.path()).await;
        Self {
            _guard: Some(folder),
            ..copy
        }
    }

    /// Waits for the end of the validation run.
    pub async fn wait_for_validation(&self, id: SubmissionId) -> SubmissionState {
        wait_for_validation(&self.store, id).await.state
    }

    /// Waits for the end of an evaluation.
    pub async fn wait_for_end(&self, id: EvaluationId) -> EvaluationState {
        wait_for_evaluation(&self.store, id).await
    }
}

/// Writes a bundle with `agent.py`.
fn write_bundle(archive: &Path, env: &str) {
    let manifest = format!(
        "name = \"passive\"\ncommand = [\"python3\", \"agent.py\"]\nruntime = \"python3\"\n[env]\n{env}\n"
    );
    let file = std::fs::File::create(archive).unwrap();
    let gzip = flate2::write::GzEncoder::new(file, flate2::Compression::fast());
    let mut tar = tar::Builder::new(gzip);
    for (name, content) in [
        ("agent.toml", manifest.as_str()),
        ("agent.py", include_str!("agent.py")),
    ] {
        let mut header = tar::Header::new_gnu();
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        tar.append_data(&mut header, name, content.as_bytes())
            .unwrap();
    }
    tar.into_inner().unwrap().finish().unwrap();
}
