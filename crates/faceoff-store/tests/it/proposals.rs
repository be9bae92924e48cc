//! Proposals of organisers. A *trial* evaluates the active submissions outside of any day and never counts. A *re-evaluation*
//! evaluates a day or an evaluation again; its results replace the earlier ones once the proposal is applied.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

const REASON: &str = "the camera was dirty";

async fn propose_trial(f: &TestStore, stage: StageId) -> Result<Proposal, StoreError> {
    f.store
        .propose_trial(Actor::Operator, stage, None, REASON, f.now)
        .await
}

async fn propose_reevaluation(f: &TestStore, scope: Reevaluation) -> Result<Proposal, StoreError> {
    f.store
        .propose_reevaluation(Actor::Operator, scope, REASON, f.now)
        .await
}

async fn apply(f: &TestStore, id: ProposalId) -> Result<Proposal, StoreError> {
    f.store.apply_proposal(Actor::Operator, id, f.now).await
}

async fn discard(f: &TestStore, id: ProposalId) -> Result<Proposal, StoreError> {
    f.store.drop_proposal(Actor::Operator, id, f.now).await
}

async fn proposed_evaluations(f: &TestStore, id: ProposalId) -> Vec<ProposedEvaluation> {
    f.store.proposal(id).await.unwrap().1
}

/// Teams and scores of the board.
async fn board_rows(f: &TestStore) -> Vec<(String, f64)> {
    let board = f.board().await;
    let row = |row: &BoardRecord| (row.team.name.to_string(), row.result.score);
    board.iter().map(row).collect()
}

fn row(name: &str, score: f64) -> (String, f64) {
    (name.to_owned(), score)
}

#[tokio::test]
async fn trial_runs_last_and_reaches_no_board() {
    let mut f = TestStore::new().await;
    let submissions = f.two_valid_submissions().await;
    let stage = f.configure_stage(&one_shard_plan()).await;
    let trial = propose_trial(&f, stage).await.unwrap();
    assert_eq!((trial.kind, trial.outcome), (ProposalKind::Trial, None));
    let proposed = proposed_evaluations(&f, trial.id).await;
    assert_eq!(proposed.len(), 2);
    assert!(
        proposed
            .iter()
            .all(|evaluation| evaluation.state == EvaluationState::Queued)
    );
    assert!(
        f.store.days().await.unwrap().is_empty(),
        "no day has started"
    );
    // The evaluations of the day run first.
    let day = f.evaluate(submissions[0].id, &one_shard_plan()).await;
    for _ in 0..2 {
        let (claim, run, shard) = f.claim_shard().await;
        assert_eq!(run.seed, SeedLabel::StageDay(day.stage_day));
        f.commit_shard(&claim, &shard).await;
        let (claim, _) = f.claim_scoring().await;
        f.finish_scoring(&claim, 1.0, DATASET_KEY).await;
    }
    assert!(f.store.days().await.unwrap()[0].0.released_at.is_some());
    for score in [8.0, 9.0] {
        let (claim, run, shard) = f.claim_shard().await;
        assert_eq!(
            run.seed,
            SeedLabel::Trial(trial.id),
            "the trial has its own episodes"
        );
        f.commit_shard(&claim, &shard).await;
        let (claim, _) = f.claim_scoring().await;
        f.finish_scoring(&claim, score, "t").await;
    }
    assert!(f.claim().await.is_none());
    let scores: Vec<f64> = proposed_evaluations(&f, trial.id)
        .await
        .into_iter()
        .map(|evaluation| match evaluation.state {
            EvaluationState::Finished { result, .. } => result.score,
            state => panic!("expected a finished evaluation, found {state:?}"),
        })
        .collect();
    assert_eq!(scores, [8.0, 9.0]);
    assert_eq!(board_rows(&f).await, [row("Alpha", 1.0), row("Beta", 1.0)]);
    for submission in &submissions {
        let visible = f.store.evaluations_of(submission.team).await.unwrap();
        assert_eq!(visible.len(), 1, "the trial is not visible to its team");
    }
    assert_conflict(apply(&f, trial.id).await, &["cannot be applied"]);
    discard(&f, trial.id).await.unwrap();
    assert_conflict(discard(&f, trial.id).await, &["was dropped at"]);
    // The trial's datasets and recordings are deleted a day later, like those of evaluations.
    assert_eq!(f.store.remove_dropped_datasets(f.now).await.unwrap(), 0);
    f.advance_clock_s(25 * 3600);
    assert_eq!(f.store.remove_dropped_datasets(f.now).await.unwrap(), 2);
    assert_eq!(f.store.remove_dropped_datasets(f.now).await.unwrap(), 0);
    assert_eq!(f.store.remove_old_recordings(f.now).await.unwrap(), 4);
}

#[tokio::test]
async fn impossible_trial_is_refused() {
    let mut f = TestStore::new().await;
    let stage = f.configure_stage(&one_shard_plan()).await;
    assert_conflict(
        propose_trial(&f, stage).await,
        &["no team has a valid submission"],
    );
    let team = f.create_team("Alpha").await;
    let upload = f.upload(&team).await;
    let refused = f
        .store
        .propose_trial(Actor::Operator, stage, Some(upload.id), REASON, f.now);
    assert_conflict(refused.await, &["valid"]);
    f.validate().await;
    let proposed = f
        .store
        .propose_trial(Actor::Operator, stage, Some(upload.id), REASON, f.now);
    let proposed = proposed.await.unwrap();
    assert_conflict(
        f.store.close_season(Actor::Operator, f.now).await,
        &["1", "trials"],
    );
    // The trial is dropped while a worker runs its shard, and the worker's commit is refused.
    let (claim, _, shard) = f.claim_shard().await;
    discard(&f, proposed.id).await.unwrap();
    assert_eq!(
        f.commit_shard(&claim, &shard).await,
        CommitOutcome::LeaseLost
    );
    assert!(f.claim().await.is_none());
    f.close_stage_after_s(stage, 1).await;
    assert_conflict(propose_trial(&f, stage).await, &["closed"]);
    f.store.close_season(Actor::Operator, f.now).await.unwrap();
}

#[tokio::test]
async fn reevaluation_counts_only_once_applied() {
    let mut f = TestStore::new().await;
    let (submissions, stage_day) = f.released_day().await;
    let originals = f.store.evaluations_of_day(stage_day).await.unwrap();
    let proposed = propose_reevaluation(&f, Reevaluation::Day(stage_day))
        .await
        .unwrap();
    assert_eq!(proposed.kind, ProposalKind::Day(stage_day.date));
    assert_conflict(apply(&f, proposed.id).await, &["2 of its evaluations"]);
    let mut labels = Vec::new();
    let mut score = 2.0;
    while let Some(ClaimedJob { claim, job }) = f.claim().await {
        match job {
            Job::Shard { run, shard, .. } => {
                labels.push(run.seed);
                f.commit_shard(&claim, &shard).await;
            }
            _ => {
                f.finish_scoring(&claim, score, "again").await;
                score += 1.0;
            }
        }
    }
    assert_eq!(
        labels,
        [SeedLabel::StageDay(stage_day); 2],
        "the same episodes"
    );
    let counted = [row("Alpha", 1.0), row("Beta", 1.0)];
    assert_eq!(
        board_rows(&f).await,
        counted,
        "the proposal is not applied yet"
    );

    f.advance_clock_s(60);
    let frozen = f
        .store
        .freeze_boards(Actor::Operator, stage_day.stage, REASON, f.now);
    frozen.await.unwrap();
    assert_conflict(apply(&f, proposed.id).await, &["frozen"]);
    let unfrozen = f
        .store
        .unfreeze_boards(Actor::Operator, stage_day.stage, f.now);
    unfrozen.await.unwrap();
    let applied = apply(&f, proposed.id).await.unwrap();
    assert_eq!(applied.outcome, Some(ProposalOutcome::Applied(f.now)));
    assert_eq!(board_rows(&f).await, [row("Alpha", 2.0), row("Beta", 3.0)]);
    for (original, submission) in originals.iter().zip(&submissions) {
        let replaced = f.store.evaluation(original.id).await.unwrap();
        let reason = format!("evaluated again: {REASON}");
        assert_eq!(replaced.voided.unwrap().reason, reason);
        let evaluations = f.store.evaluations_of(submission.team).await.unwrap();
        let new = evaluations
            .iter()
            .find(|evaluation| evaluation.voided.is_none())
            .unwrap();
        assert_eq!(
            (new.rerun_of, new.stage_day, new.submission),
            (Some(original.id), stage_day, submission.id)
        );
        let EvaluationState::Finished { finished_at, .. } = new.state else {
            panic!("expected a finished evaluation, found {new:?}")
        };
        assert_eq!(finished_at, f.now, "the result counts from now on");
    }
    assert_conflict(apply(&f, proposed.id).await, &["was applied at"]);
    assert_conflict(discard(&f, proposed.id).await, &["was applied at"]);
}

#[tokio::test]
async fn proposal_with_voided_original_is_refused_whole() {
    let f = TestStore::new().await;
    let (submissions, stage_day) = f.released_day().await;
    let proposed = propose_reevaluation(&f, Reevaluation::Day(stage_day))
        .await
        .unwrap();
    f.run_all_with_score(2.0).await;
    let beta_evaluation = f.store.evaluations_of(submissions[1].team).await.unwrap()[0].id;
    let voided = f
        .store
        .void_evaluation(Actor::Operator, beta_evaluation, REASON, f.now);
    voided.await.unwrap();
    assert_conflict(apply(&f, proposed.id).await, &["does not count any more"]);
    assert_eq!(
        board_rows(&f).await,
        [row("Alpha", 1.0)],
        "the proposal is not applied in part"
    );
    // A new proposal evaluates only what counts now.
    discard(&f, proposed.id).await.unwrap();
    let proposed = propose_reevaluation(&f, Reevaluation::Day(stage_day))
        .await
        .unwrap();
    f.run_all_with_score(2.0).await;
    apply(&f, proposed.id).await.unwrap();
    assert_eq!(board_rows(&f).await, [row("Alpha", 2.0)]);
    assert_conflict(
        propose_reevaluation(&f, Reevaluation::Evaluation(beta_evaluation)).await,
        &["no result counts"],
    );
}

#[tokio::test]
async fn reevaluation_replaces_result_by_agent_failure() {
    let mut f = TestStore::new().await;
    let (submissions, _) = f.released_day().await;
    let alpha_evaluation = f.store.evaluations_of(submissions[0].team).await.unwrap()[0].id;
    let proposed = propose_reevaluation(&f, Reevaluation::Evaluation(alpha_evaluation))
        .await
        .unwrap();
    assert_eq!(proposed_evaluations(&f, proposed.id).await.len(), 1);
    let (claim, _, shard) = f.claim_shard().await;
    let stopped = ShardCommit {
        stopped_by_faults: true,
        ..shard_commit(&shard, 1)
    };
    f.store.commit_shard(&claim, stopped, f.now).await.unwrap();
    let state = proposed_evaluations(&f, proposed.id).await.remove(0).state;
    assert!(
        matches!(state, EvaluationState::AgentFailed { .. }),
        "{state:?}"
    );
    apply(&f, proposed.id).await.unwrap();
    assert_eq!(
        board_rows(&f).await,
        [row("Beta", 1.0)],
        "Alpha has no result any more"
    );

    // Platform faults in a proposal change nothing.
    let beta_evaluation = f.store.evaluations_of(submissions[1].team).await.unwrap()[0].id;
    let proposed = propose_reevaluation(&f, Reevaluation::Evaluation(beta_evaluation))
        .await
        .unwrap();
    for _ in 0..MAX_PLATFORM_FAULTS {
        let claimed = f.claim().await.unwrap();
        let failed = f
            .store
            .release_after_platform_fault(&claimed.claim, "disk full", f.now);
        failed.await.unwrap();
        f.advance_clock_s(60);
    }
    let state = proposed_evaluations(&f, proposed.id).await.remove(0).state;
    assert!(
        matches!(state, EvaluationState::PlatformFailed { .. }),
        "{state:?}"
    );
    apply(&f, proposed.id).await.unwrap();
    assert_eq!(board_rows(&f).await, [row("Beta", 1.0)]);
    assert_eq!(
        f.store.evaluation(beta_evaluation).await.unwrap().voided,
        None
    );
}

#[tokio::test]
async fn reevaluation_by_new_rules_has_its_own_board() {
    let f = TestStore::new().await;
    let (_, stage_day) = f.released_day().await;
    assert_conflict(
        propose_reevaluation(&f, Reevaluation::DayWithNewestRules(stage_day)).await,
        &["stage's newest rules"],
    );
    let new_plan = RunPlan {
        max_faults: 9,
        ..one_shard_plan()
    };
    let stage = f.configure_stage(&new_plan).await;
    let proposed = propose_reevaluation(&f, Reevaluation::DayWithNewestRules(stage_day))
        .await
        .unwrap();
    assert_eq!(proposed.revision, 2);
    let (claim, run, shard) = f.claim_shard().await;
    assert_eq!(
        (run.plan.max_faults, run.seed),
        (9, SeedLabel::StageDay(stage_day))
    );
    f.commit_shard(&claim, &shard).await;
    f.run_all_with_score(5.0).await;
    apply(&f, proposed.id).await.unwrap();
    let scores = async |revision| -> Vec<f64> {
        let board = f.store.board(stage, revision).await.unwrap();
        board.iter().map(|row| row.result.score).collect()
    };
    assert_eq!(
        scores(1).await,
        [1.0, 1.0],
        "the board of the old rules stays"
    );
    assert_eq!(scores(2).await, [5.0, 5.0]);
    assert_conflict(
        propose_reevaluation(&f, Reevaluation::DayWithNewestRules(stage_day)).await,
        &["stage's newest rules"],
    );
}
