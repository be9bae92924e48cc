//! Organisers' decisions on results, days, teams and the queue.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

const REASON: &str = "the table was tilted";

#[track_caller]
fn refused<T: std::fmt::Debug>(done: Result<T, StoreError>, words: &[&str]) {
    let Err(StoreError::Conflict(why)) = done else {
        panic!("expected a conflict with {words:?}: {done:?}");
    };
    for word in words {
        assert!(why.contains(word), "{word:?} is not in {why:?}");
    }
}

async fn void(f: &TestStore, id: EvaluationId) -> Result<Evaluation, StoreError> {
    f.store
        .void_evaluation(Actor::Organiser, id, REASON, f.now)
        .await
}

async fn on_board(f: &TestStore) -> Vec<(String, f64)> {
    let board = f.board().await;
    let row = |row: &BoardRecord| (row.team.name.to_string(), row.result.score);
    board.iter().map(row).collect()
}

async fn kinds_since(f: &TestStore, id: i64) -> Vec<String> {
    let events = f.store.events_after(id, 1000).await.unwrap();
    let kind = |record: &EventRecord| {
        let event = serde_json::to_value(&record.event).unwrap();
        event["kind"].as_str().unwrap().to_owned()
    };
    events.iter().map(kind).collect()
}

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
    let agent = f.ready_team("Alpha").await;
    let first = f.evaluate(agent.id, &small()).await;
    refused(
        void(&f, first.id).await,
        &["queued or running", "cancelled"],
    );
    f.finish_next().await;
    f.later(24 * 3600);
    let second = f.evaluate(agent.id, &small()).await;
    f.run_all(2.0).await;
    assert_eq!(on_board(&f).await, [("Alpha".to_owned(), 2.0)]);

    let before = newest_event(&f).await;
    f.later(60);
    let voided = void(&f, second.id).await.unwrap();
    let ruling = Ruling {
        at: f.now,
        reason: REASON.into(),
    };
    assert_eq!(voided.voided, Some(ruling));
    assert!(
        matches!(voided.state, EvaluationState::Finished { .. }),
        "it stays readable"
    );
    assert_eq!(kinds_since(&f, before).await, ["evaluation_voided"]);
    // The day before counts again.
    assert_eq!(on_board(&f).await, [("Alpha".to_owned(), 1.0)]);
    let days = f.store.days().await.unwrap();
    assert_eq!(
        days.iter()
            .map(|(_, finished)| *finished)
            .collect::<Vec<_>>(),
        [0, 1]
    );
    refused(void(&f, second.id).await, &["only a counting evaluation"]);

    let rerun = f.store.rerun_evaluation(Actor::Organiser, second.id, f.now);
    let rerun = rerun.await.unwrap();
    assert_eq!(
        (rerun.rerun_of, rerun.stage_day),
        (Some(second.id), second.stage_day)
    );
    f.run_all(3.0).await;
    assert_eq!(on_board(&f).await, [("Alpha".to_owned(), 3.0)]);
    let twice = f
        .store
        .rerun_evaluation(Actor::Organiser, second.id, f.now)
        .await;
    refused(twice, &["counts"]);
}

#[tokio::test]
async fn paused_queue_starts_no_job_and_keeps_all() {
    let mut f = TestStore::new().await;
    let agent = f.ready_team("Alpha").await;
    let two_shards = RunPlan {
        tasks: vec![Task::Hit],
        ..plan()
    };
    f.evaluate(agent.id, &two_shards).await;
    let (claim, _, shard) = f.claim_shard().await;
    let pause = async |f: &TestStore| f.store.pause_queue(Actor::Organiser, REASON, f.now).await;
    pause(&f).await.unwrap();
    refused(pause(&f).await, &["paused already"]);
    let paused = f.store.season().await.unwrap().paused.unwrap();
    assert_eq!((paused.at, paused.reason.as_str()), (f.now, REASON));
    assert!(f.claim().await.is_none());
    assert_eq!(
        f.commit_shard(&claim, &shard, 0).await,
        CommitOutcome::Stored,
        "running jobs continue"
    );
    let health = f.store.health(f.now).await;
    let expected = QueueHealth::Paused {
        running: 0,
        waiting: 1,
        ruling: paused,
    };
    assert_eq!(health.queue, expected);
    // Days are queued while it lasts, and the queue does not count as stuck.
    f.later(24 * 3600);
    f.evaluate(agent.id, &two_shards).await;
    assert!(f.claim().await.is_none());
    assert!(matches!(
        f.store.health(f.now).await.queue,
        QueueHealth::Paused { .. }
    ));

    let mut signal = f.store.job_signal();
    signal.mark_unchanged();
    let resume = async |f: &TestStore| f.store.resume_queue(Actor::Organiser, f.now).await;
    resume(&f).await.unwrap();
    assert!(signal.has_changed().unwrap(), "idle slots are notified");
    refused(resume(&f).await, &["not paused"]);
    f.run_all(1.0).await;
    let states = f.store.evaluations_of(agent.team).await.unwrap();
    assert_eq!(states.len(), 2);
    for evaluation in states {
        assert!(matches!(evaluation.state, EvaluationState::Finished { .. }));
    }
}

#[tokio::test]
async fn voided_day_is_over_at_once() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = [f.ready_team("Alpha").await, f.ready_team("Beta").await];
    let of = f.evaluate(alpha.id, &small()).await.stage_day;
    let under_way = f.evaluate(beta.id, &small()).await.id;
    let done = f.finish_next().await;
    let void_day =
        async |f: &TestStore| f.store.void_day(Actor::Organiser, of, REASON, f.now).await;
    let before = newest_event(&f).await;
    f.later(60);
    assert_eq!(void_day(&f).await.unwrap(), 2);
    assert_eq!(
        kinds_since(&f, before).await,
        [
            "evaluation_voided",
            "evaluation_cancelled",
            "day_released",
            "day_voided"
        ]
    );
    assert!(f.store.evaluation(done).await.unwrap().voided.is_some());
    assert!(matches!(
        f.state(under_way).await,
        EvaluationState::Cancelled { .. }
    ));
    assert_eq!(on_board(&f).await, []);
    assert!(f.claim().await.is_none(), "no job of it is left");
    refused(void_day(&f).await, &["no evaluation", "counts"]);
    let other = StageDay {
        date: of.date.tomorrow().unwrap(),
        ..of
    };
    let none = f
        .store
        .void_day(Actor::Organiser, other, REASON, f.now)
        .await;
    assert!(matches!(none, Err(StoreError::NotFound("day"))), "{none:?}");
    for id in [done, under_way] {
        let rerun = f.store.rerun_evaluation(Actor::Organiser, id, f.now);
        rerun.await.unwrap();
    }
}

#[tokio::test]
async fn disqualified_team_is_excluded_until_reinstated() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = [f.ready_team("Alpha").await, f.ready_team("Beta").await];
    f.evaluate(alpha.id, &small()).await;
    f.run_all(1.0).await;
    f.later(24 * 3600);
    let second = f.evaluate(alpha.id, &small()).await;
    let disqualify = async |f: &TestStore| {
        let why = "another team's bundle";
        f.store
            .disqualify_team(Actor::Organiser, alpha.team, why, f.now)
            .await
    };
    let team = disqualify(&f).await.unwrap();
    assert_eq!(team.disqualified.unwrap().reason, "another team's bundle");
    let EvaluationState::Cancelled { reason, .. } = f.state(second.id).await else {
        panic!("expected a cancelled evaluation");
    };
    assert_eq!(reason, "the team is disqualified: another team's bundle");
    f.run_all(2.0).await;
    assert_eq!(on_board(&f).await, [("Beta".to_owned(), 2.0)]);
    refused(disqualify(&f).await, &["already"]);

    let disqualified = |error: StoreError| {
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
    disqualified(upload.await.unwrap_err());
    let choice = f
        .store
        .activate_submission(Actor::Team(team.id), alpha.id, f.now);
    disqualified(choice.await.unwrap_err());
    let rerun = f.store.rerun_evaluation(Actor::Organiser, second.id, f.now);
    disqualified(rerun.await.unwrap_err());
    f.later(24 * 3600);
    let stage = f.stage(&small()).await;
    let started = f
        .store
        .start_day(Actor::Organiser, stage, f.now)
        .await
        .unwrap();
    assert_eq!(
        started.iter().map(|one| one.team).collect::<Vec<_>>(),
        [beta.team]
    );
    f.run_all(3.0).await;

    let reinstate = async |f: &TestStore| {
        f.store
            .reinstate_team(Actor::Organiser, alpha.team, "a mistake", f.now)
            .await
    };
    assert_eq!(reinstate(&f).await.unwrap().disqualified, None);
    refused(reinstate(&f).await, &["not disqualified"]);
    let names: Vec<_> = on_board(&f).await;
    assert_eq!(names, [("Alpha".to_owned(), 1.0), ("Beta".to_owned(), 3.0)]);
    // An organiser can rerun the cancelled evaluation.
    let rerun = f.store.rerun_evaluation(Actor::Organiser, second.id, f.now);
    rerun.await.unwrap();
    f.run_all(4.0).await;
    assert_eq!(on_board(&f).await[0], ("Alpha".to_owned(), 4.0));
    f.upload(&f.store.team(alpha.team).await.unwrap()).await;
}
