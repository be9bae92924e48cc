//! The server of the slots of its own process: the one place of this crate that works the store's
//! queue.

use crate::{
    full_disk::{self, Pause},
    server::{Claimed, GameShow, GivenBack, Holding, QueueMark, WorkServer},
    tidying,
};
use faceoff_store::{
    Artifacts, Claim, Claimed as Leased, Committed, GameCommit, GameRecording, Lot, RunOwner,
    ShardCommit, Store, StoreError, Work,
};
use faceoff_types::{AgentLimits, BundleRef, Clock, EvaluationResult, GameId, StageLimits};
use faceoff_wire::{
    game::GameSpec,
    work::{
        AgentOrder, Assignment, EvaluationMeta, Keeps, Lease, ShardSpec, SmokeSpec, StoredGame,
        WorkOrder, WorkReport,
    },
};
use std::{path::Path, time::Duration};
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;

/// A store, and what the organiser has configured for all orders.
#[derive(Debug, Clone)]
pub(crate) struct LocalServer {
    pub(crate) store: Store,
    pub(crate) runtime: Handle,
    pub(crate) clock: Clock,
    /// How long a claim lasts without renewal, seconds.
    pub(crate) lease_s: u32,
    pub(crate) limits: AgentLimits,
    pub(crate) pause: Pause,
    /// Which work its slots ask for.
    pub(crate) lot: Lot,
}

impl LocalServer {
    /// Ends the leases of a worker that is dead: its units need not wait for them to run out.
    pub(crate) async fn end_leases_of(&self, worker: &str) -> Result<u64, StoreError> {
        self.store.end_leases_of(worker, self.clock.now()).await
    }

    /// Is a lease's unit still its holder's?
    pub(crate) fn is_held(&self, lease: &Lease) -> anyhow::Result<bool> {
        let held = self.store.is_held(lease.unit, lease.nonce);
        Ok(self.runtime.block_on(held)?)
    }

    fn order(&self, leased: Leased) -> WorkOrder {
        let Leased { claim, work } = leased;
        let assignment = match work {
            Work::Smoke {
                submission,
                seeds,
                limits,
                runtimes,
            } => Assignment::Smoke {
                submission: submission.id,
                agent: self.agent(submission.bundle, &limits),
                spec: SmokeSpec {
                    seed: seeds.episodes,
                    mismatch_seed: seeds.mismatch,
                },
                runtimes,
            },
            Work::Shard {
                owner,
                run,
                shard,
                bundle,
                seeds,
                platform_retries,
            } => Assignment::Play {
                part_of: match owner {
                    RunOwner::Evaluation(id) => id.as_uuid(),
                    RunOwner::Ablation(id) => id.as_uuid(),
                    RunOwner::Draft { id, .. } => id.as_uuid(),
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
                keeps: match owner {
                    _ if run.keeps_recordings => Keeps::Recording(claim.recording_key(run.id)),
                    RunOwner::Ablation(id) => Keeps::Clips(Artifacts::ablation_part(
                        id,
                        run.plan.profile,
                        shard.task,
                        shard.first_episode,
                    )),
                    RunOwner::Evaluation(_) | RunOwner::Draft { .. } => Keeps::Nothing,
                },
            },
            Work::Game {
                game,
                rules,
                bundles,
                seeds,
                attempt,
                platform_retries,
                keeps_recording,
            } => Assignment::Game {
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
                },
                recording: keeps_recording.then(|| game_recording_key(game, &claim)),
            },
            Work::Finalise {
                evaluation,
                run,
                recordings,
                agent_name,
                seeds,
            } => Assignment::Finalise {
                evaluation,
                meta: EvaluationMeta {
                    profile: run.plan.profile,
                    seed: seeds.episodes,
                    mismatch_seed: seeds.mismatch,
                    agent: agent_name,
                    ruleset: run.ruleset,
                    variation: run.plan.variation,
                },
                recordings,
                dataset: format!("datasets/{evaluation}/{}.zip", claim.nonce),
            },
        };
        let lease = Lease {
            unit: claim.unit,
            nonce: claim.nonce,
            slot: claim.worker,
            expires_at: claim.lease_until,
            duration_s: self.lease_s,
        };
        WorkOrder { lease, assignment }
    }

    fn agent(&self, bundle: BundleRef, own: &StageLimits) -> AgentOrder {
        AgentOrder {
            bundle,
            limits: own.over(&self.limits),
        }
    }

    /// A lost lease's recording is removed; after an error nobody knows whether the commit stands, and
    /// it is left.
    async fn commit_played(&self, claim: &Claim, played: ShardCommit) -> anyhow::Result<Holding> {
        let recording = played.recording.clone();
        let committed = self.store.commit_shard(claim, played, self.clock.now());
        let holding = holding(committed.await?);
        if holding == Holding::Lost
            && let Some(recording) = recording
            && let Err(error) = self.store.artifacts().delete_folder(&recording).await
        {
            tracing::warn!(recording, %error, "the recording of a lost lease is left");
        }
        Ok(holding)
    }

    /// As [`commit_played`](Self::commit_played). Of a game's recordings only the one of the attempt that counts is kept: what
    /// earlier attempts left that were killed between upload and commit, or whose result was voided, goes once another
    /// result stands.
    async fn commit_game(&self, claim: &Claim, played: GameCommit) -> anyhow::Result<Holding> {
        let committed = self
            .store
            .commit_game(claim, &played, self.clock.now())
            .await?;
        let artifacts = self.store.artifacts();
        let key = played.recording.map(|recording| recording.key);
        if let Some(key) = key {
            let tidied = match (committed, key.rsplit_once('/')) {
                (Committed::Now, Some((of_the_game, _))) => {
                    artifacts.delete_others(of_the_game, &key).await
                }
                // Of one that was repeated nobody knows what began since.
                (Committed::Now | Committed::Before, _) => Ok(()),
                (Committed::LeaseLost, _) => artifacts.delete_folder(&key).await,
            };
            if let Err(error) = tidied {
                tracing::warn!(key, %error, "a game's recording that nobody needs is left");
            }
        }
        Ok(holding(committed))
    }

    /// Publishes the dataset. It is removed only when it certainly was not published; after an error
    /// it may have been, and then the next finalisation, if there is one, removes it.
    async fn commit_finalised(
        &self,
        claim: &Claim,
        dataset: &str,
        blake3: &str,
        result: &EvaluationResult,
    ) -> anyhow::Result<Holding> {
        let finished =
            self.store
                .finish_evaluation(claim, result, dataset, blake3, self.clock.now());
        let holding = holding(finished.await?);
        let artifacts = self.store.artifacts();
        let tidied = match (holding, dataset.rsplit_once('/')) {
            // what finalisations left that were killed between upload and commit
            (Holding::Held, Some((datasets, _))) => {
                artifacts.delete_others(datasets, dataset).await
            }
            (Holding::Held, None) => Ok(()),
            // no other lease names this key
            (Holding::Lost, _) => artifacts.delete_dataset(dataset).await,
        };
        if let Err(error) = tidied {
            tracing::warn!(dataset, %error, "a dataset that nobody needs is left");
        }
        Ok(holding)
    }
}

impl WorkServer for LocalServer {
    fn claim(&self, slot: &str) -> anyhow::Result<Claimed> {
        let queue = QueueMark(*self.store.work_signal().borrow());
        self.runtime.block_on(async {
            let now = self.clock.now();
            if self.pause.holds(&self.store, self.lease_s, now).await? {
                return Ok(Claimed::Nothing { queue });
            }
            let claimed = self
                .store
                .claim_of(self.lot, slot, self.lease_s, now)
                .await?;
            self.store.looked_for_work(now);
            Ok(match claimed {
                Some(leased) => Claimed::Order(Box::new(self.order(leased))),
                None => Claimed::Nothing { queue },
            })
        })
    }

    fn renew(&self, lease: &Lease, episodes_done: u32) -> anyhow::Result<Holding> {
        let claim = claim(lease);
        let renewed = self
            .store
            .heartbeat(&claim, episodes_done, self.lease_s, self.clock.now());
        Ok(if self.runtime.block_on(renewed)? {
            Holding::Held
        } else {
            Holding::Lost
        })
    }

    fn show(&self, _: &Lease, (game, attempt): (GameId, u32), show: GameShow) {
        let live = self.store.live_games();
        match show {
            GameShow::Begun { steps } => live.begin(game, attempt, steps),
            GameShow::Goes {
                happenings,
                position,
            } => live.advance(game, attempt, happenings, Some(position)),
            GameShow::Over => live.over(game, attempt),
        }
    }

    fn commit(&self, lease: &Lease, report: WorkReport) -> anyhow::Result<Holding> {
        let (claim, now) = (claim(lease), self.clock.now());
        self.runtime.block_on(async {
            match report {
                WorkReport::Smoke(outcome) => {
                    let holding = holding(self.store.commit_smoke(&claim, outcome, now).await?);
                    tidying::remove_refused(&self.store, now).await;
                    Ok(holding)
                }
                WorkReport::Play {
                    outcomes,
                    log,
                    stopped_by_faults,
                    recording,
                } => {
                    let played = ShardCommit {
                        outcomes,
                        log,
                        stopped_by_faults,
                        recording,
                    };
                    self.commit_played(&claim, played).await
                }
                WorkReport::Game {
                    score,
                    recording,
                    logs,
                } => {
                    let recording = recording.map(stored_game);
                    let played = GameCommit {
                        score,
                        recording,
                        logs,
                    };
                    self.commit_game(&claim, played).await
                }
                WorkReport::Finalise {
                    dataset,
                    blake3,
                    result,
                } => {
                    self.commit_finalised(&claim, &dataset, &blake3, &result)
                        .await
                }
            }
        })
    }

    fn give_back(&self, lease: &Lease, why: GivenBack<'_>) -> anyhow::Result<()> {
        let (claim, now) = (claim(lease), self.clock.now());
        Ok(self.runtime.block_on(async {
            match why {
                GivenBack::Shutdown => self.store.release(&claim, now).await,
                GivenBack::FullDisk => self.store.release_full(&claim, now).await,
                GivenBack::PlatformFault(reason) => {
                    self.store.release_failed(&claim, reason, now).await
                }
            }
        })?)
    }

    fn met_full_disk(&self, error: &anyhow::Error) -> bool {
        // Whatever fails while there is no room may fail for that: it is to be tried again with room.
        full_disk::is_told_by(error) || self.store.room().is_short()
    }

    fn wait(&self, stop: &CancellationToken, at_most: Duration, queue: Option<QueueMark>) {
        let mut signal = self.store.work_signal();
        let grown = async {
            match queue {
                Some(QueueMark(seen)) => drop(signal.wait_for(|mark| *mark != seen).await),
                None => std::future::pending().await,
            }
        };
        self.runtime.block_on(async {
            tokio::select! {
                () = stop.cancelled() => {}
                () = grown => {}
                () = tokio::time::sleep(at_most) => {}
            }
        });
    }

    fn fetch_bundle(&self, bundle: &BundleRef, archive: &Path) -> anyhow::Result<()> {
        let fetched = self.store.artifacts().get_to_file(&bundle.key, archive);
        Ok(self.runtime.block_on(fetched)?)
    }

    fn fetch_recording(&self, key: &str, folder: &Path) -> anyhow::Result<()> {
        let fetched = self.store.artifacts().get_folder(key, folder);
        Ok(self.runtime.block_on(fetched)?)
    }

    fn store_recording(&self, key: &str, folder: &Path) -> anyhow::Result<()> {
        let artifacts = self.store.artifacts();
        self.runtime.block_on(async {
            let stored = artifacts.put_folder(key, folder).await;
            // Nobody will name a part of a recording, and it takes room that may be wanting.
            if stored.is_err()
                && let Err(error) = artifacts.delete_folder(key).await
            {
                tracing::warn!(key, %error, "a part of a recording is left");
            }
            Ok(stored?)
        })
    }

    fn store_clips(&self, key: &str, clips: &Path) -> anyhow::Result<()> {
        let stored = self.store.artifacts().put_file(key, clips);
        Ok(self.runtime.block_on(stored)?)
    }

    fn store_dataset(&self, key: &str, archive: &Path, clips: Option<&Path>) -> anyhow::Result<()> {
        let stored = self.store.artifacts().put_dataset(key, archive, clips);
        Ok(self.runtime.block_on(stored)?)
    }
}

/// Artifact key prefix for the recording that is made under a lease: each has its own, as those of shards.
fn game_recording_key(game: GameId, claim: &Claim) -> String {
    format!("games/{game}/{}", claim.nonce)
}

fn stored_game(stored: StoredGame) -> GameRecording {
    let StoredGame {
        key,
        game_blake3,
        side_blake3,
    } = stored;
    GameRecording {
        key,
        game_blake3,
        side_blake3,
    }
}

fn claim(lease: &Lease) -> Claim {
    Claim {
        unit: lease.unit,
        nonce: lease.nonce,
        worker: lease.slot.clone(),
        lease_until: lease.expires_at,
    }
}

fn holding(committed: Committed) -> Holding {
    match committed {
        Committed::Now | Committed::Before => Holding::Held,
        Committed::LeaseLost => Holding::Lost,
    }
}
