//! Days that take too long: they continue before later days, until their deadline.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::Timestamp;

/// Two shards of one task, so that a day can be half finished.
fn two_shards() -> RunPlan {
    RunPlan {
        tasks: vec![Task::Hit],
        ..plan()
    }
}

/// The first stage, with days at 10:00 UTC and this deadline.
async fn daily(f: &TestStore, day_deadline: DayDeadline) -> StageId {
    let (rules, settings) = rules_and_settings(&two_shards());
    let settings = StageSettings {
        schedule: Some(Schedule::daily("10:00".parse().unwrap())),
        day_deadline,
        ..settings
    };
    let configured = f
        .store
        .configure_stage(rules, settings, Zone::UTC, f.now)
        .await;
    configured.unwrap();
    f.store.stages().await.unwrap()[0].id
}

async fn start(f: &TestStore, stage: StageId) -> Vec<Evaluation> {
    let started = f.store.start_scheduled_day(stage, f.now).await.unwrap();
    started.expect("the day has not started before")
}

/// Runs the next shard. Returns the date of its day and its team.
async fn run_shard(f: &TestStore) -> (String, TeamId) {
    let Some(ClaimedJob {
        claim,
        job: Job::Shard { owner, shard, .. },
    }) = f.claim().await
    else {
        panic!("a shard is queued")
    };
    f.commit_shard(&claim, &shard, 0).await;
    let RunOwner::Evaluation(id) = owner else {
        panic!("expected a shard of an evaluation, claimed one of {owner:?}")
    };
    let played = f.store.evaluation(id).await.unwrap();
    (played.stage_day.date.to_string(), played.team)
}

fn at(text: &str) -> Timestamp {
    text.parse().unwrap()
}

async fn kinds_since(f: &TestStore, id: i64) -> Vec<String> {
    let events = f.store.events_after(id, 1000).await.unwrap();
    let kind = |record: &EventRecord| {
        let event = serde_json::to_value(&record.event).unwrap();
        event["kind"].as_str().unwrap().to_owned()
    };
    events.iter().map(kind).collect()
}

#[tokio::test]
async fn unfinished_day_runs_before_the_next_one() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = [f.ready_team("Alpha").await, f.ready_team("Beta").await];
    let stage = daily(&f, DayDeadline::Hours(30)).await;
    assert_eq!(start(&f, stage).await.len(), 2);
    // Alpha's agent is slow: by slot time Beta would be preferred for a long time.
    let Some(ClaimedJob {
        claim,
        job: Job::Shard { shard, .. },
    }) = f.claim().await
    else {
        panic!("a shard is queued")
    };
    f.later(24 * 3600);
    f.commit_shard(&claim, &shard, 0).await;
    let gamma = f.ready_team("Gamma").await;
    assert_eq!(start(&f, stage).await.len(), 3);

    let mut order = Vec::new();
    while order.len() < 9 {
        match f.store.claim("slot 0", LEASE_S, f.now).await.unwrap() {
            Some(ClaimedJob {
                claim,
                job: Job::Scoring { .. },
            }) => {
                f.finish(&claim, 1.0, "d").await;
            }
            Some(ClaimedJob {
                claim,
                job: Job::Shard { owner, shard, .. },
            }) => {
                f.commit_shard(&claim, &shard, 0).await;
                let RunOwner::Evaluation(id) = owner else {
                    panic!("{owner:?}")
                };
                let played = f.store.evaluation(id).await.unwrap();
                order.push((played.stage_day.date.to_string(), played.team));
            }
            other => panic!("{other:?}"),
        }
    }
    let days: Vec<&str> = order.iter().map(|(day, _)| day.as_str()).collect();
    let (first, second) = ("2026-03-01", "2026-03-02");
    assert_eq!(days[..3], [first; 3], "{order:?}");
    assert_eq!(days[3..], [second; 6]);
    // On the first day Beta comes first, since its agent used no slot time. On the second day all teams get equal shares.
    assert_eq!(order[0].1, beta.team);
    assert_eq!(order[1].1, beta.team);
    assert_eq!(order[2].1, alpha.team);
    assert!(order[3..].iter().any(|(_, team)| *team == gamma.team));
}

#[tokio::test]
async fn deadline_ends_open_evaluations_and_releases_the_day() {
    let mut f = TestStore::new().await;
    let alpha = f.ready_team("Alpha").await;
    let stage = daily(&f, DayDeadline::NextCut).await;
    let of = start(&f, stage).await[0].stage_day;
    f.run_all(1.0).await;
    f.later(24 * 3600);
    let beta = f.ready_team("Beta").await;
    let second = start(&f, stage).await;
    let deadline = at("2026-03-03T10:00:00Z");
    assert_eq!(second[0].deadline_at, Some(deadline));
    let id_of = |team: TeamId| second.iter().find(|one| one.team == team).unwrap().id;
    // Beta's evaluation is complete but not scored; Alpha's is half done.
    while f.state(id_of(beta.team)).await != EvaluationState::Finalising {
        let (_, team) = run_shard(&f).await;
        if team == alpha.team {
            break;
        }
    }
    let held = loop {
        match f.claim().await.unwrap() {
            ClaimedJob {
                claim,
                job: Job::Shard { owner, shard, .. },
            } => {
                if owner == RunOwner::Evaluation(id_of(alpha.team)) {
                    break (claim, shard);
                }
                f.commit_shard(&claim, &shard, 0).await;
            }
            ClaimedJob {
                claim,
                job: Job::Scoring { .. },
            } => f.store.release(&claim, f.now).await.unwrap(),
            other => panic!("{other:?}"),
        }
    };
    while f.state(id_of(beta.team)).await != EvaluationState::Finalising {
        run_shard(&f).await;
    }
    let before = f.store.events_after(0, 1000).await.unwrap();
    let before = before.last().unwrap().id;

    f.now = deadline - jiff::SignedDuration::from_millis(1);
    assert_eq!(f.store.end_overdue_days(f.now).await.unwrap(), []);
    f.now = deadline;
    let overdue = second[0].stage_day;
    let ended = f.store.end_overdue_days(f.now).await.unwrap();
    assert_eq!(ended, [(overdue, 1)]);
    let EvaluationState::NotPlayed {
        finished_at,
        reason,
    } = f.state(id_of(alpha.team)).await
    else {
        panic!("expected that the evaluation has ended")
    };
    assert_eq!(finished_at, deadline);
    for words in [
        "2026-03-03 at 10:00:00 UTC",
        "the server ran out of time",
        "no agent fault",
    ] {
        assert!(reason.contains(words), "{words} is not in {reason}");
    }
    assert_eq!(
        f.commit_shard(&held.0, &held.1, 0).await,
        CommitOutcome::LeaseLost
    );
    assert_eq!(
        kinds_since(&f, before).await,
        ["day_overdue", "evaluation_not_played"]
    );
    assert_eq!(f.store.end_overdue_days(f.now).await.unwrap(), [], "once");
    // The complete evaluation is scored, and then the day is released.
    let (claim, scored) = f.claim_scoring().await;
    assert_eq!(scored, id_of(beta.team));
    f.finish(&claim, 2.0, "d").await;
    let days = f.store.days().await.unwrap();
    assert_eq!(days[0].0.stage_day, overdue);
    assert_eq!(days[0].0.released_at, Some(f.now));
    assert!(f.claim().await.is_none(), "there is no automatic rerun");

    let board: Vec<_> = f.board().await;
    let rows: Vec<_> = board
        .iter()
        .map(|row| (row.team.id, row.day, row.result.score))
        .collect();
    assert_eq!(
        rows,
        [(alpha.team, of.date, 1.0), (beta.team, overdue.date, 2.0)],
        "the older row stays"
    );
    // An organiser can rerun it, without a deadline.
    let rerun = f
        .store
        .rerun_evaluation(Actor::Organiser, id_of(alpha.team), f.now)
        .await
        .unwrap();
    f.later(3600);
    assert_eq!(f.store.end_overdue_days(f.now).await.unwrap(), []);
    f.run_all(3.0).await;
    assert!(matches!(
        f.state(rerun.id).await,
        EvaluationState::Finished { .. }
    ));
}

#[tokio::test]
async fn overdue_day_without_scoring_is_released_at_once() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let stage = daily(&f, DayDeadline::Hours(1)).await;
    let started = start(&f, stage).await;
    // An automatic rerun after a platform fault has no time left.
    let broken = f.fail_next().await;
    let evaluations = f
        .store
        .evaluations_of_day(started[0].stage_day)
        .await
        .unwrap();
    assert_eq!(evaluations.len(), 2, "the rerun is queued");
    f.later(3600);
    f.store.end_overdue_days(f.now).await.unwrap();
    let (day, finished) = f.store.days().await.unwrap()[0];
    assert_eq!((day.released_at, finished), (Some(f.now), 0));
    assert!(matches!(
        f.state(broken).await,
        EvaluationState::PlatformFailed { .. }
    ));
    let evaluations = f.store.evaluations_of_day(day.stage_day).await.unwrap();
    let not_played = evaluations.iter().find(|one| one.id != broken).unwrap();
    assert!(matches!(
        not_played.state,
        EvaluationState::NotPlayed { .. }
    ));
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn closed_stage_continues_its_day_until_the_deadline() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let stage = daily(&f, DayDeadline::NextCut).await;
    let closing = StageChange {
        closes_at: Some(Some(at("2026-03-01T12:00:00Z"))),
        ..StageChange::default()
    };
    let closing = f
        .store
        .change_stage(Actor::Organiser, stage, closing, f.now);
    closing.await.unwrap();
    start(&f, stage).await;
    f.later(4 * 3600);
    assert_eq!(f.store.end_overdue_days(f.now).await.unwrap(), []);
    run_shard(&f).await;
    f.later(20 * 3600);
    let ended = f.store.end_overdue_days(f.now).await.unwrap();
    assert_eq!(ended.len(), 1, "its next cutoff would have been now");
    assert!(f.claim().await.is_none());
    let none = f.store.start_scheduled_day(stage, f.now).await.unwrap();
    assert_eq!(none, None);
}

#[tokio::test]
async fn deadline_follows_settings_but_never_into_the_past() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let stage = daily(&f, DayDeadline::NextCut).await;
    start(&f, stage).await;
    let change = async |f: &TestStore, day_deadline| {
        let settings = f.store.stage(stage).await.unwrap().settings;
        let wanted = StageChange {
            settings: Some(StageSettings {
                day_deadline,
                ..settings
            }),
            ..StageChange::default()
        };
        f.store
            .change_stage(Actor::Organiser, stage, wanted, f.now)
            .await
    };
    let deadline =
        async |f: &TestStore| f.store.unreleased_days(stage).await.unwrap()[0].deadline_at;
    f.later(2 * 3600);
    change(&f, DayDeadline::Hours(3)).await.unwrap();
    assert_eq!(deadline(&f).await, Some(at("2026-03-01T13:00:00Z")));
    let Err(StoreError::Conflict(why)) = change(&f, DayDeadline::Hours(2)).await else {
        panic!("expected a conflict, since the deadline would have passed")
    };
    assert!(why.contains("2026-03-01T12:00:00Z"), "{why}");
    assert_eq!(deadline(&f).await, Some(at("2026-03-01T13:00:00Z")));
    // A server that starts with a changed configuration does not end the day.
    daily(&f, DayDeadline::Hours(2)).await;
    assert_eq!(deadline(&f).await, Some(at("2026-03-01T13:00:00Z")));
    change(&f, DayDeadline::Never).await.unwrap();
    assert_eq!(deadline(&f).await, None);
    f.later(1000 * 3600);
    assert_eq!(f.store.end_overdue_days(f.now).await.unwrap(), []);
}
