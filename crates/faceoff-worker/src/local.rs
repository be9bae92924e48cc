//! The job server for slots of the same process: the only place of this crate that uses the store's queue.

use crate::{
    cleanup, episode_summaries,
    full_disk::{self, ClaimPause},
    game_broadcast::show_update,
    local_files::LocalFiles,
    server::{ClaimResult, JobServer, LeaseStatus, QueueVersion, ReleaseReason},
};
use faceoff_episode::Simulator;
use faceoff_live::LiveState;
use faceoff_store::{
    Artifacts, ClaimedJob, CommitOutcome, GameCommit, GameRecording, Job, JobClaim, JobFilter,
    RunOwner, RunPlan, RunSeeds, ShardCommit, Store, StoreError,
};
use faceoff_types::{
    AgentLimits, BundleRef, Clock, Competition, EvaluationResult, GameId, Magnitudes, Ruleset,
    StageLimits, StageSettings,
};
use faceoff_wire::{
    game::GameSpec,
    job::{
        AgentSpec, EvaluationMeta, GameFiles, JobPayload, JobReport, JobSpec, Lease, OutputFiles,
        ShardSpec, ValidationSpec,
    },
    remote::LiveGameUpdate,
};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;

/// The job server on a store, with the configuration for all jobs.
#[derive(Debug, Clone)]
pub(crate) struct LocalServer {
    pub(crate) store: Store,
    /// State of running games and remote workers, shown to viewers and organisers.
    pub(crate) live: LiveState,
    /// The async runtime on which the threads of slots call the store.
    pub(crate) runtime: Handle,
    pub(crate) clock: Clock,
    /// Duration of a lease without renewal, seconds.
    pub(crate) lease_s: u32,
    pub(crate) simulator: Arc<dyn Simulator>,
    /// The server's limits of agents; a stage may have others.
    pub(crate) limits: AgentLimits,
    /// Keeps slots from claiming jobs while disk space is short.
    pub(crate) claim_pause: ClaimPause,
    /// The kinds of jobs that its slots claim.
    pub(crate) job_filter: JobFilter,
}

impl LocalServer {
    /// The competition to which all jobs belong.
    pub(crate) fn competition(&self) -> &Arc<Competition> {
        self.simulator.competition()
    }

    /// Ends the leases of a worker whose process has ended, so that its jobs need not wait for their expiry.
    pub(crate) async fn end_leases_of(&self, worker: &str) -> Result<u64, StoreError> {
        self.store.end_leases_of(worker, self.clock.now()).await
    }

    /// Is the lease still valid?
    pub(crate) fn is_held(&self, lease: &Lease) -> anyhow::Result<bool> {
        let held = self.store.is_leased(lease.job_id, lease.nonce);
        Ok(self.runtime.block_on(held)?)
    }

    pub(crate) fn files(&self) -> LocalFiles {
        LocalFiles {
            artifacts: self.store.artifacts().clone(),
            runtime: self.runtime.clone(),
        }
    }

    /// A validation run under the rules of the stage to which the submission belongs, so that the agent cannot distinguish it from an
    /// evaluation. Without a stage (`None`), under the defaults of the competition.
    fn validation_spec(
        &self,
        ruleset_and_plan: Option<(Ruleset, RunPlan)>,
        seeds: RunSeeds,
    ) -> ValidationSpec {
        let competition = self.competition();
        let RunSeeds { episodes, mismatch } = seeds;
        match ruleset_and_plan {
            Some((ruleset, plan)) => ValidationSpec {
                ruleset,
                profile: plan.profile,
                perturbations: plan.variation.perturbations,
                tasks: plan.tasks,
                episodes_per_task: plan.episodes_per_task,
                episodes_per_shard: plan.episodes_per_shard,
                seed: episodes,
                mismatch_seed: mismatch,
            },
            None => {
                let episodes_per_shard = StageSettings::default().episodes_per_shard;
                ValidationSpec {
                    ruleset: competition.ruleset(),
                    profile: competition.counting_profile,
                    perturbations: Magnitudes::default(),
                    tasks: competition.task_names().collect(),
                    episodes_per_task: episodes_per_shard,
                    episodes_per_shard,
                    seed: episodes,
                    mismatch_seed: mismatch,
                }
            }
        }
    }

    fn job_spec(&self, claimed: ClaimedJob) -> JobSpec {
        let ClaimedJob { claim, job } = claimed;
        let payload = match job {
            Job::Validation {
                submission,
                seeds,
                ruleset_and_plan,
                runtimes,
            } => {
                let limits = ruleset_and_plan.as_ref().map(|both| both.1.limits.clone());
                JobPayload::Validation {
                    submission: submission.id,
                    agent: self.agent(submission.bundle, &limits.unwrap_or_default()),
                    spec: self.validation_spec(ruleset_and_plan.map(|both| *both), seeds),
                    runtimes,
                }
            }
            Job::Shard {
                owner,
                run,
                shard,
                bundle,
                seeds,
                platform_retries,
            } => JobPayload::Shard {
                part_of: match owner {
                    RunOwner::Evaluation { id, .. } => id.as_uuid(),
                    RunOwner::Ablation(id) => id.as_uuid(),
                },
                agent: self.agent(bundle, &run.plan.limits),
                spec: ShardSpec {
                    ruleset: run.ruleset,
                    platform_retries,
                    task: shard.task,
                    episodes: shard.first_episode..shard.end_episode,
                    profile: run.plan.profile,
                    seed: seeds.episodes,
                    mismatch_seed: seeds.mismatch,
                    max_faults: run.plan.max_faults,
                    perturbations: run.plan.variation.perturbations.clone(),
                },
                output: match owner {
                    _ if run.keeps_recordings => {
                        OutputFiles::Recording(claim.recording_key(run.id))
                    }
                    RunOwner::Ablation(id) => OutputFiles::Clips(Artifacts::ablation_part_key(
                        id,
                        run.plan.profile,
                        shard.task,
                        shard.first_episode,
                    )),
                    RunOwner::Evaluation { .. } => OutputFiles::None,
                },
            },
            Job::Game {
                game,
                rules,
                bundles,
                seeds,
                attempt,
                platform_retries,
                keeps_recording,
            } => JobPayload::Game {
                game,
                attempt,
                agents: Box::new(bundles.map(|bundle| self.agent(bundle, &rules.limits))),
                spec: GameSpec {
                    ruleset: rules.ruleset,
                    steps: rules.steps,
                    profile: rules.profile,
                    seed: seeds.episodes,
                    mismatch_seed: seeds.mismatch,
                    limits: rules.game_limits,
                    platform_retries,
                    perturbations: rules.perturbations,
                    forfeit_score: rules.forfeit_score,
                },
                recording: keeps_recording.then(|| game_recording_key(game, &claim)),
            },
            Job::Scoring {
                evaluation,
                run,
                recordings,
                agent_name,
                seeds,
            } => JobPayload::Scoring {
                evaluation,
                meta: EvaluationMeta {
                    profile: run.plan.profile,
                    seed: seeds.episodes,
                    mismatch_seed: seeds.mismatch,
                    agent: agent_name,
                    ruleset: run.ruleset,
                    task_weights: self.competition().weights(&run.plan.variation),
                    tiers: self.competition().tiers,
                    variation: run.plan.variation,
                },
                recordings,
                dataset: format!("datasets/{evaluation}/{}.zip", claim.nonce),
            },
        };
        let lease = Lease {
            job_id: claim.job,
            nonce: claim.nonce,
            holder: claim.holder,
            expires_at: claim.lease_until,
            duration_s: self.lease_s,
        };
        JobSpec { lease, payload }
    }

    fn agent(&self, bundle: BundleRef, stage_limits: &StageLimits) -> AgentSpec {
        AgentSpec {
            bundle,
            limits: stage_limits.apply_to(&self.limits),
        }
    }

    /// Commits a shard. The recording of a lost lease is removed. After an error the commit may still have succeeded, so
    /// the recording is left.
    async fn commit_shard(
        &self,
        claim: &JobClaim,
        commit: ShardCommit,
    ) -> anyhow::Result<LeaseStatus> {
        let (recording, now) = (commit.recording.clone(), self.clock.now());
        let status = lease_status(self.store.commit_shard(claim, commit, now).await?);
        // Runs with recordings get their summaries when they are scored. The others end with their last shard.
        if status == LeaseStatus::Held && recording.is_none() {
            episode_summaries::store_missing(&self.store, self.competition(), now).await;
        }
        if status == LeaseStatus::Lost
            && let Some(recording) = recording
            && let Err(error) = self.store.artifacts().delete_folder(&recording).await
        {
            tracing::warn!(recording, %error, "the recording of a lost lease could not be removed");
        }
        Ok(status)
    }

    /// Commits a game, as [`commit_shard`](Self::commit_shard) does. Only the recording of the counting attempt is kept.
    /// Recordings of voided results, and of attempts that were killed between upload and commit, are removed with the
    /// next result.
    async fn commit_game(
        &self,
        claim: &JobClaim,
        commit: GameCommit,
    ) -> anyhow::Result<LeaseStatus> {
        let committed = self
            .store
            .commit_game(claim, &commit, self.clock.now())
            .await?;
        let artifacts = self.store.artifacts();
        let key = commit.recording.map(|recording| recording.key);
        if let Some(key) = key {
            let cleaned = match (committed, key.rsplit_once('/')) {
                (CommitOutcome::Stored, Some((game_prefix, _))) => {
                    artifacts.delete_others(game_prefix, &key).await
                }
                // Another attempt may have started since the first commit, so no other recordings are removed.
                (CommitOutcome::Stored | CommitOutcome::AlreadyStored, _) => Ok(()),
                (CommitOutcome::LeaseLost, _) => artifacts.delete_folder(&key).await,
            };
            if let Err(error) = cleaned {
                tracing::warn!(key, %error, "an obsolete recording of a game could not be removed");
            }
        }
        Ok(lease_status(committed))
    }

    /// Commits a score and its dataset. The dataset is removed only if the commit certainly failed. After another error the
    /// dataset may be in use; if it is not, the next scoring removes it.
    async fn commit_score(
        &self,
        claim: &JobClaim,
        dataset: &str,
        blake3: &str,
        result: &EvaluationResult,
    ) -> anyhow::Result<LeaseStatus> {
        let now = self.clock.now();
        let finished = self
            .store
            .finish_evaluation(claim, result, dataset, blake3, now);
        let status = lease_status(finished.await?);
        if status == LeaseStatus::Held {
            episode_summaries::store_missing(&self.store, self.competition(), now).await;
        }
        let artifacts = self.store.artifacts();
        let cleaned = match (status, dataset.rsplit_once('/')) {
            // Removes datasets of scorings that were killed between upload and commit.
            (LeaseStatus::Held, Some((datasets, _))) => {
                artifacts.delete_others(datasets, dataset).await
            }
            (LeaseStatus::Held, None) => Ok(()),
            // The key contains the lease's nonce, so no other lease uses this dataset.
            (LeaseStatus::Lost, _) => artifacts.delete_dataset(dataset).await,
        };
        if let Err(error) = cleaned {
            tracing::warn!(dataset, %error, "an obsolete dataset could not be removed");
        }
        Ok(status)
    }
}

impl JobServer for LocalServer {
    fn claim(&self, slot: &str) -> anyhow::Result<ClaimResult> {
        let queue_version = QueueVersion(*self.store.job_signal().borrow());
        self.runtime.block_on(async {
            let now = self.clock.now();
            if self
                .claim_pause
                .is_active(&self.store, self.lease_s, now)
                .await?
            {
                return Ok(ClaimResult::Empty { queue_version });
            }
            let claimed = self
                .store
                .claim_matching(self.job_filter, slot, self.lease_s, now)
                .await?;
            self.store.record_poll(now);
            Ok(match claimed {
                Some(claimed) => ClaimResult::Job(Box::new(self.job_spec(claimed))),
                None => ClaimResult::Empty { queue_version },
            })
        })
    }

    fn renew(&self, lease: &Lease, episodes_done: u32) -> anyhow::Result<LeaseStatus> {
        let claim = to_claim(lease, &lease.holder);
        let renewed = self
            .store
            .heartbeat(&claim, episodes_done, self.lease_s, self.clock.now());
        Ok(if self.runtime.block_on(renewed)? {
            LeaseStatus::Held
        } else {
            LeaseStatus::Lost
        })
    }

    fn publish_game(&self, _: &Lease, attempt: (GameId, u32), update: LiveGameUpdate) {
        show_update(&self.live.games, attempt, update);
    }

    fn commit(&self, lease: &Lease, report: JobReport) -> anyhow::Result<LeaseStatus> {
        let (claim, now) = (to_claim(lease, &lease.holder), self.clock.now());
        self.runtime.block_on(async {
            match report {
                JobReport::Validation(outcome) => {
                    let status =
                        lease_status(self.store.commit_validation(&claim, outcome, now).await?);
                    cleanup::remove_invalid_bundles(&self.store, now).await;
                    Ok(status)
                }
                JobReport::Shard {
                    outcomes,
                    log,
                    stopped_by_faults,
                    recording,
                } => {
                    let commit = ShardCommit {
                        outcomes,
                        log,
                        stopped_by_faults,
                        recording,
                    };
                    self.commit_shard(&claim, commit).await
                }
                JobReport::Game {
                    score,
                    recording,
                    logs,
                } => {
                    let recording = recording.map(game_recording);
                    let commit = GameCommit {
                        results: score,
                        recording,
                        logs,
                    };
                    self.commit_game(&claim, commit).await
                }
                JobReport::Scoring {
                    dataset,
                    blake3,
                    result,
                } => self.commit_score(&claim, &dataset, &blake3, &result).await,
            }
        })
    }

    fn release(&self, lease: &Lease, reason: ReleaseReason<'_>) -> anyhow::Result<()> {
        let (claim, now) = (to_claim(lease, &lease.holder), self.clock.now());
        Ok(self.runtime.block_on(async {
            match reason {
                ReleaseReason::Interrupted => self.store.release(&claim, now).await,
                ReleaseReason::FullDisk => self.store.release_disk_full(&claim, now).await,
                ReleaseReason::PlatformFault(summary) => {
                    self.store
                        .release_after_platform_fault(&claim, summary, now)
                        .await
                }
            }
        })?)
    }

    fn is_full_disk(&self, error: &anyhow::Error) -> bool {
        // While the disk is short of space, that may be the cause of any failure: the job is tried again later.
        full_disk::is_cause_of(error) || self.store.free_space().is_short()
    }

    fn wait(
        &self,
        stop: &CancellationToken,
        timeout: Duration,
        queue_version: Option<QueueVersion>,
    ) {
        let mut signal = self.store.job_signal();
        let changed = async {
            match queue_version {
                Some(QueueVersion(known)) => {
                    drop(signal.wait_for(|version| *version != known).await);
                }
                None => std::future::pending().await,
            }
        };
        self.runtime.block_on(async {
            tokio::select! {
                () = stop.cancelled() => {}
                () = changed => {}
                () = tokio::time::sleep(timeout) => {}
            }
        });
    }
}

/// Artifact key prefix of a game's recording; each lease has its own, as with shards.
fn game_recording_key(game: GameId, claim: &JobClaim) -> String {
    format!("games/{game}/{}", claim.nonce)
}

fn game_recording(files: GameFiles) -> GameRecording {
    let GameFiles {
        key,
        game_blake3,
        side_blake3,
    } = files;
    GameRecording {
        key,
        game_blake3,
        side_blake3,
    }
}

/// The store's form of a lease, with `holder` as its holder.
pub(crate) fn to_claim(lease: &Lease, holder: &str) -> JobClaim {
    JobClaim {
        job: lease.job_id,
        nonce: lease.nonce,
        holder: holder.to_owned(),
        lease_until: lease.expires_at,
    }
}

fn lease_status(outcome: CommitOutcome) -> LeaseStatus {
    match outcome {
        CommitOutcome::Stored | CommitOutcome::AlreadyStored => LeaseStatus::Held,
        CommitOutcome::LeaseLost => LeaseStatus::Lost,
    }
}
