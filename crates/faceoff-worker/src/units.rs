//! The four kinds of work, each from claim to commit.

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
    AblationRun, BundleRef, Claim, Committed, Evaluation, Shard, ShardCommit, SmokeOutcome, Store,
    Submission,
};
use faceoff_types::RULESET;
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
        self.handle
            .block_on(self.store.commit_smoke(claim, outcome, self.clock.now()))?;
        Ok(End::Committed)
    }

    /// Plays a shard, uploads its recording, and only then commits it.
    pub(crate) fn shard(
        &mut self,
        claim: &Claim,
        evaluation: &Evaluation,
        shard: &Shard,
        bundle: &BundleRef,
        mut progress: Progress,
    ) -> Ended {
        let bundle = self.valid_bundle(bundle)?;
        let secret = self.handle.block_on(self.store.season())?.secret;
        let spec = ShardSpec {
            task: shard.task,
            episodes: shard.first_episode..shard.end_episode,
            profile: evaluation.plan.profile,
            seed: secret.day(evaluation.day),
            mismatch_seed: secret.model_mismatch(),
            max_faults: evaluation.plan.max_faults,
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
        let recording = claim.recording_key(evaluation.id);
        let (store, handle) = (&self.store, &self.handle);
        handle
            .block_on(store.artifacts().put_folder(&recording, out.path()))
            .context("storing the recording")?;
        let commit = ShardCommit {
            outcomes: report.outcomes,
            log: report.log,
            stopped_by_faults: report.stopped_by_faults,
            recording: recording.clone(),
        };
        match handle.block_on(store.commit_shard(claim, commit, self.clock.now()))? {
            Committed::Now | Committed::Before => Ok(End::Committed),
            Committed::LeaseLost => {
                handle
                    .block_on(store.artifacts().delete_folder(&recording))
                    .context("removing the recording of a lost lease")?;
                Ok(End::Stopped)
            }
        }
    }

    /// Plays one task of an ablation under one profile. Only the outcomes are kept.
    pub(crate) fn ablation(
        &mut self,
        claim: &Claim,
        run: &AblationRun,
        bundle: &BundleRef,
        mut progress: Progress,
    ) -> Ended {
        let bundle = self.valid_bundle(bundle)?;
        let secret = self.handle.block_on(self.store.season())?.secret;
        let spec = ShardSpec {
            task: run.task,
            episodes: 0..run.episodes,
            profile: run.profile,
            seed: secret.ablation(),
            mismatch_seed: secret.model_mismatch(),
            max_faults: run.max_faults,
        };
        let out = self.folder("recording")?;
        let played = self
            .evaluator
            .play(&spec, &bundle, &self.agent, out.path(), &mut progress);
        let report = match played {
            Ok(report) => report,
            Err(PlatformFault::Cancelled) if progress.stopped() => return Ok(End::Stopped),
            Err(fault) => return Err(fault.into()),
        };
        let outcomes = (!report.stopped_by_faults).then_some(&report.outcomes[..]);
        let committed = self
            .store
            .commit_ablation_run(claim, outcomes, self.clock.now());
        Ok(match self.handle.block_on(committed)? {
            Committed::Now | Committed::Before => End::Committed,
            Committed::LeaseLost => End::Stopped,
        })
    }

    /// Joins the shards' recordings into the dataset, scores them, and publishes both together.
    pub(crate) fn finalise(
        &mut self,
        claim: &Claim,
        evaluation: &Evaluation,
        agent_name: &str,
    ) -> Ended {
        let work = self.folder("dataset")?;
        let recordings = self.recordings(evaluation, work.path())?;
        let secret = self.handle.block_on(self.store.season())?.secret;
        let meta = EvaluationMeta {
            profile: evaluation.plan.profile,
            seed: secret.day(evaluation.day),
            mismatch_seed: secret.model_mismatch(),
            agent: agent_name.to_owned(),
            ruleset: RULESET.to_owned(),
        };
        let archive = work.path().join("dataset.zip");
        let result = self.evaluator.assemble(&meta, &recordings, &archive)?;
        let datasets = format!("datasets/{}", evaluation.id);
        let key = format!("{datasets}/{}.zip", claim.nonce);
        let (store, handle) = (&self.store, &self.handle);
        handle
            .block_on(store.artifacts().put_file(&key, &archive))
            .context("storing the dataset")?;
        let finished =
            handle.block_on(store.finish_evaluation(claim, &result, &key, self.clock.now()));
        let tidied = match &finished {
            // what finalisations left that were killed between upload and commit
            Ok(()) => handle.block_on(store.artifacts().delete_others(&datasets, &key)),
            // never published: no other lease names this key
            Err(_) => handle.block_on(store.artifacts().delete(&key)),
        };
        if let Err(error) = tidied {
            tracing::warn!(evaluation = %evaluation.id, %error, "a dataset that nobody needs is left");
        }
        finished?;
        Ok(End::Committed)
    }

    /// Copies the committed recordings into folders, in order of play.
    fn recordings(&self, evaluation: &Evaluation, into: &Path) -> anyhow::Result<Vec<PathBuf>> {
        let shards = self.handle.block_on(self.store.shards(evaluation.id))?;
        let mut folders = Vec::with_capacity(shards.len());
        for (position, shard) in shards.iter().enumerate() {
            let key = shard
                .recording
                .as_deref()
                .context("a shard is not committed")?;
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
