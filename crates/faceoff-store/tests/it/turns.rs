//! One evaluation per team and UTC day, and what gives a turn back.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{Ruleset, SmokeOutcome};
use jiff::civil::date;

fn used(result: Result<Evaluation, StoreError>) -> (jiff::civil::Date, jiff::civil::Date) {
    match result {
        Err(StoreError::AlreadyEvaluated { day, next }) => (day, next),
        other => panic!("expected a used turn, got {other:?}"),
    }
}

#[tokio::test]
async fn a_team_has_one_turn_per_utc_day() {
    let mut f = Fixture::new().await;
    let first = f.ready_team("Alpha").await;
    f.now = "2026-03-01T23:59:59.999Z".parse().unwrap();
    f.evaluate(first.id, &plan()).await;
    // neither the same nor a new submission gets a second turn
    assert_eq!(
        used(
            f.store
                .create_evaluation(Actor::Organiser, first.id, &plan(), f.now)
                .await
        ),
        (date(2026, 3, 1), date(2026, 3, 2))
    );
    f.later(0);
    let team = f.store.team(first.team).await.unwrap();
    f.upload(&team).await;
    let second = f.validate().await;
    used(
        f.store
            .create_evaluation(Actor::Organiser, second.id, &plan(), f.now)
            .await,
    );
    assert!(
        f.store
            .start_day(Actor::Organiser, &plan(), f.now)
            .await
            .unwrap()
            .is_empty()
    );
    // but the next day comes a millisecond later
    f.now = "2026-03-02T00:00:00Z".parse().unwrap();
    let next = f.evaluate(second.id, &plan()).await;
    assert_eq!(next.day, date(2026, 3, 2));
    assert_eq!(f.store.evaluations_of(team.id).await.unwrap().len(), 2);
    assert_eq!(
        f.store.evaluations_on(date(2026, 3, 2)).await.unwrap(),
        vec![next]
    );
}

#[tokio::test]
async fn of_many_at_once_one_takes_the_turn() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let other = f.reopen().await;
    let attempts = (0..20).map(|index| {
        let store = if index % 2 == 0 {
            f.store.clone()
        } else {
            other.clone()
        };
        let (id, now) = (submission.id, f.now);
        tokio::spawn(async move {
            store
                .create_evaluation(Actor::Organiser, id, &plan(), now)
                .await
        })
    });
    let mut created = 0;
    for attempt in attempts.collect::<Vec<_>>() {
        match attempt.await.unwrap() {
            Ok(_) => created += 1,
            Err(StoreError::AlreadyEvaluated { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
    assert_eq!(created, 1);
}

#[tokio::test]
async fn a_cancelled_run_gives_the_turn_back_and_loses_its_workers() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.store
        .cancel_evaluation(
            Actor::Organiser,
            evaluation.id,
            "power cut announced",
            f.now,
        )
        .await
        .unwrap();
    assert!(!f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap());
    assert_eq!(f.play(&claim, &shard, 0).await, Committed::LeaseLost);
    assert!(f.claim().await.is_none());
    assert_eq!(
        f.state(evaluation.id).await,
        EvaluationState::Cancelled {
            finished_at: f.now,
            reason: "power cut announced".into()
        }
    );
    let again = f
        .store
        .cancel_evaluation(Actor::Organiser, evaluation.id, "", f.now)
        .await;
    assert!(matches!(again, Err(StoreError::Conflict(_))));
    assert_eq!(
        f.store
            .start_day(Actor::Organiser, &plan(), f.now)
            .await
            .unwrap()
            .len(),
        1
    );
}

#[tokio::test]
async fn the_day_starts_the_newest_valid_submission_of_each_team_once() {
    let mut f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await;
    let beta = f.ready_team("Beta").await;
    let silent = f.team("Never uploaded").await;
    let broken = f.team("Broken").await;
    f.upload(&broken).await;
    let (claim, _) = f.claim_smoke().await;
    let outcome = SmokeOutcome::Invalid {
        agent_name: None,
        reason: "no agent.toml".into(),
        log: String::new(),
    };
    f.store.commit_smoke(&claim, outcome, f.now).await.unwrap();
    f.later(1);
    let team = f.store.team(alpha.team).await.unwrap();
    f.upload(&team).await;
    let newer = f.validate().await;
    f.upload(&team).await; // still validating: the one before it counts

    let started = f
        .store
        .start_day(Actor::Organiser, &plan(), f.now)
        .await
        .unwrap();
    let submissions: Vec<_> = started.iter().map(|e| e.submission).collect();
    assert_eq!(
        submissions,
        [beta.id, newer.id],
        "earliest submission first"
    );
    assert!(
        f.store
            .start_day(Actor::Organiser, &plan(), f.now)
            .await
            .unwrap()
            .is_empty()
    );
    assert!(f.store.evaluations_of(silent.id).await.unwrap().is_empty());
    assert!(f.store.evaluations_of(broken.id).await.unwrap().is_empty());
}

#[tokio::test]
async fn the_schedule_starts_a_day_once_whoever_asks() {
    let mut f = Fixture::new().await;
    f.ready_team("Alpha").await;
    assert_eq!(f.store.last_scheduled_day().await.unwrap(), None);
    let started = f
        .store
        .start_scheduled_day(&plan(), f.now)
        .await
        .unwrap()
        .unwrap();
    assert_eq!(started.len(), 1);
    let other = f.reopen().await;
    assert!(
        other
            .start_scheduled_day(&plan(), f.now)
            .await
            .unwrap()
            .is_none()
    );
    assert_eq!(
        other.last_scheduled_day().await.unwrap(),
        Some(date(2026, 3, 1))
    );
    f.later(86_400);
    assert_eq!(
        other
            .start_scheduled_day(&plan(), f.now)
            .await
            .unwrap()
            .unwrap()
            .len(),
        1
    );
    // a clock that was set back starts nothing
    f.later(-86_400);
    assert!(
        f.store
            .start_scheduled_day(&plan(), f.now)
            .await
            .unwrap()
            .is_none()
    );
}

#[tokio::test]
async fn an_empty_plan_is_refused() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let bad = [
        RunPlan {
            tasks: vec![],
            ..plan()
        },
        RunPlan {
            tasks: vec![plan().tasks[0]; 2],
            ..plan()
        },
        RunPlan {
            episodes_per_task: 0,
            ..plan()
        },
        RunPlan {
            episodes_per_shard: 0,
            ..plan()
        },
    ];
    for plan in bad {
        let error = f
            .store
            .create_evaluation(Actor::Organiser, submission.id, &plan, f.now)
            .await
            .unwrap_err();
        assert!(matches!(error, StoreError::Conflict(_)), "{error}");
        f.store
            .start_day(Actor::Organiser, &plan, f.now)
            .await
            .unwrap_err();
    }
    assert!(
        f.store
            .evaluations_of(submission.team)
            .await
            .unwrap()
            .is_empty()
    );
}

#[tokio::test]
async fn the_board_shows_each_teams_newest_finished_day() {
    let mut f = Fixture::new().await;
    f.ready_team("Alpha").await;
    f.ready_team("Beta").await;
    let small = RunPlan {
        tasks: vec![faceoff_types::Task::Hit],
        episodes_per_task: 1,
        ..plan()
    };
    for (day, score) in [(1, 10.0), (2, 20.0), (3, 30.0)] {
        f.now = format!("2026-03-0{day}T12:00:00Z").parse().unwrap();
        assert_eq!(
            f.store
                .start_day(Actor::Organiser, &small, f.now)
                .await
                .unwrap()
                .len(),
            2
        );
        for team in 0..2 {
            let (claim, _, shard) = f.claim_shard().await;
            // on day 3 Beta's agent breaks down
            let faults = u32::from(day == 3 && team == 1);
            let mut commit = commit(&shard, faults);
            commit.stopped_by_faults = faults > 0;
            f.store.commit_shard(&claim, commit, f.now).await.unwrap();
            if faults == 0 {
                let (claim, _) = f.claim_scoring().await;
                f.finish(&claim, score, "d").await;
            }
        }
    }
    let board = f.store.board(Ruleset::CURRENT).await.unwrap();
    let rows: Vec<_> = board
        .iter()
        .map(|r| (r.team.name.as_str(), r.day, r.result.score))
        .collect();
    assert_eq!(
        rows,
        [
            ("Alpha", date(2026, 3, 3), 30.0),
            ("Beta", date(2026, 3, 2), 20.0)
        ]
    );
}
