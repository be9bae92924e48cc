//! Ablations: they run behind everything that counts.

use crate::fixture::{TestStore, commit, plan};
use faceoff_store::*;
use faceoff_types::*;

/// Per profile: three tasks of four episodes in shards of two.
const SHARDS: u32 = 6;

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

    async fn request(&self, submission: SubmissionId) -> Ablation {
        let plan = RunPlan {
            max_faults: 1,
            ..plan()
        };
        self.store
            .request_ablation(Actor::Organiser, submission, &plan, self.now)
            .await
            .unwrap()
    }

    async fn newest(&self, submission: SubmissionId) -> Ablation {
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

fn unrecorded(shard: &Shard, faults: u32) -> ShardCommit {
    ShardCommit {
        recording: None,
        ..commit(shard, faults)
    }
}

#[tokio::test]
async fn ablation_runs_each_profile_and_task_once() {
    let f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    assert_eq!(f.store.newest_ablation(submission.id).await.unwrap(), None);
    let ablation = f.request(submission.id).await;
    let open = |episodes_done| AblationState::Open {
        episodes_done,
        episodes_total: 6 * 3 * 4,
    };
    assert_eq!(ablation.state, open(0));
    assert_eq!(ablation.episodes_per_task, 4);
    let mut played = Vec::new();
    for done in 0..6 * SHARDS {
        assert_eq!(f.newest(submission.id).await.state, open(done * 2));
        let (claim, run, shard) = f.claim_ablation_shard().await;
        for expected in [CommitOutcome::Stored, CommitOutcome::AlreadyStored] {
            let committed = f.commit_ablation(&claim, unrecorded(&shard, 0)).await;
            assert_eq!(committed, expected);
        }
        assert_eq!(ablation.runs[&run.plan.profile], run.id);
        played.push((run.plan.profile, shard.task, shard.first_episode));
    }
    let expected: Vec<_> = Profile::ABLATION
        .into_iter()
        .flat_map(|profile| Task::ALL.map(|task| [(profile, task, 0), (profile, task, 2)]))
        .flatten()
        .collect();
    assert_eq!(played, expected);
    assert!(f.claim().await.is_none());
    let newest = f.newest(submission.id).await;
    assert_eq!(newest.state, AblationState::Finished { finished_at: f.now });
    for run in newest.runs.into_values() {
        let outcomes = f.store.outcomes(run).await.unwrap();
        let episodes = outcomes
            .iter()
            .map(|outcome| (outcome.task, outcome.episode));
        let in_order = Task::ALL
            .into_iter()
            .flat_map(|task| (0..4).map(move |episode| (task, episode)));
        assert!(episodes.eq(in_order));
    }
}

#[tokio::test]
async fn ablation_runs_last_and_reaches_no_board() {
    let f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    f.request(submission.id).await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    for _ in 0..6 {
        let (claim, run, shard) = f.claim_shard().await;
        assert_eq!(run.id, evaluation.run);
        f.commit_shard(&claim, &shard, 0).await;
    }
    f.claim_scoring().await;
    let (claim, _, shard) = f.claim_ablation_shard().await;
    f.commit_ablation(&claim, unrecorded(&shard, 0)).await;
    let of_team = f.store.evaluations_of(evaluation.team).await.unwrap();
    assert_eq!(of_team.len(), 1, "an ablation is no evaluation");
    assert!(f.board().await.is_empty());
}

#[tokio::test]
async fn ablation_request_needs_valid_idle_submission() {
    let f = TestStore::new().await;
    let team = f.team("Alpha").await;
    let submission = f.upload(&team).await;
    let plan = plan();
    let request = |id| f.store.request_ablation(Actor::Organiser, id, &plan, f.now);
    assert!(matches!(
        request(submission.id).await,
        Err(StoreError::Conflict(_))
    ));
    f.validate().await;
    request(submission.id).await.unwrap();
    assert!(matches!(
        request(submission.id).await,
        Err(StoreError::Conflict(_))
    ));
}

#[tokio::test]
async fn ablation_failure_records_agent_or_platform_fault() {
    let mut f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    f.request(submission.id).await;
    let (claim, _, shard) = f.claim_ablation_shard().await;
    f.commit_ablation(&claim, unrecorded(&shard, 2)).await;
    assert!(f.claim().await.is_none(), "its other shards are dropped");
    let AblationState::Failed { reason, .. } = f.newest(submission.id).await.state else {
        panic!("expected a failed ablation")
    };
    assert!(reason.contains("more than 1 times with ideal"), "{reason}");

    // Another one can be requested; after a platform fault the shard is retried, then given up.
    f.later(1);
    f.request(submission.id).await;
    for _ in 0..MAX_ATTEMPTS {
        let (claim, ..) = f.claim_ablation_shard().await;
        f.store
            .release_failed(&claim, "the disk is full", f.now)
            .await
            .unwrap();
        // Until its pause is over; then it is the first in the queue again.
        f.later(120);
    }
    let AblationState::Failed { reason, .. } = f.newest(submission.id).await.state else {
        panic!("expected a failed ablation")
    };
    assert_eq!(reason, "the disk is full");
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn ablation_commit_with_gap_or_recording_is_refused() {
    let f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    f.request(submission.id).await;
    let (claim, _, shard) = f.claim_ablation_shard().await;
    let mut short = unrecorded(&shard, 0);
    short.outcomes.pop();
    for bad in [short, commit(&shard, 0)] {
        let refused = f.store.commit_shard(&claim, bad, f.now).await;
        assert!(matches!(refused, Err(StoreError::Conflict(_))));
    }
}
