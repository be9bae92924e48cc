//! The end of a stage: blind stages (teams see no results until organisers reveal the stage), the final day after the closing,
//! publication of evaluations, and the sign-off, which makes the results final.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

/// When the stages of these tests close.
const CLOSES_AT: &str = "2026-03-03T10:00:00Z";

/// Creates an open stage whose evaluations have one shard.
async fn create_stage(f: &TestStore, settings: StageSettings) -> Stage {
    let (rules, plan_settings) = rules_and_settings(&one_shard_plan());
    let stage = NewStage {
        name: "Warm-up".parse().unwrap(),
        opens_at: f.now,
        closes_at: Some(time(CLOSES_AT)),
        zone: IanaTimeZone::UTC,
        rules,
        settings: StageSettings {
            episodes_per_shard: plan_settings.episodes_per_shard,
            ..settings
        },
    };
    let created = f.store.create_stage(Actor::Operator, stage, f.now);
    created.await.unwrap()
}

fn blind_settings() -> StageSettings {
    StageSettings {
        blind: true,
        ..StageSettings::default()
    }
}

/// `counting_result` chooses the result of a team that counts for its rank.
fn settings_with_counting_result(counting_result: CountingResult) -> StageSettings {
    StageSettings {
        counting_result,
        ..StageSettings::default()
    }
}

async fn start_day(f: &TestStore, stage: &Stage) -> Vec<Evaluation> {
    let started = f.store.start_day(Actor::Operator, stage.id, f.now);
    started.await.unwrap()
}

/// Changes the current settings of a stage.
async fn change_settings(
    f: &TestStore,
    stage: &Stage,
    change: impl FnOnce(&mut StageSettings),
) -> Result<Stage, StoreError> {
    faceoff_testkit::change_settings(&f.store, stage.id, f.now, change).await
}

async fn sign_off(f: &TestStore, stage: &Stage) -> Result<Stage, StoreError> {
    f.store
        .sign_off_stage(Actor::Operator, stage.id, f.now)
        .await
}

async fn all_events(f: &TestStore) -> Vec<Event> {
    let events = f.store.events_after(0, 1000).await.unwrap();
    events.into_iter().map(|record| record.event).collect()
}

#[tokio::test]
async fn blind_stage_is_revealed_once() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let stage = create_stage(&f, blind_settings()).await;
    // Before the first score a stage can be made blind, and revealed, any number of times.
    change_settings(&f, &stage, |settings| settings.blind = false)
        .await
        .unwrap();
    start_day(&f, &stage).await;
    change_settings(&f, &stage, |settings| settings.blind = true)
        .await
        .unwrap();
    f.run_all_with_score(10.0).await;
    assert_conflict(
        f.store.close_season(Actor::Operator, f.now).await,
        &["Warm-up", "blind", "set `blind` to false first"],
    );

    f.now = time(CLOSES_AT);
    assert_conflict(
        sign_off(&f, &stage).await,
        &["blind", "set `blind` to false first"],
    );
    let with_other_change = change_settings(&f, &stage, |settings| {
        settings.blind = false;
        settings.ablation_episodes = 5;
    });
    assert_conflict(
        with_other_change.await,
        &["closed at", "except to reveal a blind one"],
    );
    let revealed = change_settings(&f, &stage, |settings| settings.blind = false)
        .await
        .unwrap();
    assert!(!revealed.settings.blind);
    let repeated = change_settings(&f, &stage, |settings| settings.blind = true).await;
    assert_conflict(repeated, &["closed at"]);
    f.store.close_season(Actor::Operator, f.now).await.unwrap();
}

#[tokio::test]
async fn signed_off_stage_cannot_be_changed() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    f.valid_submission_of("Beta").await;
    let stage = create_stage(&f, StageSettings::default()).await;
    let started = start_day(&f, &stage).await;
    assert_conflict(
        sign_off(&f, &stage).await,
        &["has not closed", "2026-03-03"],
    );
    f.now = time(CLOSES_AT);
    assert_conflict(
        sign_off(&f, &stage).await,
        &["2 evaluations", "cancel them"],
    );
    let cancelled = f
        .store
        .cancel_evaluation(Actor::Operator, started[1].id, "late", f.now);
    cancelled.await.unwrap();
    f.run_all_with_score(10.0).await;
    let beta = started[1].team;
    let disqualified = f
        .store
        .disqualify_team(Actor::Operator, beta, "a test", f.now);
    disqualified.await.unwrap();

    f.store.check_can_sign_off(stage.id, f.now).await.unwrap();
    assert_eq!(f.store.stage(stage.id).await.unwrap().sign_off, None);
    let signed_off = sign_off(&f, &stage).await.unwrap();
    let expected = SignOff {
        signed_off_at: f.now,
        actor: Actor::Operator,
        disqualified_teams: vec![beta],
    };
    assert_eq!(signed_off.sign_off, Some(expected));
    let events = all_events(&f).await;
    assert!(events.contains(&Event::StageFinalised));

    f.advance_clock_s(60);
    let phrases = [
        "Warm-up",
        "signed off on 2026-03-03 at 10:00:00 UTC by organiser",
    ];
    assert_conflict(sign_off(&f, &stage).await, &phrases);
    let (stage_day, id) = (started[0].stage_day, started[0].id);
    assert_conflict(
        f.store
            .void_evaluation(Actor::Operator, id, "a test", f.now)
            .await,
        &phrases,
    );
    assert_conflict(
        f.store
            .void_day(Actor::Operator, stage_day, "a test", f.now)
            .await,
        &phrases,
    );
    let rerun = f
        .store
        .rerun_evaluation(Actor::Operator, started[1].id, f.now);
    assert_conflict(rerun.await, &phrases);
    let changed = change_settings(&f, &stage, |settings| {
        settings.publishes = Publication::AtRelease
    });
    assert_conflict(changed.await, &phrases);
    let rename = StageChange {
        name: Some("Other".parse().unwrap()),
        ..StageChange::default()
    };
    let renamed = f
        .store
        .change_stage(Actor::Operator, stage.id, rename, f.now);
    assert_conflict(renamed.await, &phrases);

    // A later disqualification or reinstatement changes other boards, but not this one.
    let alpha = started[0].team;
    let board_teams = async || {
        let board = f.store.board(stage.id, 1).await.unwrap();
        let board_by_day = f
            .store
            .board_of_days(stage.id, 1, BoardDays::All, &BoardScope::default())
            .await
            .unwrap();
        let teams_of = |board: Vec<BoardRecord>| -> Vec<TeamId> {
            board.into_iter().map(|row| row.team.id).collect()
        };
        assert_eq!(teams_of(board_by_day), teams_of(board.clone()));
        teams_of(board)
    };
    assert_eq!(board_teams().await, [alpha]);
    let disqualified = f
        .store
        .disqualify_team(Actor::Operator, alpha, "a test", f.now);
    disqualified.await.unwrap();
    let reinstated = f
        .store
        .reinstate_team(Actor::Operator, beta, "a test", f.now);
    reinstated.await.unwrap();
    assert_eq!(board_teams().await, [alpha]);

    // The database refuses the changes, too, in case that an operation fails to check.
    let mut connection = f.connection().await;
    for (sql, id) in [
        (
            "UPDATE evaluations SET voided_at = 1, voided_for = 'x' WHERE id = ?",
            id.to_string(),
        ),
        (
            "UPDATE stages SET name = 'x' WHERE id = ?",
            stage.id.to_string(),
        ),
    ] {
        let executed = sqlx::query(sql).bind(id).execute(&mut connection).await;
        assert!(
            executed.unwrap_err().to_string().contains("signed off"),
            "{sql}"
        );
    }
}

#[tokio::test]
async fn final_day_runs_once_between_close_and_sign_off() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let stage = create_stage(&f, settings_with_counting_result(CountingResult::Final)).await;
    start_day(&f, &stage).await;
    f.run_all_with_score(10.0).await;
    let start_final_day = async |now| {
        f.store
            .start_final_day(Actor::Operator, stage.id, now)
            .await
    };
    assert_conflict(
        start_final_day(f.now).await,
        &["has not closed", "final day comes after"],
    );
    assert_eq!(f.store.final_cutoff(stage.id).await.unwrap(), None);
    f.now = time(CLOSES_AT);
    assert_conflict(sign_off(&f, &stage).await, &["final day", "start it first"]);
    assert_conflict(
        f.store.close_season(Actor::Operator, f.now).await,
        &["Warm-up", "final day", "start it first"],
    );

    let started = start_final_day(f.now).await.unwrap();
    assert_eq!(started.len(), 1);
    let date = jiff::civil::date(2026, 3, 3);
    assert_eq!(started[0].stage_day.date, date);
    assert_conflict(
        start_final_day(f.now).await,
        &["had its cutoff", "only one"],
    );
    assert_conflict(sign_off(&f, &stage).await, &["1 evaluations"]);
    let secret = f.store.season().await.unwrap().secret;
    let claimed = f.claim().await.unwrap();
    let Job::Shard { seeds, shard, .. } = claimed.job else {
        panic!("expected a shard");
    };
    assert_eq!(
        seeds.episodes,
        secret.stage(stage.id).day(date),
        "the final day has its own seeds"
    );
    f.commit_shard(&claimed.claim, &shard).await;
    f.run_all_with_score(40.0).await;

    let scores = async |days| -> Vec<f64> {
        let rows = f
            .store
            .board_of_days(stage.id, 1, days, &BoardScope::default())
            .await
            .unwrap();
        rows.into_iter().map(|row| row.result.score).collect()
    };
    assert_eq!(scores(BoardDays::Final).await, [40.0]);
    assert_eq!(scores(BoardDays::All).await, [10.0, 40.0]);
    assert_eq!(scores(BoardDays::Last(1)).await, [40.0]);
    assert_eq!(f.store.final_cutoff(stage.id).await.unwrap(), Some(f.now));
    assert!(
        all_events(&f)
            .await
            .contains(&Event::StageFinalStarted { day: date })
    );
    sign_off(&f, &stage).await.unwrap();
}

#[tokio::test]
async fn final_day_needs_its_own_date_and_a_submission() {
    let mut f = TestStore::new().await;
    let without_final_day =
        create_stage(&f, settings_with_counting_result(CountingResult::Best)).await;
    let started = f
        .store
        .start_final_day(Actor::Operator, without_final_day.id, f.now);
    assert_conflict(started.await, &["“best”", "no final day"]);
    f.now = time("2026-03-03T09:00:00Z");
    let (rules, settings) = rules_and_settings(&one_shard_plan());
    let with_final_day = NewStage {
        name: "Last".parse().unwrap(),
        opens_at: f.now,
        closes_at: Some(time(CLOSES_AT)),
        zone: IanaTimeZone::UTC,
        rules,
        settings: StageSettings {
            counting_result: CountingResult::Final,
            ..settings
        },
    };
    let stage = f
        .store
        .create_stage(Actor::Operator, with_final_day, f.now)
        .await
        .unwrap();
    let started = f
        .store
        .start_final_day(Actor::Operator, stage.id, time(CLOSES_AT));
    assert_conflict(started.await, &["no team has a valid submission"]);
    f.valid_submission_of("Alpha").await;
    start_day(&f, &stage).await;
    f.run_all_with_score(1.0).await;
    f.now = time(CLOSES_AT);
    let same_date = f.store.start_final_day(Actor::Operator, stage.id, f.now);
    assert!(matches!(
        same_date.await,
        Err(StoreError::CutoffPassed { .. })
    ));
    f.advance_clock_s(24 * 3600);
    let next = f.store.start_final_day(Actor::Operator, stage.id, f.now);
    assert_eq!(next.await.unwrap().len(), 1);
}

#[tokio::test]
async fn evaluation_is_publishable_once_released_and_not_blind() {
    let mut f = TestStore::new().await;
    let alpha = f.valid_submission_of("Alpha").await.team;
    f.valid_submission_of("Beta").await;
    let stage = create_stage(&f, blind_settings()).await;
    let started = start_day(&f, &stage).await;
    let publish = async |f: &TestStore, id| {
        f.store
            .publish_evaluation(Actor::Team(alpha), id, f.now)
            .await
    };
    let id = started[0].id;
    assert_conflict(publish(&f, id).await, &["finished evaluation"]);
    assert_eq!(f.finish_next_evaluation().await, id);
    assert_conflict(publish(&f, id).await, &["blind"]);
    // The stage is not blind any more, but the day is not released.
    let revealed = change_settings(&f, &stage, |settings| settings.blind = false).await;
    revealed.unwrap();
    assert_conflict(publish(&f, id).await, &["same episodes"]);
    f.run_all_with_score(1.0).await;
    let published = publish(&f, id).await.unwrap();
    assert_eq!(published.published_at, Some(f.now));
    let published_at = f.now;
    f.advance_clock_s(5);
    assert_eq!(
        publish(&f, id).await.unwrap().published_at,
        Some(published_at)
    );
    let events = all_events(&f).await;
    let publications = events
        .iter()
        .filter(|event| **event == Event::EvaluationPublished);
    assert_eq!(publications.count(), 1);
}
