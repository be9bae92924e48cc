//! What the organiser decides against results and teams.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

const WHY: &str = "the table was tilted";

#[track_caller]
fn refused<T: std::fmt::Debug>(done: Result<T, StoreError>, words: &[&str]) {
    let Err(StoreError::Conflict(why)) = done else {
        panic!("expected a conflict with {words:?}: {done:?}");
    };
    for word in words {
        assert!(why.contains(word), "{word:?} is not in {why:?}");
    }
}

async fn void(f: &Fixture, id: EvaluationId) -> Result<Evaluation, StoreError> {
    f.store
        .void_evaluation(Actor::Organiser, id, WHY, f.now)
        .await
}

async fn on_board(f: &Fixture) -> Vec<(String, f64)> {
    let board = f.board().await;
    let row = |row: &BoardRecord| (row.team.name.to_string(), row.result.score);
    board.iter().map(row).collect()
}

async fn kinds_since(f: &Fixture, id: i64) -> Vec<String> {
    let events = f.store.events_after(id, 1000).await.unwrap();
    let kind = |record: &EventRecord| {
        let event = serde_json::to_value(&record.event).unwrap();
        event["kind"].as_str().unwrap().to_owned()
    };
    events.iter().map(kind).collect()
}

async fn newest_event(f: &Fixture) -> i64 {
    f.store
        .events_after(0, 1000)
        .await
        .unwrap()
        .last()
        .unwrap()
        .id
}

#[tokio::test]
async fn a_voided_result_leaves_the_board_and_gives_the_turn_back() {
    let mut f = Fixture::new().await;
    let agent = f.ready_team("Alpha").await;
    let first = f.evaluate(agent.id, &small()).await;
    refused(void(&f, first.id).await, &["under way", "cancelled"]);
    f.finish_next().await;
    f.later(24 * 3600);
    let second = f.evaluate(agent.id, &small()).await;
    f.play_to(2.0).await;
    assert_eq!(on_board(&f).await, [("Alpha".to_owned(), 2.0)]);

    let before = newest_event(&f).await;
    f.later(60);
    let voided = void(&f, second.id).await.unwrap();
    let ruling = Ruling {
        at: f.now,
        reason: WHY.into(),
    };
    assert_eq!(voided.voided, Some(ruling));
    assert!(
        matches!(voided.state, EvaluationState::Finished { .. }),
        "it can be read on"
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
    refused(void(&f, second.id).await, &["counts"]);

    let again = f.store.rerun_evaluation(Actor::Organiser, second.id, f.now);
    let again = again.await.unwrap();
    assert_eq!((again.rerun_of, again.of), (Some(second.id), second.of));
    f.play_to(3.0).await;
    assert_eq!(on_board(&f).await, [("Alpha".to_owned(), 3.0)]);
    let twice = f
        .store
        .rerun_evaluation(Actor::Organiser, second.id, f.now)
        .await;
    refused(twice, &["counts"]);
}

#[tokio::test]
async fn a_paused_queue_begins_nothing_and_loses_nothing() {
    let mut f = Fixture::new().await;
    let agent = f.ready_team("Alpha").await;
    let two_shards = RunPlan {
        tasks: vec![Task::Hit],
        ..plan()
    };
    f.evaluate(agent.id, &two_shards).await;
    let (claim, _, shard) = f.claim_shard().await;
    let pause = async |f: &Fixture| f.store.pause_queue(Actor::Organiser, WHY, f.now).await;
    pause(&f).await.unwrap();
    refused(pause(&f).await, &["paused already"]);
    let paused = f.store.season().await.unwrap().paused.unwrap();
    assert_eq!((paused.at, paused.reason.as_str()), (f.now, WHY));
    assert!(f.claim().await.is_none());
    assert_eq!(
        f.play(&claim, &shard, 0).await,
        Committed::Now,
        "what is begun is played"
    );
    let health = f.store.health(f.now).await;
    let held = QueueHealth::Held {
        running: 0,
        waiting: 1,
        ruling: paused,
    };
    assert_eq!(health.queue, held);
    // Days start and wait, for as long as it takes: nothing is stuck.
    f.later(24 * 3600);
    f.evaluate(agent.id, &two_shards).await;
    assert!(f.claim().await.is_none());
    assert!(matches!(
        f.store.health(f.now).await.queue,
        QueueHealth::Held { .. }
    ));

    let mut signal = f.store.work_signal();
    signal.mark_unchanged();
    let resume = async |f: &Fixture| f.store.resume_queue(Actor::Organiser, f.now).await;
    resume(&f).await.unwrap();
    assert!(signal.has_changed().unwrap(), "idle slots look again");
    refused(resume(&f).await, &["not paused"]);
    f.play_to(1.0).await;
    let states = f.store.evaluations_of(agent.team).await.unwrap();
    assert_eq!(states.len(), 2);
    for evaluation in states {
        assert!(matches!(evaluation.state, EvaluationState::Finished { .. }));
    }
}

#[tokio::test]
async fn a_voided_day_is_over_at_once() {
    let mut f = Fixture::new().await;
    let [alpha, beta] = [f.ready_team("Alpha").await, f.ready_team("Beta").await];
    let of = f.evaluate(alpha.id, &small()).await.of;
    let under_way = f.evaluate(beta.id, &small()).await.id;
    let done = f.finish_next().await;
    let void_day = async |f: &Fixture| f.store.void_day(Actor::Organiser, of, WHY, f.now).await;
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
    assert!(f.claim().await.is_none(), "nothing of it is played on");
    refused(void_day(&f).await, &["nothing", "counts"]);
    let other = StageDay {
        date: of.date.tomorrow().unwrap(),
        ..of
    };
    let none = f.store.void_day(Actor::Organiser, other, WHY, f.now).await;
    assert!(matches!(none, Err(StoreError::NotFound("day"))), "{none:?}");
    for id in [done, under_way] {
        let again = f.store.rerun_evaluation(Actor::Organiser, id, f.now);
        again.await.unwrap();
    }
}

#[tokio::test]
async fn a_disqualified_team_neither_plays_nor_is_ranked_until_it_is_reinstated() {
    let mut f = Fixture::new().await;
    let [alpha, beta] = [f.ready_team("Alpha").await, f.ready_team("Beta").await];
    f.evaluate(alpha.id, &small()).await;
    f.play_to(1.0).await;
    f.later(24 * 3600);
    let second = f.evaluate(alpha.id, &small()).await;
    let disqualify = async |f: &Fixture| {
        let why = "another team's bundle";
        f.store
            .disqualify_team(Actor::Organiser, alpha.team, why, f.now)
            .await
    };
    let team = disqualify(&f).await.unwrap();
    assert_eq!(team.disqualified.unwrap().reason, "another team's bundle");
    let EvaluationState::Cancelled { reason, .. } = f.state(second.id).await else {
        panic!("it plays on");
    };
    assert_eq!(reason, "the team is disqualified: another team's bundle");
    f.play_to(2.0).await;
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
    let again = f.store.rerun_evaluation(Actor::Organiser, second.id, f.now);
    disqualified(again.await.unwrap_err());
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
    f.play_to(3.0).await;

    let reinstate = async |f: &Fixture| {
        f.store
            .reinstate_team(Actor::Organiser, alpha.team, "a mistake", f.now)
            .await
    };
    assert_eq!(reinstate(&f).await.unwrap().disqualified, None);
    refused(reinstate(&f).await, &["not disqualified"]);
    let names: Vec<_> = on_board(&f).await;
    assert_eq!(names, [("Alpha".to_owned(), 1.0), ("Beta".to_owned(), 3.0)]);
    // What was cancelled is played again if the organiser wants it.
    let again = f.store.rerun_evaluation(Actor::Organiser, second.id, f.now);
    again.await.unwrap();
    f.play_to(4.0).await;
    assert_eq!(on_board(&f).await[0], ("Alpha".to_owned(), 4.0));
    f.upload(&f.store.team(alpha.team).await.unwrap()).await;
}
