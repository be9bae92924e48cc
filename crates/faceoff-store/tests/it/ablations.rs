//! Ablations: ordered, played behind everything else, and never in the way of what counts.

use crate::fixture::{Fixture, outcome, plan};
use faceoff_store::*;
use faceoff_types::*;

const EPISODES: u32 = 2;

impl Fixture {
    async fn claim_run(&self) -> (Claim, AblationRun) {
        match self.claim().await {
            Some(Work::Ablation { claim, run, bundle }) => {
                assert_eq!(bundle, crate::fixture::bundle());
                (claim, run)
            }
            other => panic!("expected a run of an ablation, claimed {other:?}"),
        }
    }

    async fn order(&self, submission: SubmissionId) -> Ablation {
        self.store
            .create_ablation(submission, EPISODES, 1, self.now)
            .await
            .unwrap()
    }

    async fn newest(&self, submission: SubmissionId) -> Ablation {
        let newest = self.store.newest_ablation(submission).await.unwrap();
        newest.expect("an ablation")
    }
}

fn outcomes(run: &AblationRun) -> Vec<EpisodeOutcome> {
    (0..run.episodes)
        .map(|episode| outcome(run.task, episode, false))
        .collect()
}

#[tokio::test]
async fn every_profile_and_task_is_played_once_and_then_it_is_finished() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    assert_eq!(f.store.newest_ablation(submission.id).await.unwrap(), None);
    let ordered = f.order(submission.id).await;
    let total = 6 * 3 * EPISODES;
    let open = |episodes_done| AblationState::Open {
        episodes_done,
        episodes_total: total,
    };
    assert_eq!(ordered.state, open(0));
    let mut played = Vec::new();
    for done in 0..6 * 3 {
        assert_eq!(f.newest(submission.id).await.state, open(done * EPISODES));
        let (claim, run) = f.claim_run().await;
        let outcomes = outcomes(&run);
        for expected in [Committed::Now, Committed::Before] {
            let committed = f
                .store
                .commit_ablation_run(&claim, Some(&outcomes), f.now)
                .await
                .unwrap();
            assert_eq!(committed, expected);
        }
        played.push((run.profile, run.task));
    }
    let expected: Vec<_> = Profile::ABLATION
        .into_iter()
        .flat_map(|profile| Task::ALL.map(|task| (profile, task)))
        .collect();
    assert_eq!(played, expected);
    assert!(f.claim().await.is_none());
    let newest = f.newest(submission.id).await;
    assert_eq!(newest.state, AblationState::Finished { finished_at: f.now });
    let runs = f.store.ablation_outcomes(newest.id).await.unwrap();
    assert_eq!(runs.len(), 6);
    let episodes: Vec<_> = runs[&Profile::Ideal]
        .iter()
        .map(|outcome| (outcome.task, outcome.episode))
        .collect();
    assert_eq!(
        episodes,
        Task::ALL
            .into_iter()
            .flat_map(|task| (0..EPISODES).map(move |episode| (task, episode)))
            .collect::<Vec<_>>()
    );
}

#[tokio::test]
async fn it_waits_behind_what_counts_takes_no_turn_and_reaches_no_board() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    f.order(submission.id).await;
    let evaluation = f
        .store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .expect("the day's turn is free");
    for _ in 0..6 {
        let (claim, _, shard) = f.claim_shard().await;
        f.play(&claim, &shard, 0).await;
    }
    assert!(matches!(f.claim().await, Some(Work::Finalise { .. })));
    let (claim, run) = f.claim_run().await;
    let outcomes = outcomes(&run);
    f.store
        .commit_ablation_run(&claim, Some(&outcomes), f.now)
        .await
        .unwrap();
    let of_team = f.store.evaluations_of(evaluation.team).await.unwrap();
    assert_eq!(of_team.len(), 1, "an ablation is no evaluation");
    assert!(f.store.board().await.unwrap().is_empty());
}

#[tokio::test]
async fn one_is_ordered_at_a_time_and_of_valid_submissions_only() {
    let f = Fixture::new().await;
    let team = f.team("Alpha").await;
    let submission = f.upload(&team).await;
    let order = |id| f.store.create_ablation(id, EPISODES, 1, f.now);
    assert!(matches!(
        order(submission.id).await,
        Err(StoreError::Conflict(_))
    ));
    f.validate().await;
    order(submission.id).await.unwrap();
    assert!(matches!(
        order(submission.id).await,
        Err(StoreError::Conflict(_))
    ));
}

#[tokio::test]
async fn faults_of_the_agent_and_of_ours_end_it_with_a_reason() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    f.order(submission.id).await;
    let (claim, _) = f.claim_run().await;
    f.store
        .commit_ablation_run(&claim, None, f.now)
        .await
        .unwrap();
    assert!(f.claim().await.is_none(), "its other runs are dropped");
    let AblationState::Failed { reason, .. } = f.newest(submission.id).await.state else {
        panic!("it failed")
    };
    assert!(
        reason.contains("more than 1 times in hit with ideal"),
        "{reason}"
    );

    // A later one may be ordered; a fault of ours is tried again, then given up.
    f.later(1);
    f.order(submission.id).await;
    for _ in 0..MAX_ATTEMPTS {
        let (claim, _) = f.claim_run().await;
        f.store
            .release_failed(&claim, "the disk is full", f.now)
            .await
            .unwrap();
        // Until its rest is over; then it is the first in the queue again.
        f.later(120);
    }
    let AblationState::Failed { reason, .. } = f.newest(submission.id).await.state else {
        panic!("it was given up")
    };
    assert_eq!(reason, "the disk is full");
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn a_commit_that_does_not_cover_its_run_is_refused() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    f.order(submission.id).await;
    let (claim, run) = f.claim_run().await;
    let one = &outcomes(&run)[..1];
    let refused = f.store.commit_ablation_run(&claim, Some(one), f.now).await;
    assert!(matches!(refused, Err(StoreError::Conflict(_))));
}
