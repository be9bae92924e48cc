//! Days that take too long: workers run their evaluations before those of later days, until the day's deadline ends them.
//! A day starts at its *cutoff* and is *released* once all its evaluations have ended: then its seed and datasets are no longer secret.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_testkit::change_settings;
use faceoff_types::*;

/// Configures the first stage with days at 10:00 UTC and this deadline.
async fn configure_daily_stage(f: &TestStore, day_deadline: DayDeadline) -> StageId {
    let (rules, settings) = rules_and_settings(&two_shard_plan());
    let settings = StageSettings {
        schedule: Some(Schedule::daily("10:00".parse().unwrap())),
        day_deadline,
        ..settings
    };
    let change = f
        .store
        .configure_stage(rules, settings, IanaTimeZone::UTC, f.now)
        .await;
    change.unwrap();
    f.store.stages().await.unwrap()[0].id
}

async fn start_day(f: &TestStore, stage: StageId) -> Vec<Evaluation> {
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
    f.commit_shard(&claim, &shard).await;
    let RunOwner::Evaluation { id, .. } = owner else {
        panic!("expected a shard of an evaluation, claimed one of {owner:?}")
    };
    let played = f.store.evaluation(id).await.unwrap();
    (played.stage_day.date.to_string(), played.team)
}

#[tokio::test]
async fn unfinished_day_runs_before_the_next_one() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = f.two_valid_submissions().await;
    let stage = configure_daily_stage(&f, DayDeadline::Hours(30)).await;
    assert_eq!(start_day(&f, stage).await.len(), 2);
    // Alpha's agent is slow: since teams share the workers' time equally, Beta's evaluations would be preferred for a long time.
    let Some(ClaimedJob {
        claim,
        job: Job::Shard { shard, .. },
    }) = f.claim().await
    else {
        panic!("a shard is queued")
    };
    f.advance_clock_s(24 * 3600);
    f.commit_shard(&claim, &shard).await;
    let gamma = f.valid_submission_of("Gamma").await;
    assert_eq!(start_day(&f, stage).await.len(), 3);

    // Dates and teams of the shards, in the order of their runs: 3 of the first day (Alpha's first shard is done), 6 of the second.
    let mut order = Vec::new();
    while order.len() < 9 {
        match f.store.claim("slot 0", LEASE_S, f.now).await.unwrap() {
            Some(ClaimedJob {
                claim,
                job: Job::Scoring { .. },
            }) => {
                f.finish_scoring(&claim, 1.0, DATASET_KEY).await;
            }
            Some(ClaimedJob {
                claim,
                job: Job::Shard { owner, shard, .. },
            }) => {
                f.commit_shard(&claim, &shard).await;
                let RunOwner::Evaluation { id, .. } = owner else {
                    panic!("expected a shard of an evaluation, claimed one of {owner:?}")
                };
                let played = f.store.evaluation(id).await.unwrap();
                order.push((played.stage_day.date.to_string(), played.team));
            }
            other => panic!("expected a shard or a scoring job, claimed {other:?}"),
        }
    }
    let days: Vec<&str> = order.iter().map(|(day, _)| day.as_str()).collect();
    let (first, second) = ("2026-03-01", "2026-03-02");
    assert_eq!(days[..3], [first; 3], "{order:?}");
    assert_eq!(days[3..], [second; 6]);
    // On the first day Beta comes first, since its agent used no time of workers. On the second day all teams get equal shares.
    assert_eq!(order[0].1, beta.team);
    assert_eq!(order[1].1, beta.team);
    assert_eq!(order[2].1, alpha.team);
    assert!(order[3..].iter().any(|(_, team)| *team == gamma.team));
}

#[tokio::test]
async fn deadline_ends_open_evaluations_and_releases_the_day() {
    let mut f = TestStore::new().await;
    let alpha = f.valid_submission_of("Alpha").await;
    let stage = configure_daily_stage(&f, DayDeadline::NextCutoff).await;
    let first_day = start_day(&f, stage).await[0].stage_day;
    f.run_all_with_score(1.0).await;
    f.advance_clock_s(24 * 3600);
    let beta = f.valid_submission_of("Beta").await;
    let second = start_day(&f, stage).await;
    let deadline = time("2026-03-03T10:00:00Z");
    assert_eq!(second[0].deadline_at, Some(deadline));
    let id_of = |team: TeamId| {
        second
            .iter()
            .find(|evaluation| evaluation.team == team)
            .unwrap()
            .id
    };
    // Beta's evaluation is complete but not scored; Alpha's is half done.
    while f.state(id_of(beta.team)).await != EvaluationState::Scoring {
        let (_, team) = run_shard(&f).await;
        if team == alpha.team {
            break;
        }
    }
    // Leaves one shard of Alpha leased.
    let (alpha_claim, alpha_shard) = loop {
        match f.claim().await.unwrap() {
            ClaimedJob {
                claim,
                job: Job::Shard { owner, shard, .. },
            } => {
                if matches!(owner, RunOwner::Evaluation { id, .. } if id == id_of(alpha.team)) {
                    break (claim, shard);
                }
                f.commit_shard(&claim, &shard).await;
            }
            ClaimedJob {
                claim,
                job: Job::Scoring { .. },
            } => f.store.release(&claim, f.now).await.unwrap(),
            other => panic!("expected a shard or a scoring job, claimed {other:?}"),
        }
    };
    while f.state(id_of(beta.team)).await != EvaluationState::Scoring {
        run_shard(&f).await;
    }
    let events = f.store.events_after(0, 1000).await.unwrap();
    let newest_event = events.last().unwrap().id;

    f.now = deadline - jiff::SignedDuration::from_millis(1);
    assert_eq!(f.store.end_overdue_days(f.now).await.unwrap(), []);
    f.now = deadline;
    let overdue = second[0].stage_day;
    let ended = f.store.end_overdue_days(f.now).await.unwrap();
    assert_eq!(ended, [(overdue, 1)]);
    let EvaluationState::DeadlineMissed {
        finished_at,
        reason,
    } = f.state(id_of(alpha.team)).await
    else {
        panic!("expected that the evaluation has ended")
    };
    assert_eq!(finished_at, deadline);
    for phrase in [
        "2026-03-03 at 10:00:00 UTC",
        "the server ran out of time",
        "no agent fault",
    ] {
        assert!(reason.contains(phrase), "{phrase} is not in {reason}");
    }
    assert_eq!(
        f.commit_shard(&alpha_claim, &alpha_shard).await,
        CommitOutcome::LeaseLost
    );
    assert_eq!(
        f.event_kinds_since(newest_event).await,
        ["day_overdue", "evaluation_not_played"]
    );
    assert_eq!(
        f.store.end_overdue_days(f.now).await.unwrap(),
        [],
        "the day is ended once"
    );
    // The complete evaluation is scored, and then the day is released.
    let (claim, scored) = f.claim_scoring().await;
    assert_eq!(scored, id_of(beta.team));
    f.finish_scoring(&claim, 2.0, DATASET_KEY).await;
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
        [
            (alpha.team, first_day.date, 1.0),
            (beta.team, overdue.date, 2.0)
        ],
        "the result of the older day stays"
    );
    // An organiser can rerun the evaluation, without a deadline.
    let rerun = f
        .store
        .rerun_evaluation(Actor::Operator, id_of(alpha.team), f.now)
        .await
        .unwrap();
    f.advance_clock_s(3600);
    assert_eq!(f.store.end_overdue_days(f.now).await.unwrap(), []);
    f.run_all_with_score(3.0).await;
    assert!(matches!(
        f.state(rerun.id).await,
        EvaluationState::Finished { .. }
    ));
}

#[tokio::test]
async fn overdue_day_without_scoring_is_released_at_once() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let stage = configure_daily_stage(&f, DayDeadline::Hours(1)).await;
    let started = start_day(&f, stage).await;
    // An automatic rerun after a platform fault has no time left.
    let failed = f.fail_next_evaluation().await;
    let evaluations = f
        .store
        .evaluations_of_day(started[0].stage_day)
        .await
        .unwrap();
    assert_eq!(evaluations.len(), 2, "the rerun is queued");
    f.advance_clock_s(3600);
    f.store.end_overdue_days(f.now).await.unwrap();
    let (day, finished) = f.store.days().await.unwrap()[0];
    assert_eq!((day.released_at, finished), (Some(f.now), 0));
    assert!(matches!(
        f.state(failed).await,
        EvaluationState::PlatformFailed { .. }
    ));
    let evaluations = f.store.evaluations_of_day(day.stage_day).await.unwrap();
    let deadline_missed = evaluations
        .iter()
        .find(|evaluation| evaluation.id != failed)
        .unwrap();
    assert!(matches!(
        deadline_missed.state,
        EvaluationState::DeadlineMissed { .. }
    ));
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn closed_stage_continues_its_day_until_the_deadline() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let stage = configure_daily_stage(&f, DayDeadline::NextCutoff).await;
    let closing = StageChange {
        closes_at: Some(Some(time("2026-03-01T12:00:00Z"))),
        ..StageChange::default()
    };
    let changed = f.store.change_stage(Actor::Operator, stage, closing, f.now);
    changed.await.unwrap();
    start_day(&f, stage).await;
    f.advance_clock_s(4 * 3600);
    assert_eq!(f.store.end_overdue_days(f.now).await.unwrap(), []);
    run_shard(&f).await;
    f.advance_clock_s(20 * 3600);
    let ended = f.store.end_overdue_days(f.now).await.unwrap();
    assert_eq!(ended.len(), 1, "the next cutoff would have been now");
    assert!(f.claim().await.is_none());
    let started = f.store.start_scheduled_day(stage, f.now).await.unwrap();
    assert_eq!(started, None);
}

#[tokio::test]
async fn deadline_follows_settings_but_never_into_the_past() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let stage = configure_daily_stage(&f, DayDeadline::NextCutoff).await;
    start_day(&f, stage).await;
    let change_deadline = async |f: &TestStore, day_deadline| {
        change_settings(&f.store, stage, f.now, |settings| {
            settings.day_deadline = day_deadline;
        })
        .await
    };
    let deadline =
        async |f: &TestStore| f.store.unreleased_days(stage).await.unwrap()[0].deadline_at;
    f.advance_clock_s(2 * 3600);
    change_deadline(&f, DayDeadline::Hours(3)).await.unwrap();
    assert_eq!(deadline(&f).await, Some(time("2026-03-01T13:00:00Z")));
    let Err(StoreError::Conflict(reason)) = change_deadline(&f, DayDeadline::Hours(2)).await else {
        panic!("expected a conflict, since the deadline would have passed")
    };
    assert!(reason.contains("2026-03-01T12:00:00Z"), "{reason}");
    assert_eq!(deadline(&f).await, Some(time("2026-03-01T13:00:00Z")));
    // A server that starts with a changed configuration does not end the day.
    configure_daily_stage(&f, DayDeadline::Hours(2)).await;
    assert_eq!(deadline(&f).await, Some(time("2026-03-01T13:00:00Z")));
    change_deadline(&f, DayDeadline::Never).await.unwrap();
    assert_eq!(deadline(&f).await, None);
    f.advance_clock_s(1000 * 3600);
    assert_eq!(f.store.end_overdue_days(f.now).await.unwrap(), []);
}
