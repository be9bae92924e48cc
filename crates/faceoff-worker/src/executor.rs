//! The kinds of work, each from its order to what is to be reported.

use crate::{
    bundle_cache::{BundleCache, Unpacked},
    cpus::SlotCpus,
    evaluator::Evaluator,
    lease::Progress,
    server::WorkServer,
    shown::Shown,
};
use anyhow::Context as _;
use faceoff_runner::{AgentEnvironment, CLIPS_FILE, GameSpec, Supervision, bundle::Bundle};
use faceoff_sandbox::{Isolation, Runtime};
use faceoff_types::{AgentLimits, GameId, SlotTiming, SmokeOutcome, StageRuntimes};
use faceoff_wire::work::{
    AgentOrder, Assignment, EvaluationMeta, Keeps, Lease, ShardSpec, SmokeSpec, StoredGame,
    WorkOrder, WorkReport,
};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

/// Carries out a slot's orders. All errors are faults of ours; a unit that is no longer the slot's
/// ends by one, too, soon after [`Progress::stopped`] says so.
pub(crate) struct Executor {
    /// How evenly the slot kept time in the last shard that it played.
    pub(crate) timing: Option<SlotTiming>,
    pub(crate) server: Arc<dyn WorkServer>,
    pub(crate) evaluator: Arc<dyn Evaluator>,
    pub(crate) host: AgentHost,
    /// For what is under way.
    pub(crate) folder: PathBuf,
    pub(crate) bundles: BundleCache,
}

/// What the slot's machine gives to agents; what they are held to stands in the order.
#[derive(Debug, Clone)]
pub(crate) struct AgentHost {
    pub(crate) isolation: Isolation,
    pub(crate) runtimes: BTreeMap<String, Runtime>,
    pub(crate) images: bool,
    pub(crate) cpus: SlotCpus,
}

impl AgentHost {
    /// Of an agent that plays alone.
    fn environment(&self, limits: &AgentLimits, progress: &Progress) -> AgentEnvironment {
        self.environment_on(self.cpus.of_agent(0).to_vec(), limits, progress)
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
            supervision: Supervision::of(move || progress.stopped()),
        }
    }
}

impl Executor {
    pub(crate) fn report(
        &mut self,
        order: &WorkOrder,
        progress: &Progress,
    ) -> anyhow::Result<WorkReport> {
        match &order.assignment {
            Assignment::Smoke {
                agent,
                spec,
                runtimes,
                ..
            } => self
                .smoke(agent, spec, runtimes, progress)
                .map(WorkReport::Smoke),
            Assignment::Play {
                agent, spec, keeps, ..
            } => self.play(agent, spec, keeps, progress.clone()),
            Assignment::Game {
                game,
                attempt,
                agents,
                spec,
                recording,
            } => {
                let shown = self.show(&order.lease, (*game, *attempt), spec.steps, progress);
                self.game(agents, spec, recording.as_deref(), shown)
            }
            Assignment::Finalise {
                meta,
                recordings,
                dataset,
                ..
            } => self.finalise(meta, recordings, dataset),
        }
    }

    fn bundle(
        &mut self,
        agent: &AgentOrder,
        beside: Option<&AgentOrder>,
        progress: &Progress,
    ) -> anyhow::Result<Unpacked> {
        self.bundles
            .get(agent, beside, &*self.evaluator, &*self.server, progress)
    }

    /// The bundle of a valid submission: it passed its smoke run, so that the archive is not to blame.
    fn valid_bundle(
        &mut self,
        agent: &AgentOrder,
        beside: Option<&AgentOrder>,
        progress: &Progress,
    ) -> anyhow::Result<Bundle> {
        match self.bundle(agent, beside, progress)? {
            Unpacked::Bundle(bundle) => Ok(bundle),
            Unpacked::Invalid(reason) => anyhow::bail!(reason),
        }
    }

    /// An empty folder that vanishes with its guard.
    fn folder(&self, purpose: &str) -> anyhow::Result<tempfile::TempDir> {
        tempfile::Builder::new()
            .prefix(purpose)
            .tempdir_in(&self.folder)
            .with_context(|| format!("making a folder for the {purpose}"))
    }

    /// Checks an uploaded bundle in the very sandbox and under the very limits of the real run.
    fn smoke(
        &mut self,
        agent: &AgentOrder,
        spec: &SmokeSpec,
        runtimes: &[StageRuntimes],
        progress: &Progress,
    ) -> anyhow::Result<SmokeOutcome> {
        let bundle = match self.bundle(agent, None, progress)? {
            Unpacked::Bundle(bundle) => bundle,
            Unpacked::Invalid(reason) => {
                return Ok(SmokeOutcome::Invalid {
                    agent_name: None,
                    runtime: None,
                    reason,
                    timing: Vec::new(),
                    log: String::new(),
                });
            }
        };
        let runtime = bundle.manifest.runtime.clone();
        if let Some(reason) = StageRuntimes::refused_by_all(runtimes, &runtime) {
            return Ok(SmokeOutcome::Invalid {
                agent_name: Some(bundle.manifest.name),
                runtime: Some(runtime),
                reason,
                timing: Vec::new(),
                log: String::new(),
            });
        }
        let environment = self.host.environment(&agent.limits, progress);
        let smoke = self
            .evaluator
            .smoke(spec, &bundle, &environment, &|| progress.stopped())?;
        let (agent_name, timing, log) = (bundle.manifest.name, smoke.timing, smoke.log);
        Ok(match smoke.defect {
            None => SmokeOutcome::Valid {
                agent_name,
                runtime,
                timing,
                log,
            },
            Some(defect) => SmokeOutcome::Invalid {
                agent_name: Some(agent_name),
                runtime: Some(runtime),
                reason: defect.to_string(),
                timing,
                log,
            },
        })
    }

    /// Plays a shard and stores what is kept of it.
    fn play(
        &mut self,
        agent: &AgentOrder,
        spec: &ShardSpec,
        keeps: &Keeps,
        mut progress: Progress,
    ) -> anyhow::Result<WorkReport> {
        let bundle = self.valid_bundle(agent, None, &progress)?;
        let environment = self.host.environment(&agent.limits, &progress);
        let out = self.folder("recording")?;
        let played = self
            .evaluator
            .play(spec, &bundle, &environment, out.path(), &mut progress)?;
        // What follows is what depends on where the slot is.
        tracing::debug!("played");
        let recording = match keeps {
            Keeps::Nothing => None,
            Keeps::Clips(key) => {
                self.server
                    .store_clips(key, &out.path().join(CLIPS_FILE))
                    .context("storing the clips")?;
                None
            }
            Keeps::Recording(key) => {
                self.server
                    .store_recording(key, out.path())
                    .context("storing the recording")?;
                Some(key.clone())
            }
        };
        self.timing = Some(played.timing);
        Ok(WorkReport::Play {
            outcomes: played.outcomes,
            log: played.log,
            stopped_by_faults: played.stopped_by_faults,
            recording,
        })
    }

    fn show(&self, lease: &Lease, game: (GameId, u32), steps: u32, progress: &Progress) -> Shown {
        Shown::begin(
            Arc::clone(&self.server),
            lease.clone(),
            game,
            steps,
            progress.clone(),
        )
    }

    /// Plays a game, before those who watch, and stores its files, if they are kept.
    fn game(
        &mut self,
        agents: &[AgentOrder; 2],
        spec: &GameSpec,
        recording: Option<&str>,
        mut shown: Shown,
    ) -> anyhow::Result<WorkReport> {
        let [first, second] = agents;
        let bundles = [
            self.valid_bundle(first, Some(second), shown.progress())?,
            self.valid_bundle(second, Some(first), shown.progress())?,
        ];
        let [first_cpus, second_cpus] = self.host.cpus.of_a_game();
        let envs = [
            self.host
                .environment_on(first_cpus, &first.limits, shown.progress()),
            self.host
                .environment_on(second_cpus, &second.limits, shown.progress()),
        ];
        let out = self.folder("game")?;
        let played = self.evaluator.play_game(
            spec,
            bundles.each_ref(),
            envs.each_ref(),
            out.path(),
            &mut shown,
        )?;
        if let Some(key) = recording {
            self.server
                .store_recording(key, out.path())
                .context("storing the game's recording")?;
        }
        let archives = played.archives;
        Ok(WorkReport::Game {
            score: serde_json::to_value(&archives.score).context("a game's score")?,
            recording: recording.map(|key| StoredGame {
                key: key.to_owned(),
                game_blake3: archives.game.blake3,
                side_blake3: archives.sides.map(|file| file.blake3),
            }),
            logs: played.logs,
        })
    }

    /// Joins the shards' recordings into the dataset, scores them and stores the dataset.
    fn finalise(
        &self,
        meta: &EvaluationMeta,
        recordings: &[String],
        dataset: &str,
    ) -> anyhow::Result<WorkReport> {
        let work = self.folder("dataset")?;
        let recordings = self.fetch_recordings(recordings, work.path())?;
        let archive = work.path().join("dataset.zip");
        let clips = work.path().join("clips");
        let assembled = self
            .evaluator
            .assemble(meta, &recordings, &archive, &clips)?;
        self.server
            .store_dataset(dataset, &archive, assembled.clips.then_some(&*clips))
            .context("storing the dataset")?;
        Ok(WorkReport::Finalise {
            dataset: dataset.to_owned(),
            blake3: assembled.archive.blake3,
            result: Box::new(assembled.result),
        })
    }

    /// Copies recordings into folders of their own.
    fn fetch_recordings(&self, keys: &[String], into: &Path) -> anyhow::Result<Vec<PathBuf>> {
        let mut folders = Vec::with_capacity(keys.len());
        for (position, key) in keys.iter().enumerate() {
            let folder = into.join(format!("shard-{position:05}"));
            fs_err::create_dir(&folder)?;
            self.server
                .fetch_recording(key, &folder)
                .with_context(|| format!("fetching the recording {key}"))?;
            folders.push(folder);
        }
        Ok(folders)
    }
}
