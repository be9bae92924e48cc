//! Organisers' operations on boards and days: freezes, missed days, extra evaluations.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::civil::Date;

const REASON: &str = "the network was down";

#[track_caller]
fn refused<T: std::fmt::Debug>(done: Result<T, StoreError>, words: &[&str]) {
    let Err(StoreError::Conflict(why)) = done else {
        panic!("expected a conflict with {words:?}: {done:?}");
    };
    for word in words {
        assert!(why.contains(word), "{word:?} is not in {why:?}");
    }
}

async fn kinds(f: &TestStore, subject: Subject) -> Vec<String> {
    let events = f.store.events_after(0, 1000).await.unwrap();
    let of = events.iter().filter(|record| record.subject == subject);
    let kind = |record: &EventRecord| {
        let event = serde_json::to_value(&record.event).unwrap();
        event["kind"].as_str().unwrap().to_owned()
    };
    of.map(kind).collect()
}

#[tokio::test]
async fn frozen_board_omits_later_results() {
    let mut f = TestStore::new().await;
    let alpha = f.ready_team("Alpha").await;
    let stage = f.evaluate(alpha.id, &small()).await.stage_day.stage;
    f.run_all(1.0).await;
    f.later(24 * 3600);
    let freeze = async |f: &TestStore| {
        f.store
            .freeze_boards(Actor::Organiser, stage, REASON, f.now)
            .await
    };
    freeze(&f).await.unwrap();
    refused(freeze(&f).await, &["frozen already", "2026-03-02"]);
    let frozen = f.store.board_freeze(stage).await.unwrap().unwrap();
    assert_eq!((frozen.at, frozen.reason.as_str()), (f.now, REASON));

    f.later(60);
    let beta = f.ready_team("Beta").await;
    f.evaluate(beta.id, &small()).await;
    f.run_all(2.0).await;
    let scope = BoardScope {
        finished_until: Some(frozen.at),
        ..BoardScope::default()
    };
    let of_stage = f.store.stage(stage).await.unwrap();
    let revision = f.store.board_revision_within(&of_stage, &scope).await;
    let revision = revision.unwrap();
    let shown = f.store.board_within(stage, revision, &scope).await.unwrap();
    let scores =
        |rows: &[BoardRecord]| -> Vec<f64> { rows.iter().map(|row| row.result.score).collect() };
    assert_eq!(scores(&shown), [1.0]);
    assert_eq!(scores(&f.board().await), [2.0, 2.0], "the live board");
    // If a result is excluded, the team's previous one counts.
    let excluding = BoardScope {
        excluded: vec![f.board().await[0].evaluation],
        ..BoardScope::default()
    };
    let shown = f.store.board_within(stage, revision, &excluding).await;
    assert_eq!(scores(&shown.unwrap()), [1.0, 2.0]);

    let unfreeze = async |f: &TestStore| {
        f.store
            .unfreeze_boards(Actor::Organiser, stage, f.now)
            .await
    };
    unfreeze(&f).await.unwrap();
    refused(unfreeze(&f).await, &["not frozen"]);
    assert_eq!(f.store.board_freeze(stage).await.unwrap(), None);
    let of_stage = kinds(&f, Subject::Stage(stage)).await;
    assert_eq!(
        of_stage[of_stage.len() - 2..],
        ["boards_frozen", "boards_unfrozen"]
    );
    let other = StageId::new();
    let none = f
        .store
        .freeze_boards(Actor::Organiser, other, REASON, f.now);
    assert!(matches!(none.await, Err(StoreError::NotFound("stage"))));
}

#[tokio::test]
async fn missed_day_runs_on_its_date_with_active_submissions() {
    let mut f = TestStore::new().await;
    let alpha = f.ready_team("Alpha").await;
    let first = f.evaluate(alpha.id, &small()).await.stage_day;
    f.run_all(1.0).await;
    f.later(3 * 24 * 3600);
    let newest = f.evaluate(alpha.id, &small()).await.stage_day;
    f.run_all(4.0).await;
    let beta = f.ready_team("Beta").await;
    let missed = async |f: &TestStore, date: &str| {
        let date: Date = date.parse().unwrap();
        let of = StageDay { date, ..first };
        f.store
            .start_missed_day(Actor::Organiser, of, REASON, f.now)
            .await
    };
    f.later(60);
    let played = missed(&f, "2026-03-02").await.unwrap();
    assert_eq!(played.len(), 2, "Beta's submission is active now, too");
    let of = played[0].stage_day;
    let (day, _) = f.store.days().await.unwrap()[0];
    assert_eq!(
        (day.stage_day, day.cutoff_at),
        (of, f.now),
        "its cutoff is the actual time"
    );
    assert_eq!(
        f.store.missed_days().await.unwrap(),
        [(of, REASON.to_owned())]
    );
    let (_, run, _) = {
        let claimed = f.claim_shard().await;
        f.commit_shard(&claimed.0, &claimed.2, 0).await;
        claimed
    };
    assert_eq!(
        run.seed,
        SeedLabel::StageDay(of),
        "episodes of its own date"
    );
    f.run_all(2.0).await;
    assert!(f.store.days().await.unwrap()[0].0.released_at.is_some());
    let board = f.board().await;
    let rows: Vec<_> = board.iter().map(|row| (row.team.id, row.day)).collect();
    assert_eq!(
        rows,
        [(alpha.team, newest.date), (beta.team, of.date)],
        "the result of the newest date counts"
    );
    assert_eq!(
        kinds(&f, Subject::Day(of)).await,
        ["missed_day_started", "day_started", "day_released"]
    );
    // The schedule continues from the newest date, regardless of missed days.
    let stage = f.store.stage(of.stage).await.unwrap();
    assert_eq!(
        f.store
            .newest_day(stage.id)
            .await
            .unwrap()
            .unwrap()
            .stage_day,
        newest
    );

    for had in ["2026-03-02", "2026-03-01"] {
        let repeated = missed(&f, had).await;
        assert!(
            matches!(repeated, Err(StoreError::CutoffPassed { .. })),
            "{repeated:?}"
        );
    }
    for today_or_later in ["2026-03-04", "2026-03-05"] {
        refused(
            missed(&f, today_or_later).await,
            &["not passed", "2026-03-04"],
        );
    }
    refused(
        missed(&f, "2025-11-30").await,
        &["before the stage's first day", "2025-12-01"],
    );
    let closing = StageChange {
        closes_at: Some(Some(f.now + jiff::SignedDuration::from_secs(1))),
        ..StageChange::default()
    };
    let closing = f
        .store
        .change_stage(Actor::Organiser, of.stage, closing, f.now);
    closing.await.unwrap();
    f.later(1);
    let closed = missed(&f, "2026-03-03").await;
    assert!(
        matches!(closed, Err(StoreError::StageNotOpen { .. })),
        "{closed:?}"
    );
    assert_eq!(f.store.days().await.unwrap().len(), 3);
}

async fn extra(
    f: &TestStore,
    of: StageDay,
    team: TeamId,
    replaces: bool,
) -> Result<Evaluation, StoreError> {
    f.store
        .add_extra_evaluation(Actor::Organiser, of, team, REASON, replaces, f.now)
        .await
}

#[tokio::test]
async fn extra_evaluation_of_open_day_uses_its_episodes() {
    let f = TestStore::new().await;
    let alpha = f.ready_team("Alpha").await;
    let day = f.evaluate(alpha.id, &small()).await;
    let late = f.team("Late").await;
    refused(
        extra(&f, day.stage_day, late.id, false).await,
        &["no active submission"],
    );
    f.upload(&late).await;
    f.validate().await;
    let extra_run = extra(&f, day.stage_day, late.id, false).await.unwrap();
    assert_eq!(extra_run.extra_for.as_deref(), Some(REASON));
    refused(
        extra(&f, day.stage_day, late.id, false).await,
        &["queued or running"],
    );
    let mut labels = Vec::new();
    while let Some(ClaimedJob { claim, job }) = f.claim().await {
        match job {
            Job::Shard { run, shard, .. } => {
                labels.push(run.seed);
                f.commit_shard(&claim, &shard, 0).await;
            }
            _ => {
                let released = f.store.days().await.unwrap()[0].0.released_at;
                assert_eq!(released, None, "the day waits for the extra evaluation");
                f.finish(&claim, 1.0, "d").await;
            }
        }
    }
    assert_eq!(labels, [SeedLabel::StageDay(day.stage_day); 2]);
    assert!(f.store.days().await.unwrap()[0].0.released_at.is_some());
    let board = f.board().await;
    let reasons: Vec<_> = board.iter().map(|row| row.extra_for.as_deref()).collect();
    assert_eq!(reasons, [None, Some(REASON)]);
}

#[tokio::test]
async fn extra_evaluation_of_released_day_gets_own_episodes() {
    let mut f = TestStore::new().await;
    let alpha = f.ready_team("Alpha").await;
    let day = f.evaluate(alpha.id, &small()).await;
    f.run_all(1.0).await;
    refused(
        extra(&f, day.stage_day, alpha.team, false).await,
        &["counting", "replace"],
    );
    f.upload(&f.store.team(alpha.team).await.unwrap()).await;
    let newer = f.validate().await;
    let extra_run = extra(&f, day.stage_day, alpha.team, true).await.unwrap();
    assert_eq!(
        (extra_run.submission, extra_run.stage_day),
        (newer.id, day.stage_day),
        "the submission that is active now"
    );
    let replaced = f.store.evaluation(day.id).await.unwrap().voided.unwrap();
    assert_eq!(
        replaced.reason,
        format!("replaced by an extra evaluation: {REASON}")
    );
    let (claim, run, shard) = f.claim_shard().await;
    assert_eq!(run.seed, SeedLabel::Extra(extra_run.id));
    // After platform faults only an organiser can rerun it: on the same episodes, still as an extra evaluation.
    f.store.release(&claim, f.now).await.unwrap();
    let broken = f.fail_next().await;
    assert_eq!(broken, extra_run.id);
    let _ = shard;
    let rerun = f
        .store
        .rerun_evaluation(Actor::Organiser, extra_run.id, f.now);
    let rerun = rerun.await.unwrap();
    assert_eq!(rerun.extra_for.as_deref(), Some(REASON));
    let (claim, run, shard) = f.claim_shard().await;
    assert_eq!(run.seed, SeedLabel::Extra(extra_run.id));
    f.commit_shard(&claim, &shard, 0).await;
    f.run_all(3.0).await;
    let board = f.board().await;
    assert_eq!(
        (board[0].result.score, board[0].extra_for.as_deref()),
        (3.0, Some(REASON))
    );
    assert_eq!(
        kinds(&f, Subject::Evaluation(extra_run.id)).await[..2],
        ["evaluation_queued", "extra_turn_given"]
    );
}

#[tokio::test]
async fn extra_evaluation_uses_rules_of_its_day() {
    let mut f = TestStore::new().await;
    let alpha = f.ready_team("Alpha").await;
    let day = f.evaluate(alpha.id, &small()).await;
    f.run_all(1.0).await;
    // The rules change.
    let two = RunPlan {
        episodes_per_task: 2,
        ..small()
    };
    let stage = f.stage(&two).await;
    let beta = f.ready_team("Beta").await;
    let extra_run = extra(&f, day.stage_day, beta.team, false).await.unwrap();
    assert_eq!(
        (extra_run.revision, extra_run.plan.episodes_per_task),
        (1, 1)
    );
    f.run_all(2.0).await;

    let none = StageDay {
        date: day.stage_day.date.tomorrow().unwrap(),
        stage,
    };
    let no_cutoff = extra(&f, none, beta.team, true).await;
    assert!(
        matches!(no_cutoff, Err(StoreError::NotFound("day"))),
        "{no_cutoff:?}"
    );
    let unknown_team = extra(&f, day.stage_day, TeamId::new(), true).await;
    assert!(
        matches!(unknown_team, Err(StoreError::NotFound("team"))),
        "{unknown_team:?}"
    );
    let disqualified = f
        .store
        .disqualify_team(Actor::Organiser, beta.team, REASON, f.now);
    disqualified.await.unwrap();
    let refused = extra(&f, day.stage_day, beta.team, true).await;
    assert!(
        matches!(refused, Err(StoreError::Disqualified { .. })),
        "{refused:?}"
    );
    let closing = StageChange {
        closes_at: Some(Some(f.now + jiff::SignedDuration::from_secs(1))),
        ..StageChange::default()
    };
    let closing = f
        .store
        .change_stage(Actor::Organiser, stage, closing, f.now);
    closing.await.unwrap();
    f.later(1);
    let closed = extra(&f, day.stage_day, alpha.team, true).await;
    assert!(
        matches!(closed, Err(StoreError::StageNotOpen { .. })),
        "{closed:?}"
    );
    let voided = f.store.evaluation(day.id).await.unwrap().voided;
    assert_eq!(voided, None, "a refused request changes nothing");
}
