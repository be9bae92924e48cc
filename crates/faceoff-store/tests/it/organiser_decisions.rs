//! Organisers' decisions: a void result or day, a disqualified team, a paused queue.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

const REASON: &str = "the table was tilted";

async fn void(f: &TestStore, id: EvaluationId) -> Result<Evaluation, StoreError> {
    f.store
        .void_evaluation(Actor::Operator, id, REASON, f.now)
        .await
}

/// Teams and scores of the board.
async fn board_rows(f: &TestStore) -> Vec<(String, f64)> {
    let board = f.board().await;
    let row = |row: &BoardRecord| (row.team.name.to_string(), row.result.score);
    board.iter().map(row).collect()
}

/// Id of the newest event.
async fn newest_event(f: &TestStore) -> i64 {
    f.store
        .events_after(0, 1000)
        .await
        .unwrap()
        .last()
        .unwrap()
        .id
}

#[tokio::test]
async fn voided_result_leaves_board_and_can_be_rerun() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let first = f.evaluate(submission.id, &one_shard_plan()).await;
    assert_conflict(
        void(&f, first.id).await,
        &["queued or running", "cancelled"],
    );
    f.finish_next_evaluation().await;
    f.advance_clock_s(24 * 3600);
    let second = f.evaluate(submission.id, &one_shard_plan()).await;
    f.run_all_with_score(2.0).await;
    assert_eq!(board_rows(&f).await, [("Alpha".to_owned(), 2.0)]);

    let event_before = newest_event(&f).await;
    f.advance_clock_s(60);
    let voided = void(&f, second.id).await.unwrap();
    let decision = DecisionRecord {
        at: f.now,
        reason: REASON.into(),
    };
    assert_eq!(voided.voided, Some(decision));
    assert!(
        matches!(voided.state, EvaluationState::Finished { .. }),
        "the result stays readable"
    );
    assert_eq!(
        f.event_kinds_since(event_before).await,
        ["evaluation_voided"]
    );
    // The result of the day before counts again.
    assert_eq!(board_rows(&f).await, [("Alpha".to_owned(), 1.0)]);
    let days = f.store.days().await.unwrap();
    assert_eq!(
        days.iter()
            .map(|(_, finished)| *finished)
            .collect::<Vec<_>>(),
        [0, 1]
    );
    assert_conflict(void(&f, second.id).await, &["only a counting evaluation"]);

    let rerun = f.store.rerun_evaluation(Actor::Operator, second.id, f.now);
    let rerun = rerun.await.unwrap();
    assert_eq!(
        (rerun.rerun_of, rerun.stage_day),
        (Some(second.id), second.stage_day)
    );
    f.run_all_with_score(3.0).await;
    assert_eq!(board_rows(&f).await, [("Alpha".to_owned(), 3.0)]);
    let repeated = f
        .store
        .rerun_evaluation(Actor::Operator, second.id, f.now)
        .await;
    assert_conflict(repeated, &["counts"]);
}

#[tokio::test]
async fn paused_queue_starts_no_job_and_loses_none() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let two_shards = two_shard_plan();
    f.evaluate(submission.id, &two_shards).await;
    let (claim, _, shard) = f.claim_shard().await;
    let pause = async |f: &TestStore| f.store.pause_queue(Actor::Operator, REASON, f.now).await;
    pause(&f).await.unwrap();
    assert_conflict(pause(&f).await, &["paused already"]);
    let paused = f.store.season().await.unwrap().queue_pause.unwrap();
    assert_eq!((paused.at, paused.reason.as_str()), (f.now, REASON));
    assert!(f.claim().await.is_none());
    assert_eq!(
        f.commit_shard(&claim, &shard).await,
        CommitOutcome::Stored,
        "running jobs continue"
    );
    let health = f.store.health(f.now).await;
    let expected = QueueHealth::Paused {
        running: 0,
        waiting: 1,
        decision: paused,
    };
    assert_eq!(health.queue, expected);
    // While the queue is paused, evaluations of days are queued, and the queue does not count as stuck.
    f.advance_clock_s(24 * 3600);
    f.evaluate(submission.id, &two_shards).await;
    assert!(f.claim().await.is_none());
    assert!(matches!(
        f.store.health(f.now).await.queue,
        QueueHealth::Paused { .. }
    ));

    let mut signal = f.store.job_signal();
    signal.mark_unchanged();
    let resume = async |f: &TestStore| f.store.resume_queue(Actor::Operator, f.now).await;
    resume(&f).await.unwrap();
    assert!(signal.has_changed().unwrap(), "idle slots are notified");
    assert_conflict(resume(&f).await, &["not paused"]);
    f.run_all_with_score(1.0).await;
    let evaluations = f.store.evaluations_of(submission.team).await.unwrap();
    assert_eq!(evaluations.len(), 2);
    for evaluation in evaluations {
        assert!(matches!(evaluation.state, EvaluationState::Finished { .. }));
    }
}

#[tokio::test]
async fn voided_day_is_over_at_once() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = f.two_valid_submissions().await;
    let stage_day = f.evaluate(alpha.id, &one_shard_plan()).await.stage_day;
    let open = f.evaluate(beta.id, &one_shard_plan()).await.id;
    let done = f.finish_next_evaluation().await;
    let void_day = async |f: &TestStore| {
        f.store
            .void_day(Actor::Operator, stage_day, REASON, f.now)
            .await
    };
    let event_before = newest_event(&f).await;
    f.advance_clock_s(60);
    assert_eq!(void_day(&f).await.unwrap(), 2);
    assert_eq!(
        f.event_kinds_since(event_before).await,
        [
            "evaluation_voided",
            "evaluation_cancelled",
            "day_released",
            "day_voided"
        ]
    );
    assert!(f.store.evaluation(done).await.unwrap().voided.is_some());
    assert!(matches!(
        f.state(open).await,
        EvaluationState::Cancelled { .. }
    ));
    assert_eq!(board_rows(&f).await, []);
    assert!(f.claim().await.is_none(), "no job of the day is left");
    assert_conflict(void_day(&f).await, &["no evaluation", "counts"]);
    let not_started = StageDay {
        date: stage_day.date.tomorrow().unwrap(),
        ..stage_day
    };
    let result = f
        .store
        .void_day(Actor::Operator, not_started, REASON, f.now)
        .await;
    assert!(
        matches!(result, Err(StoreError::NotFound("day"))),
        "{result:?}"
    );
    for id in [done, open] {
        let rerun = f.store.rerun_evaluation(Actor::Operator, id, f.now);
        rerun.await.unwrap();
    }
}

#[tokio::test]
async fn disqualified_team_is_excluded_until_reinstated() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = f.two_valid_submissions().await;
    f.evaluate(alpha.id, &one_shard_plan()).await;
    f.run_all_with_score(1.0).await;
    f.advance_clock_s(24 * 3600);
    let second = f.evaluate(alpha.id, &one_shard_plan()).await;
    let disqualify = async |f: &TestStore| {
        let reason = "another team's bundle";
        f.store
            .disqualify_team(Actor::Operator, alpha.team, reason, f.now)
            .await
    };
    let team = disqualify(&f).await.unwrap();
    assert_eq!(team.disqualified.unwrap().reason, "another team's bundle");
    let EvaluationState::Cancelled { reason, .. } = f.state(second.id).await else {
        panic!("expected a cancelled evaluation");
    };
    assert_eq!(reason, "the team is disqualified: another team's bundle");
    f.run_all_with_score(2.0).await;
    assert_eq!(board_rows(&f).await, [("Beta".to_owned(), 2.0)]);
    assert_conflict(disqualify(&f).await, &["already"]);

    let assert_disqualified = |error: StoreError| {
        assert!(
            matches!(error, StoreError::Disqualified { .. }),
            "{error:?}"
        );
    };
    let team = f.store.team(alpha.team).await.unwrap();
    let quota = UploadQuota::default();
    let upload = f
        .store
        .create_submission(Actor::Team(team.id), team.id, bundle(), &quota, f.now);
    assert_disqualified(upload.await.unwrap_err());
    let choice = f
        .store
        .activate_submission(Actor::Team(team.id), alpha.id, f.now);
    assert_disqualified(choice.await.unwrap_err());
    let rerun = f.store.rerun_evaluation(Actor::Operator, second.id, f.now);
    assert_disqualified(rerun.await.unwrap_err());
    f.advance_clock_s(24 * 3600);
    let stage = f.configure_stage(&one_shard_plan()).await;
    let started = f
        .store
        .start_day(Actor::Operator, stage, f.now)
        .await
        .unwrap();
    assert_eq!(
        started
            .iter()
            .map(|evaluation| evaluation.team)
            .collect::<Vec<_>>(),
        [beta.team]
    );
    f.run_all_with_score(3.0).await;

    let reinstate = async |f: &TestStore| {
        f.store
            .reinstate_team(Actor::Operator, alpha.team, "a mistake", f.now)
            .await
    };
    assert_eq!(reinstate(&f).await.unwrap().disqualified, None);
    assert_conflict(reinstate(&f).await, &["not disqualified"]);
    assert_eq!(
        board_rows(&f).await,
        [("Alpha".to_owned(), 1.0), ("Beta".to_owned(), 3.0)]
    );
    // An organiser can rerun the cancelled evaluation.
    let rerun = f.store.rerun_evaluation(Actor::Operator, second.id, f.now);
    rerun.await.unwrap();
    f.run_all_with_score(4.0).await;
    assert_eq!(board_rows(&f).await[0], ("Alpha".to_owned(), 4.0));
    f.upload(&f.store.team(alpha.team).await.unwrap()).await;
}
