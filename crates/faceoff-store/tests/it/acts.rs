//! What the organiser does with boards and days: freezing, making up for a missed day, giving an extra turn.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::civil::Date;

const WHY: &str = "the network was down";

#[track_caller]
fn refused<T: std::fmt::Debug>(done: Result<T, StoreError>, words: &[&str]) {
    let Err(StoreError::Conflict(why)) = done else {
        panic!("expected a conflict with {words:?}: {done:?}");
    };
    for word in words {
        assert!(why.contains(word), "{word:?} is not in {why:?}");
    }
}

async fn kinds(f: &Fixture, subject: Subject) -> Vec<String> {
    let events = f.store.events_after(0, 1000).await.unwrap();
    let of = events.iter().filter(|record| record.subject == subject);
    let kind = |record: &EventRecord| {
        let event = serde_json::to_value(&record.event).unwrap();
        event["kind"].as_str().unwrap().to_owned()
    };
    of.map(kind).collect()
}

#[tokio::test]
async fn a_frozen_board_leaves_out_what_is_finished_later() {
    let mut f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await;
    let stage = f.evaluate(alpha.id, &small()).await.of.stage;
    f.play_to(1.0).await;
    f.later(24 * 3600);
    let freeze = async |f: &Fixture| {
        f.store
            .freeze_boards(Actor::Organiser, stage, WHY, f.now)
            .await
    };
    freeze(&f).await.unwrap();
    refused(freeze(&f).await, &["frozen already", "2026-03-02"]);
    let frozen = f.store.boards_frozen(stage).await.unwrap().unwrap();
    assert_eq!((frozen.at, frozen.reason.as_str()), (f.now, WHY));

    f.later(60);
    let beta = f.ready_team("Beta").await;
    f.evaluate(beta.id, &small()).await;
    f.play_to(2.0).await;
    let scope = BoardScope {
        until: Some(frozen.at),
        ..BoardScope::default()
    };
    let of_stage = f.store.stage(stage).await.unwrap();
    let revision = f.store.board_revision_within(&of_stage, &scope).await;
    let revision = revision.unwrap();
    let shown = f.store.board_within(stage, revision, &scope).await.unwrap();
    let scores =
        |rows: &[BoardRecord]| -> Vec<f64> { rows.iter().map(|row| row.result.score).collect() };
    assert_eq!(scores(&shown), [1.0]);
    assert_eq!(scores(&f.board().await), [2.0, 2.0], "the live one");
    // Without a row, as if it did not count, the one before counts.
    let without = BoardScope {
        without: vec![f.board().await[0].evaluation],
        ..BoardScope::default()
    };
    let shown = f.store.board_within(stage, revision, &without).await;
    assert_eq!(scores(&shown.unwrap()), [1.0, 2.0]);

    let unfreeze = async |f: &Fixture| {
        f.store
            .unfreeze_boards(Actor::Organiser, stage, f.now)
            .await
    };
    unfreeze(&f).await.unwrap();
    refused(unfreeze(&f).await, &["not frozen"]);
    assert_eq!(f.store.boards_frozen(stage).await.unwrap(), None);
    let of_stage = kinds(&f, Subject::Stage(stage)).await;
    assert_eq!(
        of_stage[of_stage.len() - 2..],
        ["boards_frozen", "boards_unfrozen"]
    );
    let other = StageId::new();
    let none = f.store.freeze_boards(Actor::Organiser, other, WHY, f.now);
    assert!(matches!(none.await, Err(StoreError::NotFound("stage"))));
}

#[tokio::test]
async fn a_missed_day_is_played_on_its_date_with_what_is_active_now() {
    let mut f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await;
    let first = f.evaluate(alpha.id, &small()).await.of;
    f.play_to(1.0).await;
    f.later(3 * 24 * 3600);
    let newest = f.evaluate(alpha.id, &small()).await.of;
    f.play_to(4.0).await;
    let beta = f.ready_team("Beta").await;
    let missed = async |f: &Fixture, date: &str| {
        let date: Date = date.parse().unwrap();
        let of = StageDay { date, ..first };
        f.store
            .start_missed_day(Actor::Organiser, of, WHY, f.now)
            .await
    };
    f.later(60);
    let played = missed(&f, "2026-03-02").await.unwrap();
    assert_eq!(played.len(), 2, "what is active now, Beta's too");
    let of = played[0].of;
    let (day, _) = f.store.days().await.unwrap()[0];
    assert_eq!((day.of, day.cut_at), (of, f.now), "its cut is when it was");
    assert_eq!(f.store.missed_days().await.unwrap(), [(of, WHY.to_owned())]);
    let (_, run, _) = {
        let claimed = f.claim_shard().await;
        f.play(&claimed.0, &claimed.2, 0).await;
        claimed
    };
    assert_eq!(
        run.seed,
        SeedLabel::StageDay(of),
        "episodes of its own date"
    );
    f.play_to(2.0).await;
    assert!(f.store.days().await.unwrap()[0].0.released_at.is_some());
    let board = f.board().await;
    let rows: Vec<_> = board.iter().map(|row| (row.team.id, row.day)).collect();
    assert_eq!(
        rows,
        [(alpha.team, newest.date), (beta.team, of.date)],
        "by their dates the newest counts"
    );
    assert_eq!(
        kinds(&f, Subject::Day(of)).await,
        ["missed_day_started", "day_started", "day_released"]
    );
    // The schedule goes on from the newest date, whatever was made up for.
    let stage = f.store.stage(of.stage).await.unwrap();
    assert_eq!(
        f.store.newest_day(stage.id).await.unwrap().unwrap().of,
        newest
    );

    for had in ["2026-03-02", "2026-03-01"] {
        let again = missed(&f, had).await;
        assert!(
            matches!(again, Err(StoreError::DayHasCut { .. })),
            "{again:?}"
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
        &["not of the stage", "2025-12-01"],
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
    f: &Fixture,
    of: StageDay,
    team: TeamId,
    replaces: bool,
) -> Result<Evaluation, StoreError> {
    f.store
        .extra_turn(Actor::Organiser, of, team, WHY, replaces, f.now)
        .await
}

#[tokio::test]
async fn an_extra_turn_of_a_day_under_way_plays_the_days_episodes() {
    let f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await;
    let day = f.evaluate(alpha.id, &small()).await;
    let late = f.team("Late").await;
    refused(
        extra(&f, day.of, late.id, false).await,
        &["no submission active"],
    );
    f.upload(&late).await;
    f.validate().await;
    let turn = extra(&f, day.of, late.id, false).await.unwrap();
    assert_eq!(turn.extra_for.as_deref(), Some(WHY));
    refused(extra(&f, day.of, late.id, false).await, &["under way"]);
    let mut labels = Vec::new();
    while let Some(Claimed { claim, work }) = f.claim().await {
        match work {
            Work::Shard { run, shard, .. } => {
                labels.push(run.seed);
                f.play(&claim, &shard, 0).await;
            }
            _ => {
                let released = f.store.days().await.unwrap()[0].0.released_at;
                assert_eq!(released, None, "the day waits for it");
                f.finish(&claim, 1.0, "d").await;
            }
        }
    }
    assert_eq!(labels, [SeedLabel::StageDay(day.of); 2]);
    assert!(f.store.days().await.unwrap()[0].0.released_at.is_some());
    let board = f.board().await;
    let reasons: Vec<_> = board.iter().map(|row| row.extra_for.as_deref()).collect();
    assert_eq!(reasons, [None, Some(WHY)]);
}

#[tokio::test]
async fn an_extra_turn_of_a_released_day_plays_episodes_that_nobody_knows() {
    let mut f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await;
    let day = f.evaluate(alpha.id, &small()).await;
    f.play_to(1.0).await;
    refused(
        extra(&f, day.of, alpha.team, false).await,
        &["counts", "replace"],
    );
    f.upload(&f.store.team(alpha.team).await.unwrap()).await;
    let newer = f.validate().await;
    let turn = extra(&f, day.of, alpha.team, true).await.unwrap();
    assert_eq!(
        (turn.submission, turn.of),
        (newer.id, day.of),
        "what is active now"
    );
    let replaced = f.store.evaluation(day.id).await.unwrap().voided.unwrap();
    assert_eq!(replaced.reason, format!("replaced by an extra turn: {WHY}"));
    let (claim, run, shard) = f.claim_shard().await;
    assert_eq!(run.seed, SeedLabel::Extra(turn.id));
    // What we break of it is the organiser's to have played again, on the same episodes, an extra turn still.
    f.store.release(&claim, f.now).await.unwrap();
    let broken = f.break_next().await;
    assert_eq!(broken, turn.id);
    let _ = shard;
    let again = f.store.rerun_evaluation(Actor::Organiser, turn.id, f.now);
    let again = again.await.unwrap();
    assert_eq!(again.extra_for.as_deref(), Some(WHY));
    let (claim, run, shard) = f.claim_shard().await;
    assert_eq!(run.seed, SeedLabel::Extra(turn.id));
    f.play(&claim, &shard, 0).await;
    f.play_to(3.0).await;
    let board = f.board().await;
    assert_eq!(
        (board[0].result.score, board[0].extra_for.as_deref()),
        (3.0, Some(WHY))
    );
    assert_eq!(
        kinds(&f, Subject::Evaluation(turn.id)).await[..2],
        ["evaluation_queued", "extra_turn_given"]
    );
}

#[tokio::test]
async fn an_extra_turn_is_by_the_rules_of_its_day_and_not_for_everybody() {
    let mut f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await;
    let day = f.evaluate(alpha.id, &small()).await;
    f.play_to(1.0).await;
    // Other rules since then.
    let two = RunPlan {
        episodes_per_task: 2,
        ..small()
    };
    let stage = f.stage(&two).await;
    let beta = f.ready_team("Beta").await;
    let turn = extra(&f, day.of, beta.team, false).await.unwrap();
    assert_eq!((turn.revision, turn.plan.episodes_per_task), (1, 1));
    f.play_to(2.0).await;

    let none = StageDay {
        date: day.of.date.tomorrow().unwrap(),
        stage,
    };
    let no_cut = extra(&f, none, beta.team, true).await;
    assert!(
        matches!(no_cut, Err(StoreError::NotFound("day"))),
        "{no_cut:?}"
    );
    let nobody = extra(&f, day.of, TeamId::new(), true).await;
    assert!(
        matches!(nobody, Err(StoreError::NotFound("team"))),
        "{nobody:?}"
    );
    let disqualified = f
        .store
        .disqualify_team(Actor::Organiser, beta.team, WHY, f.now);
    disqualified.await.unwrap();
    let refused = extra(&f, day.of, beta.team, true).await;
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
    let closed = extra(&f, day.of, alpha.team, true).await;
    assert!(
        matches!(closed, Err(StoreError::StageNotOpen { .. })),
        "{closed:?}"
    );
    let voided = f.store.evaluation(day.id).await.unwrap().voided;
    assert_eq!(voided, None, "what is refused changes nothing");
}
