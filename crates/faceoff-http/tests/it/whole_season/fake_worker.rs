//! A fake worker: outcomes of episodes are random numbers that depend on the agent's strength. Apart from that it works
//! like a real worker: it claims jobs, commits results and scores evaluations.

use crate::site::{LEASE_S, Site, score_outcomes};
use faceoff_airhockey::{EE, JOINT_VEL, LEFT_TABLE};
use faceoff_store::{ClaimedJob, Job, RunOwner};
use faceoff_testkit::{shard_commit, shard_outcomes, valid_outcome};
use faceoff_types::{ComputationTime, EpisodeEnd, EpisodeOutcome, EvaluationId, RunId, Task};
use std::collections::HashMap;

/// Pseudo-random numbers by the algorithm SplitMix64; the same for the same seed.
struct Random(u64);

impl Random {
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

/// A random outcome of an episode. Computation times have all digits, so that rows are as long as real ones.
fn random_outcome(
    task: Task,
    episode: u32,
    solved_per_mille: u64,
    random: &mut Random,
) -> EpisodeOutcome {
    let success = random.below(1000) < solved_per_mille;
    let mean_s = 1e-4 + random.below(1 << 40) as f64 * 1e-16;
    EpisodeOutcome {
        task,
        episode,
        steps: 40 + random.below(460) as u32,
        end: if success {
            LEFT_TABLE
        } else {
            EpisodeEnd::HORIZON
        },
        success,
        violations: [(EE, random.one_in(40)), (JOINT_VEL, random.one_in(25))]
            .into_iter()
            .collect(),
        computation_time: ComputationTime {
            mean_s,
            max_s: mean_s * 7.3,
        },
        fault: None,
    }
}

/// A fake worker, with the outcomes of runs that are not scored yet.
#[derive(Default)]
pub struct FakeWorker {
    /// Outcomes of runs whose scoring job has not been performed yet.
    unscored: HashMap<RunId, Vec<EpisodeOutcome>>,
    /// The number of evaluations that this worker has scored so far.
    pub scored: usize,
}

impl FakeWorker {
    /// Performs the validation runs, which come before all other jobs in the queue.
    pub async fn perform_validations(&mut self, site: &Site) {
        while let Some(claimed) = site
            .store
            .claim("fake-worker", LEASE_S, site.now())
            .await
            .unwrap()
        {
            if !matches!(claimed.job, Job::Validation { .. }) {
                let released = site.store.release(&claimed.claim, site.now());
                return released.await.unwrap();
            }
            self.perform(site, claimed).await;
        }
    }

    /// Performs jobs until the queue is empty, or `max_evaluations` evaluations are scored.
    pub async fn work(&mut self, site: &Site, max_evaluations: usize) {
        let target = self.scored + max_evaluations;
        while self.scored < target {
            let claimed = site
                .store
                .claim("fake-worker", LEASE_S, site.now())
                .await
                .unwrap();
            let Some(claimed) = claimed else { return };
            self.perform(site, claimed).await;
        }
    }

    async fn perform(&mut self, site: &Site, ClaimedJob { claim, job }: ClaimedJob) {
        match job {
            Job::Validation { submission, .. } => {
                let agent_name = submission.bundle.file_name.replace(".tar.gz", "");
                let outcome = valid_outcome("native", &agent_name, &"ready\n".repeat(20));
                let committed = site.store.commit_validation(&claim, outcome, site.now());
                committed.await.unwrap();
            }
            Job::Shard {
                owner,
                run,
                shard,
                bundle,
                ..
            } => {
                assert!(
                    !matches!(owner, RunOwner::Ablation(_)),
                    "the test starts no ablation"
                );
                // An agent solves about as many episodes every day, but not the same ones.
                let solved_per_mille = 300 + u64::from(bundle.blake3.as_bytes()[0]) * 2;
                let seed = u128::from_le_bytes(*shard.id.as_uuid().as_bytes()) as u64;
                let mut random = Random(seed);
                let outcomes = shard_outcomes(&shard, |task, episode| {
                    random_outcome(task, episode, solved_per_mille, &mut random)
                });
                let run_outcomes = self.unscored.entry(run.id).or_default();
                run_outcomes.extend(outcomes.iter().cloned());
                let recording = run.keeps_recordings.then(|| claim.recording_key(run.id));
                let commit = shard_commit(outcomes, recording);
                site.store
                    .commit_shard(&claim, commit, site.now())
                    .await
                    .unwrap();
            }
            Job::Scoring {
                evaluation,
                run,
                seeds,
                ..
            } => {
                let outcomes = self
                    .unscored
                    .remove(&run.id)
                    .expect("the shards of the run were performed before");
                let result = score_outcomes(&run, seeds.episodes, &outcomes);
                self.publish(site, &claim, evaluation, &result).await;
            }
            Job::Game { .. } => panic!("the season has no tournament"),
        }
    }

    async fn publish(
        &mut self,
        site: &Site,
        claim: &faceoff_store::JobClaim,
        evaluation: EvaluationId,
        result: &faceoff_types::EvaluationResult,
    ) {
        site.commit_evaluation(claim, evaluation, result).await;
        self.scored += 1;
    }
}
