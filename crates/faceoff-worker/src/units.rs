//! The three kinds of work, each from claim to commit.

use crate::{
    bundle_cache::{BundleCache, FetchError},
    clock::Clock,
    evaluator::Evaluator,
    lease::Progress,
};
use anyhow::Context as _;
use faceoff_runner::{
    AgentEnvironment, EvaluationMeta, PlatformFault, ShardSpec, bundle::BundleLimits,
};
use faceoff_store::{
    BundleRef, Claim, Committed, Run, RunSeeds, Shard, ShardCommit, SmokeOutcome, Store, Submission,
};
use faceoff_types::EvaluationId;
use std::path::{Path, PathBuf};
use tokio::runtime::Handle;

/// How a unit ended for its slot. An error is a fault of ours: the unit goes back to the queue.
pub(crate) type Ended = anyhow::Result<End>;

/// See [`Ended`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// What came of it is stored.
    Committed,
    /// It is no longer this slot's: the lease was lost, or given back for a shutdown.
    Stopped,
}

/// What all units of a slot need.
pub(crate) struct Tools {
    pub(crate) store: Store,
    pub(crate) handle: Handle,
    pub(crate) clock: Clock,
    pub(crate) evaluator: std::sync::Arc<dyn Evaluator>,
    pub(crate) agent: AgentEnvironment,
    pub(crate) bundle_limits: BundleLimits,
    pub(crate) folder: PathBuf,
    pub(crate) bundles: BundleCache,
}

impl Tools {
    fn bundle(&mut self, bundle: &BundleRef) -> Result<faceoff_runner::bundle::Bundle, FetchError> {
        self.bundles.get(
            bundle,
            self.evaluator.as_ref(),
            &self.bundle_limits,
            &self.store,
            &self.handle,
        )
    }

    /// The bundle of a valid submission: it passed its smoke run, so that the archive is not to blame.
    fn valid_bundle(
        &mut self,
        bundle: &BundleRef,
    ) -> anyhow::Result<faceoff_runner::bundle::Bundle> {
        self.bundle(bundle).map_err(|error| match error {
            FetchError::Invalid(reason) | FetchError::Platform(reason) => anyhow::anyhow!(reason),
        })
    }

    /// An empty folder that vanishes with its guard.
    fn folder(&self, purpose: &str) -> anyhow::Result<tempfile::TempDir> {
        tempfile::Builder::new()
            .prefix(purpose)
            .tempdir_in(&self.folder)
            .with_context(|| format!("making a folder for the {purpose}"))
    }

    /// Checks an uploaded bundle in the very sandbox and under the very limits of the real run.
    pub(crate) fn smoke(
        &mut self,
        claim: &Claim,
        submission: &Submission,
        progress: &Progress,
    ) -> Ended {
        let outcome = match self.bundle(&submission.bundle) {
            Ok(bundle) => {
                let smoke = self
                    .evaluator
                    .smoke(&bundle, &self.agent, &|| progress.stopped());
                let report = match smoke {
                    Err(PlatformFault::Cancelled) if progress.stopped() => return Ok(End::Stopped),
                    other => other?,
                };
                let (agent_name, log) = (bundle.manifest.name, report.log);
                match report.fault {
                    None => SmokeOutcome::Valid { agent_name, log },
                    Some(fault) => SmokeOutcome::Invalid {
                        agent_name: Some(agent_name),
                        reason: fault.to_string(),
                        log,
                    },
                }
            }
            Err(FetchError::Invalid(reason)) => SmokeOutcome::Invalid {
                agent_name: None,
                reason,
                log: String::new(),
            },
            Err(FetchError::Platform(reason)) => anyhow::bail!(reason),
        };
        let committed = self.store.commit_smoke(claim, outcome, self.clock.now());
        Ok(match self.handle.block_on(committed)? {
            Committed::Now | Committed::Before => End::Committed,
            Committed::LeaseLost => End::Stopped,
        })
    }

    /// Plays a shard, uploads its recording if the run keeps any, and only then commits it.
    pub(crate) fn shard(
        &mut self,
        claim: &Claim,
        (run, seeds): (&Run, RunSeeds),
        shard: &Shard,
        bundle: &BundleRef,
        mut progress: Progress,
    ) -> Ended {
        let bundle = self.valid_bundle(bundle)?;
        let spec = ShardSpec {
            task: shard.task,
            episodes: shard.first_episode..shard.end_episode,
            profile: run.plan.profile,
            seed: seeds.episodes,
            mismatch_seed: seeds.mismatch,
            max_faults: run.plan.max_faults,
        };
        let out = self.folder("recording")?;
        let report =
            match self
                .evaluator
                .play(&spec, &bundle, &self.agent, out.path(), &mut progress)
            {
                Ok(report) => report,
                Err(PlatformFault::Cancelled) if progress.stopped() => return Ok(End::Stopped),
                Err(fault) => return Err(fault.into()),
            };
        let recording = run.keeps_recordings.then(|| claim.recording_key(run.id));
        let (store, handle) = (&self.store, &self.handle);
        if let Some(key) = &recording {
            handle
                .block_on(store.artifacts().put_folder(key, out.path()))
                .context("storing the recording")?;
        }
        let commit = ShardCommit {
            outcomes: report.outcomes,
            log: report.log,
            stopped_by_faults: report.stopped_by_faults,
            recording: recording.clone(),
        };
        match handle.block_on(store.commit_shard(claim, commit, self.clock.now()))? {
            Committed::Now | Committed::Before => Ok(End::Committed),
            Committed::LeaseLost => {
                if let Some(key) = &recording {
                    handle
                        .block_on(store.artifacts().delete_folder(key))
                        .context("removing the recording of a lost lease")?;
                }
                Ok(End::Stopped)
            }
        }
    }

    /// Joins the shards' recordings into the dataset, scores them, and publishes both together.
    pub(crate) fn finalise(
        &mut self,
        claim: &Claim,
        evaluation: EvaluationId,
        meta: &EvaluationMeta,
        recordings: &[String],
    ) -> Ended {
        let work = self.folder("dataset")?;
        let recordings = self.recordings(recordings, work.path())?;
        let archive = work.path().join("dataset.zip");
        let result = self.evaluator.assemble(meta, &recordings, &archive)?;
        let mut hasher = blake3::Hasher::new();
        std::fs::File::open(&archive)
            .and_then(|file| hasher.update_reader(file).map(|_| ()))
            .context("reading the dataset")?;
        let hash = hasher.finalize().to_string();
        let datasets = format!("datasets/{evaluation}");
        let key = format!("{datasets}/{}.zip", claim.nonce);
        let (store, handle) = (&self.store, &self.handle);
        handle
            .block_on(store.artifacts().put_file(&key, &archive))
            .context("storing the dataset")?;
        // After an error the dataset may be the evaluation's all the same: it stays.
        let finish = store.finish_evaluation(claim, &result, &key, &hash, self.clock.now());
        let (ended, tidied) = match handle.block_on(finish)? {
            // what finalisations left that were killed between upload and commit
            Committed::Now | Committed::Before => (
                End::Committed,
                handle.block_on(store.artifacts().delete_others(&datasets, &key)),
            ),
            // never published: no other lease names this key
            Committed::LeaseLost => (
                End::Stopped,
                handle.block_on(store.artifacts().delete(&key)),
            ),
        };
        if let Err(error) = tidied {
            tracing::warn!(%evaluation, %error, "a dataset that nobody needs is left");
        }
        Ok(ended)
    }

    /// Copies the committed recordings into folders, in order of play.
    fn recordings(&self, keys: &[String], into: &Path) -> anyhow::Result<Vec<PathBuf>> {
        let mut folders = Vec::with_capacity(keys.len());
        for (position, key) in keys.iter().enumerate() {
            let folder = into.join(format!("shard-{position:05}"));
            std::fs::create_dir(&folder).context("making a folder for a recording")?;
            self.handle
                .block_on(self.store.artifacts().get_folder(key, &folder))
                .with_context(|| format!("fetching the recording {key}"))?;
            folders.push(folder);
        }
        Ok(folders)
    }
}
