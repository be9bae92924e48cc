//! Ablations: runs of a submission under several profiles (sets of perturbations), in order to see which perturbations cost it
//! points. They count for no board, so workers run them after all jobs that count.

use crate::fixture::{TestStore, shard_commit, six_shard_plan};
use faceoff_airhockey::{ABLATION_PROFILES, TASKS};
use faceoff_store::*;
use faceoff_types::*;

/// Number of profiles of an ablation, each of which is a run.
const PROFILES: u32 = ABLATION_PROFILES.len() as u32;
/// Number of shards of a run: three tasks of four episodes, in shards of two episodes.
const SHARDS_PER_RUN: u32 = 6;
const EPISODES_PER_SHARD: u32 = 2;

impl TestStore {
    async fn claim_ablation_shard(&self) -> (JobClaim, Run, Shard) {
        match self.claim().await {
            Some(ClaimedJob {
                claim,
                job:
                    Job::Shard {
                        owner: RunOwner::Ablation(_),
                        run,
                        shard,
                        bundle,
                        seeds,
                        ..
                    },
            }) => {
                assert_eq!(bundle, crate::fixture::bundle());
                let secret = self.store.season().await.unwrap().secret;
                assert_eq!(seeds.episodes, secret.ablation());
                assert!(!run.keeps_recordings);
                (claim, run, shard)
            }
            other => panic!("expected a shard of an ablation, claimed {other:?}"),
        }
    }

    /// Requests an ablation, whose runs end at the second agent fault.
    async fn request_ablation(&self, submission: SubmissionId) -> Ablation {
        let plan = RunPlan {
            max_faults: 1,
            ..six_shard_plan()
        };
        self.store
            .request_ablation(
                Actor::Operator,
                submission,
                faceoff_airhockey::RULESET,
                &plan,
                &ABLATION_PROFILES,
                self.now,
            )
            .await
            .unwrap()
    }

    async fn newest_ablation(&self, submission: SubmissionId) -> Ablation {
        let newest = self.store.newest_ablation(submission).await.unwrap();
        newest.expect("an ablation")
    }

    async fn commit_ablation(&self, claim: &JobClaim, commit: ShardCommit) -> CommitOutcome {
        self.store
            .commit_shard(claim, commit, self.now)
            .await
            .unwrap()
    }
}

/// The commit of a shard without a recording, as for an ablation.
fn unrecorded_commit(shard: &Shard, faults: u32) -> ShardCommit {
    ShardCommit {
        recording: None,
        ..shard_commit(shard, faults)
    }
}

#[tokio::test]
async fn ablation_runs_each_profile_and_task_once() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    assert_eq!(f.store.newest_ablation(submission.id).await.unwrap(), None);
    let ablation = f.request_ablation(submission.id).await;
    let episodes_done = |state: AblationState| match state {
        AblationState::Unfinished {
            progress,
            episodes_total,
        } => {
            assert_eq!(
                episodes_total,
                PROFILES * SHARDS_PER_RUN * EPISODES_PER_SHARD
            );
            progress.episodes_done
        }
        other => panic!("{other:?}"),
    };
    assert_eq!(episodes_done(ablation.state), 0);
    assert_eq!(ablation.episodes_per_task, 4);
    let mut played = Vec::new();
    for shards_done in 0..PROFILES * SHARDS_PER_RUN {
        let state = f.newest_ablation(submission.id).await.state;
        assert_eq!(episodes_done(state), shards_done * EPISODES_PER_SHARD);
        let (claim, run, shard) = f.claim_ablation_shard().await;
        for expected in [CommitOutcome::Stored, CommitOutcome::AlreadyStored] {
            let committed = f
                .commit_ablation(&claim, unrecorded_commit(&shard, 0))
                .await;
            assert_eq!(committed, expected);
        }
        assert_eq!(ablation.runs[&run.plan.profile], run.id);
        played.push((run.plan.profile, shard.task, shard.first_episode));
    }
    let expected: Vec<_> = ABLATION_PROFILES
        .into_iter()
        .flat_map(|profile| TASKS.map(|task| [(profile, task, 0), (profile, task, 2)]))
        .flatten()
        .collect();
    // The order within a profile is drawn.
    played.sort_unstable_by_key(|played| expected.iter().position(|other| other == played));
    assert_eq!(played, expected);
    assert!(f.claim().await.is_none());
    let newest = f.newest_ablation(submission.id).await;
    assert_eq!(newest.state, AblationState::Finished { finished_at: f.now });
    for run in newest.runs.into_values() {
        let outcomes = f.store.outcomes(run).await.unwrap();
        let episodes = outcomes
            .iter()
            .map(|outcome| (outcome.task, outcome.episode));
        let in_order = TASKS
            .into_iter()
            .flat_map(|task| (0..4).map(move |episode| (task, episode)));
        assert!(episodes.eq(in_order));
    }
}

#[tokio::test]
async fn ablation_runs_last_and_reaches_no_board() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    f.request_ablation(submission.id).await;
    let evaluation = f.evaluate(submission.id, &six_shard_plan()).await;
    for _ in 0..SHARDS_PER_RUN {
        let (claim, run, shard) = f.claim_shard().await;
        assert_eq!(run.id, evaluation.run);
        f.commit_shard(&claim, &shard).await;
    }
    f.claim_scoring().await;
    let (claim, _, shard) = f.claim_ablation_shard().await;
    f.commit_ablation(&claim, unrecorded_commit(&shard, 0))
        .await;
    let evaluations = f.store.evaluations_of(evaluation.team).await.unwrap();
    assert_eq!(evaluations.len(), 1, "an ablation is no evaluation");
    assert!(f.board().await.is_empty());
}

#[tokio::test]
async fn ablation_failure_records_agent_or_platform_fault() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    f.request_ablation(submission.id).await;
    let (claim, _, shard) = f.claim_ablation_shard().await;
    f.commit_ablation(&claim, unrecorded_commit(&shard, 2))
        .await;
    assert!(
        f.claim().await.is_none(),
        "the ablation's other shards are dropped"
    );
    let AblationState::Failed { reason, .. } = f.newest_ablation(submission.id).await.state else {
        panic!("expected a failed ablation")
    };
    assert!(reason.contains("more than 1 times with ideal"), "{reason}");

    // Another ablation can be requested. After a platform fault its shard is retried; after the last attempt the ablation fails.
    f.advance_clock_s(1);
    f.request_ablation(submission.id).await;
    for _ in 0..MAX_PLATFORM_FAULTS {
        let (claim, ..) = f.claim_ablation_shard().await;
        f.store
            .release_after_platform_fault(&claim, "the disk is full", f.now)
            .await
            .unwrap();
        // After this delay the shard can be claimed again.
        f.advance_clock_s(120);
    }
    let AblationState::Failed { reason, .. } = f.newest_ablation(submission.id).await.state else {
        panic!("expected a failed ablation")
    };
    assert_eq!(reason, "the disk is full");
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn ablation_commit_with_gap_or_recording_is_refused() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    f.request_ablation(submission.id).await;
    let (claim, _, shard) = f.claim_ablation_shard().await;
    let mut with_gap = unrecorded_commit(&shard, 0);
    with_gap.outcomes.pop();
    let recorded = shard_commit(&shard, 0);
    for bad in [with_gap, recorded] {
        let result = f.store.commit_shard(&claim, bad, f.now).await;
        assert!(matches!(result, Err(StoreError::Conflict(_))));
    }
}
