//! A worker that plays nothing: its episodes end as numbers drawn from the agent's strength say. All else of its
//! work is a worker's: it claims, commits and scores.

use crate::site::{Site, scored};
use faceoff_store::{Claimed, RunOwner, ShardCommit, Work};
use faceoff_types::{
    ComputationTime, EpisodeEnd, EpisodeOutcome, EvaluationId, RunId, SmokeOutcome, Task,
    Violations,
};
use std::collections::HashMap;

/// The numbers of one episode, the same for the same seed.
struct Draws(u64);

impl Draws {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) % bound
    }

    fn one_in(&mut self, count: u64) -> bool {
        self.below(count) == 0
    }
}

/// As long as a real one in the database: computation times have all their digits.
fn episode(task: Task, episode: u32, solved_per_mille: u64, draws: &mut Draws) -> EpisodeOutcome {
    let success = draws.below(1000) < solved_per_mille;
    let mean_s = 1e-4 + draws.below(1 << 40) as f64 * 1e-16;
    EpisodeOutcome {
        task,
        episode,
        steps: 40 + draws.below(460) as u32,
        end: if success {
            EpisodeEnd::LeftTable
        } else {
            EpisodeEnd::Horizon
        },
        success,
        violations: Violations {
            ee: draws.one_in(40),
            joint_vel: draws.one_in(25),
            ..Violations::default()
        },
        computation_time: ComputationTime {
            mean_s,
            max_s: mean_s * 7.3,
        },
        fault: None,
    }
}

/// What it has played of runs that are not scored yet.
#[derive(Default)]
pub struct StandIn {
    played: HashMap<RunId, Vec<EpisodeOutcome>>,
    /// How many evaluations it has scored.
    pub scored: usize,
}

impl StandIn {
    /// Checks what was uploaded, which comes before all other work.
    pub async fn check_uploads(&mut self, site: &Site) {
        while let Some(claimed) = site.store.claim("stand-in", 60, site.now()).await.unwrap() {
            if !matches!(claimed.work, Work::Smoke { .. }) {
                let released = site.store.release(&claimed.claim, site.now());
                return released.await.unwrap();
            }
            self.perform(site, claimed).await;
        }
    }

    /// Works until nothing is left, or `at_most` evaluations are scored.
    pub async fn work(&mut self, site: &Site, at_most: usize) {
        let enough = self.scored + at_most;
        while self.scored < enough {
            let claimed = site.store.claim("stand-in", 60, site.now()).await.unwrap();
            let Some(claimed) = claimed else { return };
            self.perform(site, claimed).await;
        }
    }

    async fn perform(&mut self, site: &Site, Claimed { claim, work }: Claimed) {
        match work {
            Work::Smoke { submission, .. } => {
                let agent_name = submission.bundle.file_name.replace(".tar.gz", "");
                let outcome = SmokeOutcome::Valid {
                    agent_name,
                    runtime: "native".into(),
                    timing: Vec::new(),
                    log: "ready\n".repeat(20),
                };
                let committed = site.store.commit_smoke(&claim, outcome, site.now());
                committed.await.unwrap();
            }
            Work::Shard {
                owner,
                run,
                shard,
                bundle,
                ..
            } => {
                assert!(!matches!(owner, RunOwner::Ablation(_)), "none was ordered");
                // The same agent is as strong on every day, and solves other episodes.
                let strength = 300 + u64::from(bundle.blake3.as_bytes()[0]) * 2;
                let first = u128::from_le_bytes(*shard.id.as_uuid().as_bytes()) as u64;
                let mut draws = Draws(first);
                let outcomes: Vec<_> = (shard.first_episode..shard.end_episode)
                    .map(|number| episode(shard.task, number, strength, &mut draws))
                    .collect();
                let of_run = self.played.entry(run.id).or_default();
                of_run.extend(outcomes.iter().cloned());
                let commit = ShardCommit {
                    outcomes,
                    log: String::new(),
                    stopped_by_faults: false,
                    recording: run.keeps_recordings.then(|| claim.recording_key(run.id)),
                };
                site.store
                    .commit_shard(&claim, commit, site.now())
                    .await
                    .unwrap();
            }
            Work::Finalise {
                evaluation,
                run,
                seeds,
                ..
            } => {
                let outcomes = self
                    .played
                    .remove(&run.id)
                    .expect("its shards were played here");
                let result = scored(&run, seeds.episodes, &outcomes);
                self.publish(site, &claim, evaluation, &result).await;
            }
            Work::Game { .. } => panic!("the season has no tournament"),
        }
    }

    async fn publish(
        &mut self,
        site: &Site,
        claim: &faceoff_store::Claim,
        evaluation: EvaluationId,
        result: &faceoff_types::EvaluationResult,
    ) {
        site.publish(claim, evaluation, result).await;
        self.scored += 1;
    }
}
