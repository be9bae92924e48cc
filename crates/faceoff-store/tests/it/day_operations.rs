//! Organisers' operations on boards and days: freezes of boards, missed days (started later with their own date), and extra
//! evaluations (of one team, beside those that the day's start created).

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::civil::Date;

const REASON: &str = "the network was down";

/// Kinds of the subject's events, the oldest first.
async fn event_kinds(f: &TestStore, subject: Subject) -> Vec<String> {
    let events = f.store.events_after(0, 1000).await.unwrap();
    let records = events.iter().filter(|record| record.subject == subject);
    records.map(event_kind).collect()
}

#[tokio::test]
async fn frozen_board_omits_later_results() {
    let mut f = TestStore::new().await;
    let alpha = f.valid_submission_of("Alpha").await;
    let stage = f
        .evaluate(alpha.id, &one_shard_plan())
        .await
        .stage_day
        .stage;
    f.run_all_with_score(1.0).await;
    f.advance_clock_s(24 * 3600);
    let freeze = async |f: &TestStore| {
        f.store
            .freeze_boards(Actor::Operator, stage, REASON, f.now)
            .await
    };
    freeze(&f).await.unwrap();
    assert_conflict(freeze(&f).await, &["frozen already", "2026-03-02"]);
    let frozen = f.store.board_freeze(stage).await.unwrap().unwrap();
    assert_eq!((frozen.at, frozen.reason.as_str()), (f.now, REASON));

    f.advance_clock_s(60);
    let beta = f.valid_submission_of("Beta").await;
    f.evaluate(beta.id, &one_shard_plan()).await;
    f.run_all_with_score(2.0).await;
    let scope = BoardScope {
        finished_until: Some(frozen.at),
        ..BoardScope::default()
    };
    let frozen_stage = f.store.stage(stage).await.unwrap();
    let revision = f.store.board_revision_within(&frozen_stage, &scope).await;
    let revision = revision.unwrap();
    let shown = f.store.board_within(stage, revision, &scope).await.unwrap();
    let scores =
        |rows: &[BoardRecord]| -> Vec<f64> { rows.iter().map(|row| row.result.score).collect() };
    assert_eq!(scores(&shown), [1.0]);
    assert_eq!(scores(&f.board().await), [2.0, 2.0], "the live board");
    // If a result is excluded, the team's previous result counts.
    let excluding = BoardScope {
        excluded: vec![f.board().await[0].evaluation],
        ..BoardScope::default()
    };
    let shown = f.store.board_within(stage, revision, &excluding).await;
    assert_eq!(scores(&shown.unwrap()), [1.0, 2.0]);

    let unfreeze =
        async |f: &TestStore| f.store.unfreeze_boards(Actor::Operator, stage, f.now).await;
    unfreeze(&f).await.unwrap();
    assert_conflict(unfreeze(&f).await, &["not frozen"]);
    assert_eq!(f.store.board_freeze(stage).await.unwrap(), None);
    let stage_events = event_kinds(&f, Subject::Stage(stage)).await;
    assert_eq!(
        stage_events[stage_events.len() - 2..],
        ["boards_frozen", "boards_unfrozen"]
    );
    let unknown = StageId::new();
    let result = f
        .store
        .freeze_boards(Actor::Operator, unknown, REASON, f.now);
    assert!(matches!(result.await, Err(StoreError::NotFound("stage"))));
}

#[tokio::test]
async fn missed_day_runs_on_its_date_with_active_submissions() {
    let mut f = TestStore::new().await;
    let alpha = f.valid_submission_of("Alpha").await;
    let first = f.evaluate(alpha.id, &one_shard_plan()).await.stage_day;
    f.run_all_with_score(1.0).await;
    f.advance_clock_s(3 * 24 * 3600);
    let newest = f.evaluate(alpha.id, &one_shard_plan()).await.stage_day;
    f.run_all_with_score(4.0).await;
    let beta = f.valid_submission_of("Beta").await;
    let start_missed = async |f: &TestStore, date: &str| {
        let date: Date = date.parse().unwrap();
        let stage_day = StageDay { date, ..first };
        f.store
            .start_missed_day(Actor::Operator, stage_day, REASON, f.now)
            .await
    };
    f.advance_clock_s(60);
    let started = start_missed(&f, "2026-03-02").await.unwrap();
    assert_eq!(started.len(), 2, "Beta's submission is active now, too");
    let missed_day = started[0].stage_day;
    let (day, _) = f.store.days().await.unwrap()[0];
    assert_eq!(
        (day.stage_day, day.cutoff_at),
        (missed_day, f.now),
        "the cutoff is the actual time"
    );
    assert_eq!(
        f.store.missed_days().await.unwrap(),
        [(missed_day, REASON.to_owned())]
    );
    let (claim, run, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard).await;
    assert_eq!(
        run.seed,
        SeedLabel::StageDay(missed_day),
        "the day has the episodes of its own date"
    );
    f.run_all_with_score(2.0).await;
    assert!(f.store.days().await.unwrap()[0].0.released_at.is_some());
    let board = f.board().await;
    let rows: Vec<_> = board.iter().map(|row| (row.team.id, row.day)).collect();
    assert_eq!(
        rows,
        [(alpha.team, newest.date), (beta.team, missed_day.date)],
        "the result of the newest date counts"
    );
    assert_eq!(
        event_kinds(&f, Subject::Day(missed_day)).await,
        ["missed_day_started", "day_started", "day_released"]
    );
    // The schedule continues from the newest date, regardless of missed days.
    let stage = f.store.stage(missed_day.stage).await.unwrap();
    assert_eq!(
        f.store
            .newest_day(stage.id)
            .await
            .unwrap()
            .unwrap()
            .stage_day,
        newest
    );

    for started_date in ["2026-03-02", "2026-03-01"] {
        let repeated = start_missed(&f, started_date).await;
        assert!(
            matches!(repeated, Err(StoreError::CutoffPassed { .. })),
            "{repeated:?}"
        );
    }
    for today_or_later in ["2026-03-04", "2026-03-05"] {
        assert_conflict(
            start_missed(&f, today_or_later).await,
            &["not passed", "2026-03-04"],
        );
    }
    assert_conflict(
        start_missed(&f, "2025-11-30").await,
        &["before the stage's first day", "2025-12-01"],
    );
    f.close_stage_after_s(missed_day.stage, 1).await;
    let result = start_missed(&f, "2026-03-03").await;
    assert!(
        matches!(result, Err(StoreError::StageNotOpen { .. })),
        "{result:?}"
    );
    assert_eq!(f.store.days().await.unwrap().len(), 3);
}

/// Adds an extra evaluation of a team on this day; if `replaces`, in place of its result of the day.
async fn add_extra(
    f: &TestStore,
    stage_day: StageDay,
    team: TeamId,
    replaces: bool,
) -> Result<Evaluation, StoreError> {
    f.store
        .add_extra_evaluation(Actor::Operator, stage_day, team, REASON, replaces, f.now)
        .await
}

#[tokio::test]
async fn extra_evaluation_of_open_day_uses_its_episodes() {
    let f = TestStore::new().await;
    let day = f.start_evaluation(&one_shard_plan()).await;
    let late = f.create_team("Late").await;
    assert_conflict(
        add_extra(&f, day.stage_day, late.id, false).await,
        &["no active submission"],
    );
    f.upload(&late).await;
    f.validate().await;
    let extra_evaluation = add_extra(&f, day.stage_day, late.id, false).await.unwrap();
    assert_eq!(extra_evaluation.extra_reason.as_deref(), Some(REASON));
    assert_conflict(
        add_extra(&f, day.stage_day, late.id, false).await,
        &["queued or running"],
    );
    let mut labels = Vec::new();
    while let Some(ClaimedJob { claim, job }) = f.claim().await {
        match job {
            Job::Shard { run, shard, .. } => {
                labels.push(run.seed);
                f.commit_shard(&claim, &shard).await;
            }
            _ => {
                let released = f.store.days().await.unwrap()[0].0.released_at;
                assert_eq!(released, None, "the day waits for the extra evaluation");
                f.finish_scoring(&claim, 1.0, DATASET_KEY).await;
            }
        }
    }
    assert_eq!(labels, [SeedLabel::StageDay(day.stage_day); 2]);
    assert!(f.store.days().await.unwrap()[0].0.released_at.is_some());
    let board = f.board().await;
    let reasons: Vec<_> = board
        .iter()
        .map(|row| row.extra_reason.as_deref())
        .collect();
    assert_eq!(reasons, [None, Some(REASON)]);
}

#[tokio::test]
async fn extra_evaluation_of_released_day_gets_new_episodes() {
    let mut f = TestStore::new().await;
    let alpha = f.valid_submission_of("Alpha").await;
    let day = f.evaluate(alpha.id, &one_shard_plan()).await;
    f.run_all_with_score(1.0).await;
    assert_conflict(
        add_extra(&f, day.stage_day, alpha.team, false).await,
        &["counting", "replace"],
    );
    f.upload(&f.store.team(alpha.team).await.unwrap()).await;
    let newer = f.validate().await;
    let extra_evaluation = add_extra(&f, day.stage_day, alpha.team, true)
        .await
        .unwrap();
    assert_eq!(
        (extra_evaluation.submission, extra_evaluation.stage_day),
        (newer.id, day.stage_day),
        "the submission that is active now"
    );
    let replaced = f.store.evaluation(day.id).await.unwrap().voided.unwrap();
    assert_eq!(
        replaced.reason,
        format!("replaced by an extra evaluation: {REASON}")
    );
    let (claim, run, _) = f.claim_shard().await;
    assert_eq!(run.seed, SeedLabel::Extra(extra_evaluation.id));
    // After platform faults only an organiser can rerun the evaluation: on the same episodes, still as an extra evaluation.
    f.store.release(&claim, f.now).await.unwrap();
    let failed = f.fail_next_evaluation().await;
    assert_eq!(failed, extra_evaluation.id);
    let rerun = f
        .store
        .rerun_evaluation(Actor::Operator, extra_evaluation.id, f.now);
    let rerun = rerun.await.unwrap();
    assert_eq!(rerun.extra_reason.as_deref(), Some(REASON));
    let (claim, run, shard) = f.claim_shard().await;
    assert_eq!(run.seed, SeedLabel::Extra(extra_evaluation.id));
    f.commit_shard(&claim, &shard).await;
    f.run_all_with_score(3.0).await;
    let board = f.board().await;
    assert_eq!(
        (board[0].result.score, board[0].extra_reason.as_deref()),
        (3.0, Some(REASON))
    );
    assert_eq!(
        event_kinds(&f, Subject::Evaluation(extra_evaluation.id)).await[..2],
        ["evaluation_queued", "extra_turn_given"]
    );
}

#[tokio::test]
async fn extra_evaluation_uses_rules_of_its_day() {
    let mut f = TestStore::new().await;
    let alpha = f.valid_submission_of("Alpha").await;
    let day = f.evaluate(alpha.id, &one_shard_plan()).await;
    f.run_all_with_score(1.0).await;
    // The rules change.
    let two_episodes = RunPlan {
        episodes_per_task: 2,
        ..one_shard_plan()
    };
    let stage = f.configure_stage(&two_episodes).await;
    let beta = f.valid_submission_of("Beta").await;
    let extra_evaluation = add_extra(&f, day.stage_day, beta.team, false)
        .await
        .unwrap();
    assert_eq!(
        (
            extra_evaluation.revision,
            extra_evaluation.plan.episodes_per_task
        ),
        (1, 1)
    );
    f.run_all_with_score(2.0).await;

    let not_started = StageDay {
        date: day.stage_day.date.tomorrow().unwrap(),
        stage,
    };
    let result = add_extra(&f, not_started, beta.team, true).await;
    assert!(
        matches!(result, Err(StoreError::NotFound("day"))),
        "{result:?}"
    );
    let unknown_team = add_extra(&f, day.stage_day, TeamId::new(), true).await;
    assert!(
        matches!(unknown_team, Err(StoreError::NotFound("team"))),
        "{unknown_team:?}"
    );
    let disqualified = f
        .store
        .disqualify_team(Actor::Operator, beta.team, REASON, f.now);
    disqualified.await.unwrap();
    let result = add_extra(&f, day.stage_day, beta.team, true).await;
    assert!(
        matches!(result, Err(StoreError::Disqualified { .. })),
        "{result:?}"
    );
    f.close_stage_after_s(stage, 1).await;
    let result = add_extra(&f, day.stage_day, alpha.team, true).await;
    assert!(
        matches!(result, Err(StoreError::StageNotOpen { .. })),
        "{result:?}"
    );
    let voided = f.store.evaluation(day.id).await.unwrap().voided;
    assert_eq!(voided, None, "a refused request changes nothing");
}
