//! The fixture of these tests: an evaluator (which plays the jobs of slots) scripted by the test, and a server around it.

use super::scripted_game::game_report;
use crate::{
    cpus::CpuLayout,
    evaluator::Evaluator,
    local::LocalServer,
    server::JobServer,
    slot::Backoff,
    slot_supervisor::{Intervals, SlotsConfig, WorkerConfig, run_with},
    slot_threads::SlotThreads,
};
use faceoff_airhockey::{IDEAL, TASKS};
use faceoff_live::LiveState;
use faceoff_metrics::Metrics;
use faceoff_replay::{ClipIndex, ClipKey, EpisodeIndexEntry, PackWriter};
use faceoff_runner::{
    AgentEnvironment, AssembledDataset, CLIPS_FILE, EvaluationMeta, GameReport, GameSpec,
    LiveFeedSink, Observer, PlatformFault, ShardReport, ShardSpec, TimeLimits, ValidationReport,
    ValidationSpec,
    bundle::{Bundle, BundleError, BundleLimits},
};
use faceoff_sandbox::{Isolation, Limits};
use faceoff_store::*;
use faceoff_testkit::{
    bundle_ref, configure_stage, create_team, finish_validation, six_shard_plan, submit,
    valid_outcome,
};
use faceoff_types::*;
use faceoff_wire::dataset::FileDigest;
use jiff::{SignedDuration, Timestamp};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex,
        atomic::{AtomicI64, Ordering},
    },
    time::Duration,
};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

/// The bundles that the scripted evaluator knows: one that it accepts, one that it refuses, and one whose unpacking ends only
/// when it is cancelled.
pub(super) const VALID_ARCHIVE: &[u8] = b"archive";
pub(super) const INVALID_ARCHIVE: &[u8] = b"no archive";
pub(super) const ENDLESS_ARCHIVE: &[u8] = b"endless";

/// Plays a shard.
pub(super) type PlayShard =
    dyn Fn(&ShardSpec, &mut dyn Observer) -> Result<(), PlatformFault> + Send + Sync;

/// Plays a game.
pub(super) type PlayGame =
    dyn Fn(&GameSpec, &mut dyn LiveFeedSink) -> Result<(), PlatformFault> + Send + Sync;

/// An evaluator that plays by a test's closures, and records which shards were played and from which recordings a dataset was assembled.
pub(super) struct ScriptedEvaluator {
    play_shard: Box<PlayShard>,
    play_game: Box<PlayGame>,
    /// Task and first episode of each shard that was played.
    pub(super) played: Mutex<Vec<(Task, u32)>>,
    /// Content of the recordings from which the last dataset was assembled.
    pub(super) assembled: Mutex<Vec<String>>,
    /// Notified when an [`ENDLESS_ARCHIVE`] is being unpacked.
    pub(super) endless_unpacking: tokio::sync::Notify,
}

impl ScriptedEvaluator {
    /// Plays shards by the closure, and everything else without faults.
    pub(super) fn new(
        play_shard: impl Fn(&ShardSpec, &mut dyn Observer) -> Result<(), PlatformFault>
        + Send
        + Sync
        + 'static,
    ) -> Arc<Self> {
        Arc::new(Self::from_closures(play_shard, |_, _| Ok(())))
    }

    /// Plays games by the closure, and everything else without faults.
    pub(super) fn with_game(
        play_game: impl Fn(&GameSpec, &mut dyn LiveFeedSink) -> Result<(), PlatformFault>
        + Send
        + Sync
        + 'static,
    ) -> Arc<Self> {
        Arc::new(Self::from_closures(|_, _| Ok(()), play_game))
    }

    fn from_closures(
        play_shard: impl Fn(&ShardSpec, &mut dyn Observer) -> Result<(), PlatformFault>
        + Send
        + Sync
        + 'static,
        play_game: impl Fn(&GameSpec, &mut dyn LiveFeedSink) -> Result<(), PlatformFault>
        + Send
        + Sync
        + 'static,
    ) -> Self {
        Self {
            play_shard: Box::new(play_shard),
            play_game: Box::new(play_game),
            played: Mutex::default(),
            assembled: Mutex::default(),
            endless_unpacking: tokio::sync::Notify::new(),
        }
    }
}

/// The outcome of an episode of one step that was solved.
pub(super) fn outcome(task: Task, episode: u32) -> EpisodeOutcome {
    EpisodeOutcome {
        task,
        episode,
        steps: 1,
        end: EpisodeEnd::HORIZON,
        success: true,
        violations: Violations::default(),
        computation_time: ComputationTime::default(),
        fault: None,
    }
}

/// Dummy clips with a real index. Under perturbations the second episode of a task is not solved.
fn clips(spec: &ShardSpec) -> Vec<u8> {
    let mut pack = PackWriter::new(Vec::new()).unwrap();
    let mut index = ClipIndex::default();
    for episode in spec.episodes.clone() {
        let text = format!("{} {episode}", spec.profile);
        pack.add(ClipKey::motion(spec.task, episode), text.as_bytes())
            .unwrap();
        index.episodes.push(EpisodeIndexEntry {
            task: spec.task,
            episode,
            steps: 10,
            success: spec.profile == IDEAL || episode != 1,
            end: EpisodeEnd::HORIZON,
            end_description: text,
            puck_at_start: Some([0.0; 4]),
            puck_at_end: Some([0.0; 4]),
            violations: Vec::new(),
            longest_s: Some(0.001),
            late_answers: 0,
        });
    }
    pack.add_index(&index).unwrap();
    pack.finish().unwrap()
}

impl Evaluator for ScriptedEvaluator {
    fn unpack(
        &self,
        archive: &Path,
        into: &Path,
        _limits: &BundleLimits,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Bundle, BundleError> {
        match std::fs::read(archive).unwrap().as_slice() {
            VALID_ARCHIVE => {}
            ENDLESS_ARCHIVE => {
                self.endless_unpacking.notify_one();
                while !cancelled() {
                    std::thread::yield_now();
                }
                return Err(BundleError::Cancelled);
            }
            _ => return Err(BundleError::Invalid("agent.toml is missing".into())),
        }
        let manifest = faceoff_wire::Manifest {
            name: "scripted".into(),
            command: vec!["./agent".into()],
            runtime: "native".into(),
            interpolation: None,
            stdout: faceoff_wire::StandardOutput::Answers,
            env: BTreeMap::new(),
        };
        Ok(Bundle {
            dir: into.to_owned(),
            manifest,
            image: None,
        })
    }

    fn validate(
        &self,
        _: &ValidationSpec,
        _: &Bundle,
        _: &AgentEnvironment,
        _: &dyn Fn() -> bool,
    ) -> Result<ValidationReport, PlatformFault> {
        Ok(ValidationReport {
            failure: None,
            timing: Vec::new(),
            log: "validated\n".into(),
        })
    }

    fn play_shard(
        &self,
        spec: &ShardSpec,
        _bundle: &Bundle,
        _env: &AgentEnvironment,
        out: &Path,
        observer: &mut dyn Observer,
    ) -> Result<ShardReport, PlatformFault> {
        (self.play_shard)(spec, observer)?;
        self.played
            .lock()
            .unwrap()
            .push((spec.task, spec.episodes.start));
        std::fs::write(
            out.join("steps.parquet"),
            format!("{} {}", spec.task, spec.episodes.start),
        )
        .unwrap();
        std::fs::write(out.join(CLIPS_FILE), clips(spec)).unwrap();
        let outcomes = spec
            .episodes
            .clone()
            .map(|episode| outcome(spec.task, episode))
            .collect();
        Ok(ShardReport {
            outcomes,
            log: String::new(),
            stopped_by_faults: false,
            timing: SlotTiming::default(),
        })
    }

    fn play_game(
        &self,
        spec: &GameSpec,
        _bundles: [&Bundle; 2],
        _envs: [&AgentEnvironment; 2],
        out: &Path,
        live_updates: &mut dyn LiveFeedSink,
    ) -> Result<GameReport, PlatformFault> {
        (self.play_game)(spec, live_updates)?;
        Ok(game_report(spec, out))
    }

    fn assemble(
        &self,
        meta: &EvaluationMeta,
        recordings: &[PathBuf],
        archive: &Path,
        clips: &Path,
    ) -> Result<AssembledDataset, PlatformFault> {
        let parts = recordings
            .iter()
            .map(|folder| std::fs::read_to_string(folder.join("steps.parquet")).unwrap())
            .collect::<Vec<_>>();
        let bytes = parts.join("\n");
        std::fs::write(archive, &bytes).unwrap();
        std::fs::write(clips, "clips").unwrap();
        *self.assembled.lock().unwrap() = parts;
        Ok(AssembledDataset {
            result: result(meta),
            archive: FileDigest {
                bytes: bytes.len() as u64,
                blake3: blake3::hash(bytes.as_bytes()).to_string(),
            },
            has_clips: true,
        })
    }
}

/// The result of an evaluation with any score.
pub(super) fn result(meta: &EvaluationMeta) -> EvaluationResult {
    EvaluationResult {
        ruleset: meta.ruleset.to_string(),
        profile: meta.profile,
        seed: meta.seed,
        tasks: Default::default(),
        score: 50.0,
        penalty_points: 0.0,
        tier: Some(Tier::Deployable),
        timing: None,
        variation: Default::default(),
    }
}

/// Runs a blocking call outside of the runtime's threads, as in a slot.
pub(super) async fn blocking<T: Send + 'static>(call: impl FnOnce() -> T + Send + 'static) -> T {
    tokio::task::spawn_blocking(call).await.unwrap()
}

/// A server without HTTP: a store, and a clock that only the tests advance, so that no lease expires because the machine is slow.
pub(super) struct Server {
    pub(super) store: Store,
    pub(super) live: LiveState,
    pub(super) folder: tempfile::TempDir,
    /// Start of the clock: about the real time, which file timestamps have.
    started_at: Timestamp,
    /// How far the tests have advanced the clock, seconds.
    pub(super) clock_ahead_s: Arc<AtomicI64>,
    pub(super) intervals: Intervals,
}

/// Duration of a lease, seconds. It is renewed after a third of it in real time, so no lease is renewed while a test runs.
pub(super) const LEASE_S: u32 = 1800;

impl Server {
    pub(super) async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let store = faceoff_testkit::new_store(folder.path()).await;
        Self {
            store,
            live: LiveState::default(),
            folder,
            started_at: Timestamp::now(),
            clock_ahead_s: Arc::default(),
            intervals: Intervals {
                idle_poll: Duration::from_millis(20),
                cleanup: Duration::from_millis(20),
                backoff: Backoff {
                    first: Duration::ZERO,
                    longest: Duration::ZERO,
                },
                ..Intervals::default()
            },
        }
    }

    pub(super) fn clock(&self) -> Clock {
        let (started_at, clock_ahead_s) = (self.started_at, Arc::clone(&self.clock_ahead_s));
        Clock::new(move || {
            started_at + SignedDuration::from_secs(clock_ahead_s.load(Ordering::SeqCst))
        })
    }

    pub(super) fn now(&self) -> Timestamp {
        self.clock().now()
    }

    /// Restarts the server on the same folder.
    pub(super) async fn reopen(self) -> Self {
        let store = Store::open(self.folder.path()).await.unwrap();
        Self {
            store,
            live: LiveState::default(),
            ..self
        }
    }

    /// Advances the clock.
    pub(super) fn advance(&self, seconds: i64) {
        self.clock_ahead_s.fetch_add(seconds, Ordering::SeqCst);
    }

    pub(super) async fn put_artifact(&self, key: &str, content: &[u8]) {
        let file = self.folder.path().join("upload");
        std::fs::write(&file, content).unwrap();
        self.store.artifacts().put_file(key, &file).await.unwrap();
    }

    /// Is there a stored file with this key?
    pub(super) async fn has_artifact(&self, key: &str) -> bool {
        self.store.artifacts().read(key).await.is_ok()
    }

    /// Creates a team and uploads a bundle, which is not validated yet.
    pub(super) async fn upload(&self, team: &str, content: &[u8]) -> Submission {
        self.put_artifact(&format!("bundles/{team}"), content).await;
        let bundle = bundle_ref(format!("bundles/{team}"), content);
        let team = create_team(&self.store, team, self.now()).await;
        submit(&self.store, team.id, bundle, self.now()).await
    }

    /// Creates a team with a valid submission.
    pub(super) async fn upload_valid(&self, team: &str) -> Submission {
        let submission = self.upload(team, VALID_ARCHIVE).await;
        let outcome = valid_outcome("native", "scripted", "");
        finish_validation(&self.store, outcome, self.now()).await;
        submission
    }

    /// Starts an evaluation: two shards of two episodes for each of the three tasks are queued.
    pub(super) async fn start_evaluation(&self) -> EvaluationId {
        let submission = self.upload_valid("Alpha").await;
        let plan = RunPlan {
            tasks: TASKS.to_vec(),
            max_faults: 10,
            ..six_shard_plan()
        };
        let stage = configure_stage(&self.store, &plan, None, self.now()).await;
        let started = self
            .store
            .start_day(Actor::Operator, stage, self.now())
            .await
            .unwrap();
        assert_eq!(started[0].submission, submission.id);
        started[0].id
    }

    /// The job server for slots of this process.
    pub(super) fn local(&self) -> LocalServer {
        self.config(1)
            .local_server(self.store.clone(), self.live.clone(), self.clock())
    }

    pub(super) fn start_slots(
        &self,
        slots: usize,
        evaluator: &Arc<ScriptedEvaluator>,
    ) -> RunningSlots {
        self.start_intercepted_slots(slots, evaluator, |server| Arc::new(server))
    }

    /// Starts slots whose job server is wrapped by `intercept`.
    pub(super) fn start_intercepted_slots(
        &self,
        slots: usize,
        evaluator: &Arc<ScriptedEvaluator>,
        intercept: impl FnOnce(LocalServer) -> Arc<dyn JobServer>,
    ) -> RunningSlots {
        let config = self.config(slots);
        let server = config.local_server(self.store.clone(), self.live.clone(), self.clock());
        let shutdown = CancellationToken::new();
        let task = tokio::spawn(run_with(
            server.clone(),
            intercept(server),
            Arc::clone(evaluator) as Arc<dyn Evaluator>,
            config,
            self.intervals,
            shutdown.clone(),
        ));
        RunningSlots { shutdown, task }
    }

    fn config(&self, slots: usize) -> WorkerConfig {
        WorkerConfig {
            slots: SlotsConfig {
                cpus: CpuLayout::with_agents_on(&[0], &[0], slots),
                threads: SlotThreads::from_caller(),
                scratch_dir: self.folder.path().join("scratch"),
                agent: AgentEnvironment {
                    limits: limits(),
                    time: TimeLimits {
                        startup_s: 1.0,
                        reset_s: 1.0,
                        step_s: 1.0,
                        bye_s: 1.0,
                        host_interference_reruns: 0,
                        ..TimeLimits::default()
                    },
                    isolation: Isolation::None,
                    runtimes: BTreeMap::new(),
                    images: false,
                    agent_cpus: Vec::new(),
                    supervision: faceoff_runner::Supervision::default(),
                    simulator: faceoff_airhockey::simulator(),
                },
                metrics: Metrics::new("0.0.0"),
            },
            job_filter: JobFilter::All,
            lease_s: LEASE_S,
            bundle_limits: BundleLimits {
                packed_bytes: 1,
                unpacked_bytes: 1,
                files: 1,
                unpack_s: 1,
            },
        }
    }

    /// Waits for the end of an evaluation.
    pub(super) async fn wait_for_end(&self, id: EvaluationId) -> EvaluationState {
        faceoff_testkit::wait_for_evaluation(&self.store, id).await
    }

    /// Waits for the end of an evaluation, which must have a result.
    pub(super) async fn wait_for_result(&self, id: EvaluationId) {
        let state = self.wait_for_end(id).await;
        let is_finished = matches!(state, EvaluationState::Finished { .. });
        assert!(is_finished, "{state:?}");
    }
}

/// Limits of agents; the scripted evaluator does not apply them.
pub(super) fn limits() -> Limits {
    Limits {
        memory_bytes: 1 << 30,
        pids: 64,
        scratch_bytes: 1 << 20,
        open_files: 64,
        file_size_bytes: 1 << 20,
        cpus: 1.0,
        stderr_kept_bytes: 1 << 16,
    }
}

/// A worker process with slots, running as a task.
pub(super) struct RunningSlots {
    pub(super) shutdown: CancellationToken,
    pub(super) task: JoinHandle<anyhow::Result<()>>,
}

impl RunningSlots {
    pub(super) async fn stop(self) {
        self.shutdown.cancel();
        self.task.await.unwrap().unwrap();
    }
}
