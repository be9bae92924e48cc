//! Runs the jobs of a slot, one method per kind of job.

use crate::{
    bundle_cache::{BundleCache, UnpackResult},
    cpus::SlotCpus,
    evaluator::Evaluator,
    files::FileStore,
    game_broadcast::GameBroadcast,
    lease::Progress,
    scorer::Scorer,
    server::JobServer,
};
use anyhow::Context as _;
use faceoff_episode::Simulator;
use faceoff_runner::{AgentEnvironment, CLIPS_FILE, GameSpec, Supervision, bundle::Bundle};
use faceoff_sandbox::{Isolation, Runtime};
use faceoff_types::{AgentLimits, GameId, SlotTiming, StageRuntimes, ValidationOutcome};
use faceoff_wire::job::{
    AgentSpec, GameFiles, JobPayload, JobReport, JobSpec, Lease, OutputFiles, ShardSpec,
    ValidationSpec,
};
use std::{collections::BTreeMap, path::PathBuf, sync::Arc};

/// Runs the jobs of a slot. All errors are platform faults, with one exception: a job also ends with an error soon after
/// [`Progress::must_stop`] becomes true.
pub(crate) struct Executor {
    /// Timing quality of the slot in the last shard; `None` before the first.
    pub(crate) timing: Option<SlotTiming>,
    /// Only receives the live updates of games; claims and commits are made by the slot.
    pub(crate) server: Arc<dyn JobServer>,
    pub(crate) files: Arc<dyn FileStore>,
    /// Only slots of the server's own process have one: the server sends no scoring to a remote worker.
    pub(crate) scorer: Option<Scorer>,
    pub(crate) evaluator: Arc<dyn Evaluator>,
    pub(crate) host: AgentHost,
    /// Folder for temporary files of the current job.
    pub(crate) folder: PathBuf,
    pub(crate) bundles: BundleCache,
}

/// The part of an agent's environment that depends on the slot's machine; the limits are part of the job.
#[derive(Debug, Clone)]
pub(crate) struct AgentHost {
    pub(crate) isolation: Isolation,
    pub(crate) runtimes: BTreeMap<String, Runtime>,
    /// May agents be container images?
    pub(crate) images: bool,
    pub(crate) cpus: SlotCpus,
    pub(crate) simulator: Arc<dyn Simulator>,
}

impl AgentHost {
    /// The environment of the only agent of a job.
    fn environment(&self, limits: &AgentLimits, progress: &Progress) -> AgentEnvironment {
        self.environment_on(self.cpus.agent_cpus(0).to_vec(), limits, progress)
    }

    fn environment_on(
        &self,
        agent_cpus: Vec<usize>,
        limits: &AgentLimits,
        progress: &Progress,
    ) -> AgentEnvironment {
        let progress = progress.clone();
        AgentEnvironment {
            limits: limits.resources.clone(),
            time: limits.time.clone(),
            isolation: self.isolation.clone(),
            runtimes: self.runtimes.clone(),
            images: self.images,
            agent_cpus,
            supervision: Supervision::new(move || progress.must_stop()),
            simulator: Arc::clone(&self.simulator),
        }
    }
}

impl Executor {
    /// Runs a job and returns its report.
    pub(crate) fn run(&mut self, job: &JobSpec, progress: &Progress) -> anyhow::Result<JobReport> {
        match &job.payload {
            JobPayload::Validation {
                agent,
                spec,
                runtimes,
                ..
            } => self
                .validate(agent, spec, runtimes, progress)
                .map(JobReport::Validation),
            JobPayload::Shard {
                agent,
                spec,
                output,
                ..
            } => self.play_shard(agent, spec, output, progress.clone()),
            JobPayload::Game {
                game,
                attempt,
                agents,
                spec,
                recording,
            } => {
                let broadcast = self.broadcast(&job.lease, (*game, *attempt), spec.steps, progress);
                self.play_game(agents, spec, recording.as_deref(), broadcast)
            }
            JobPayload::Scoring {
                meta,
                recordings,
                dataset,
                ..
            } => {
                let scorer = self.scorer.as_ref().with_context(|| {
                    format!("expected a job that runs agents, got the {}", job.payload)
                })?;
                let folder = self.temporary_folder("dataset")?;
                scorer.score(&*self.evaluator, folder.path(), meta, recordings, dataset)
            }
        }
    }

    fn unpacked_bundle(
        &mut self,
        agent: &AgentSpec,
        opponent: Option<&AgentSpec>,
        progress: &Progress,
    ) -> anyhow::Result<UnpackResult> {
        self.bundles
            .get(agent, opponent, &*self.evaluator, &*self.files, progress)
    }

    /// The bundle of a valid submission. It passed validation, so an invalid archive is a platform fault.
    fn valid_bundle(
        &mut self,
        agent: &AgentSpec,
        opponent: Option<&AgentSpec>,
        progress: &Progress,
    ) -> anyhow::Result<Bundle> {
        match self.unpacked_bundle(agent, opponent, progress)? {
            UnpackResult::Bundle(bundle) => Ok(bundle),
            UnpackResult::Invalid(reason) => anyhow::bail!(reason),
        }
    }

    /// A new empty folder in [`Self::folder`], which is removed when the returned guard is dropped. Its name begins with `purpose`.
    fn temporary_folder(&self, purpose: &str) -> anyhow::Result<tempfile::TempDir> {
        tempfile::Builder::new()
            .prefix(purpose)
            .tempdir_in(&self.folder)
            .with_context(|| format!("making a folder for the {purpose}"))
    }

    /// Validates an uploaded bundle in the same sandbox and under the same limits as an evaluation.
    fn validate(
        &mut self,
        agent: &AgentSpec,
        spec: &ValidationSpec,
        runtimes: &[StageRuntimes],
        progress: &Progress,
    ) -> anyhow::Result<ValidationOutcome> {
        let bundle = match self.unpacked_bundle(agent, None, progress)? {
            UnpackResult::Bundle(bundle) => bundle,
            UnpackResult::Invalid(reason) => {
                return Ok(ValidationOutcome::Invalid {
                    agent_name: None,
                    runtime: None,
                    reason,
                    timing: Vec::new(),
                    log: String::new(),
                });
            }
        };
        let runtime = bundle.manifest.runtime.clone();
        if let Some(reason) = StageRuntimes::reasons_if_all_refuse(runtimes, &runtime) {
            return Ok(ValidationOutcome::Invalid {
                agent_name: Some(bundle.manifest.name),
                runtime: Some(runtime),
                reason,
                timing: Vec::new(),
                log: String::new(),
            });
        }
        let environment = self.host.environment(&agent.limits, progress);
        let validated = self
            .evaluator
            .validate(spec, &bundle, &environment, &|| progress.must_stop())?;
        let (agent_name, timing, log) = (bundle.manifest.name, validated.timing, validated.log);
        Ok(match validated.failure {
            None => ValidationOutcome::Valid {
                agent_name,
                runtime,
                timing,
                log,
            },
            Some(failure) => ValidationOutcome::Invalid {
                agent_name: Some(agent_name),
                runtime: Some(runtime),
                reason: failure.to_string(),
                timing,
                log,
            },
        })
    }

    /// Plays a shard and stores its output files.
    fn play_shard(
        &mut self,
        agent: &AgentSpec,
        spec: &ShardSpec,
        output: &OutputFiles,
        mut progress: Progress,
    ) -> anyhow::Result<JobReport> {
        let bundle = self.valid_bundle(agent, None, &progress)?;
        let environment = self.host.environment(&agent.limits, &progress);
        let out = self.temporary_folder("recording")?;
        let played =
            self.evaluator
                .play_shard(spec, &bundle, &environment, out.path(), &mut progress)?;
        // The time from here to the commit depends on whether the slot is local or remote.
        tracing::debug!("played");
        let recording = match output {
            OutputFiles::None => None,
            OutputFiles::Clips(key) => {
                self.files
                    .store_clips(key, &out.path().join(CLIPS_FILE))
                    .context("storing the clips")?;
                None
            }
            OutputFiles::Recording(key) => {
                self.files
                    .store_recording(key, out.path())
                    .context("storing the recording")?;
                Some(key.clone())
            }
        };
        self.timing = Some(played.timing);
        Ok(JobReport::Shard {
            outcomes: played.outcomes,
            log: played.log,
            stopped_by_faults: played.stopped_by_faults,
            recording,
        })
    }

    /// `game` is the game's id and the number of the attempt.
    fn broadcast(
        &self,
        lease: &Lease,
        game: (GameId, u32),
        steps: u32,
        progress: &Progress,
    ) -> GameBroadcast {
        GameBroadcast::begin(
            Arc::clone(&self.server),
            lease.clone(),
            game,
            steps,
            progress.clone(),
        )
    }

    /// Plays a game with a live broadcast, and stores its files if required.
    fn play_game(
        &mut self,
        agents: &[AgentSpec; 2],
        spec: &GameSpec,
        recording: Option<&str>,
        mut broadcast: GameBroadcast,
    ) -> anyhow::Result<JobReport> {
        let [first, second] = agents;
        let bundles = [
            self.valid_bundle(first, Some(second), broadcast.progress())?,
            self.valid_bundle(second, Some(first), broadcast.progress())?,
        ];
        let [first_cpus, second_cpus] = self.host.cpus.side_cpus();
        let envs = [
            self.host
                .environment_on(first_cpus, &first.limits, broadcast.progress()),
            self.host
                .environment_on(second_cpus, &second.limits, broadcast.progress()),
        ];
        let out = self.temporary_folder("game")?;
        let played = self.evaluator.play_game(
            spec,
            bundles.each_ref(),
            envs.each_ref(),
            out.path(),
            &mut broadcast,
        )?;
        if let Some(key) = recording {
            self.files
                .store_recording(key, out.path())
                .context("storing the game's recording")?;
        }
        let archives = played.archives;
        Ok(JobReport::Game {
            score: serde_json::to_value(&archives.score).context("a game's score")?,
            recording: recording.map(|key| GameFiles {
                key: key.to_owned(),
                game_blake3: archives.game.blake3,
                side_blake3: archives.sides.map(|file| file.blake3),
            }),
            logs: played.logs,
        })
    }
}
