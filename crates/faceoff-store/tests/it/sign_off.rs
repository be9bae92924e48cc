//! Blind stages, final days, publication, and the sign-off of results.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::Timestamp;

fn at(text: &str) -> Timestamp {
    text.parse().unwrap()
}

const CLOSES: &str = "2026-03-03T10:00:00Z";

async fn stage_with(f: &TestStore, settings: StageSettings) -> Stage {
    let (rules, of_plan) = rules_and_settings(&small());
    let new = NewStage {
        name: "Warm-up".parse().unwrap(),
        opens_at: f.now,
        closes_at: Some(at(CLOSES)),
        zone: Zone::UTC,
        rules,
        settings: StageSettings {
            episodes_per_shard: of_plan.episodes_per_shard,
            ..settings
        },
    };
    let made = f.store.create_stage(Actor::Organiser, new, f.now);
    made.await.unwrap()
}

fn blind() -> StageSettings {
    StageSettings {
        blind: true,
        ..StageSettings::default()
    }
}

fn by(standings: CountingResult) -> StageSettings {
    StageSettings {
        standings,
        ..StageSettings::default()
    }
}

async fn start(f: &TestStore, stage: &Stage) -> Vec<Evaluation> {
    let started = f.store.start_day(Actor::Organiser, stage.id, f.now);
    started.await.unwrap()
}

/// Changes the current settings of a stage.
async fn set(
    f: &TestStore,
    stage: &Stage,
    change: impl FnOnce(&mut StageSettings),
) -> Result<Stage, StoreError> {
    let mut settings = f.store.stage(stage.id).await.unwrap().settings;
    change(&mut settings);
    let wanted = StageChange {
        settings: Some(settings),
        ..StageChange::default()
    };
    let changed = f
        .store
        .change_stage(Actor::Organiser, stage.id, wanted, f.now);
    changed.await
}

async fn sign_off(f: &TestStore, stage: &Stage) -> Result<Stage, StoreError> {
    let done = f.store.sign_off_stage(Actor::Organiser, stage.id, f.now);
    done.await
}

#[track_caller]
fn refused<T: std::fmt::Debug>(done: Result<T, StoreError>, words: &[&str]) {
    let Err(StoreError::Conflict(why)) = done else {
        panic!("expected a conflict with {words:?}: {done:?}");
    };
    for word in words {
        assert!(why.contains(word), "{word:?} is not in {why:?}");
    }
}

async fn kinds(f: &TestStore) -> Vec<Event> {
    let events = f.store.events_after(0, 1000).await.unwrap();
    events.into_iter().map(|record| record.event).collect()
}

#[tokio::test]
async fn blind_stage_is_opened_once() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let stage = stage_with(&f, blind()).await;
    // Before the first score it can be changed freely.
    set(&f, &stage, |settings| settings.blind = false)
        .await
        .unwrap();
    start(&f, &stage).await;
    set(&f, &stage, |settings| settings.blind = true)
        .await
        .unwrap();
    f.run_all(10.0).await;
    refused(
        f.store.close_season(Actor::Organiser, f.now).await,
        &["Warm-up", "blind", "open it first"],
    );

    f.now = at(CLOSES);
    refused(sign_off(&f, &stage).await, &["blind", "open it first"]);
    let other = set(&f, &stage, |settings| {
        settings.blind = false;
        settings.ablation_episodes = 5;
    });
    refused(other.await, &["closed at", "except to open a blind one"]);
    let opened = set(&f, &stage, |settings| settings.blind = false)
        .await
        .unwrap();
    assert!(!opened.settings.blind);
    let repeated = set(&f, &stage, |settings| settings.blind = true).await;
    refused(repeated, &["closed at"]);
    f.store.close_season(Actor::Organiser, f.now).await.unwrap();
}

#[tokio::test]
async fn stage_with_scores_cannot_be_made_blind() {
    let f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let stage = stage_with(&f, StageSettings::default()).await;
    start(&f, &stage).await;
    f.run_all(10.0).await;
    let hidden = set(&f, &stage, |settings| settings.blind = true).await;
    refused(hidden, &["blind: 1 evaluations", "before its first score"]);
}

#[tokio::test]
async fn closed_stage_can_publish_earlier_but_not_later() {
    let mut f = TestStore::new().await;
    let stage = stage_with(&f, StageSettings::default()).await;
    f.now = at(CLOSES);
    let sooner = set(&f, &stage, |settings| {
        settings.publishes = Publication::AtRelease
    });
    assert_eq!(
        sooner.await.unwrap().settings.publishes,
        Publication::AtRelease
    );
    for later in [Publication::AtClose, Publication::Never] {
        let later = set(&f, &stage, |settings| settings.publishes = later);
        refused(later.await, &["cannot be changed"]);
    }
}

#[tokio::test]
async fn signed_off_stage_cannot_be_changed() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    f.ready_team("Beta").await;
    let stage = stage_with(&f, StageSettings::default()).await;
    let started = start(&f, &stage).await;
    refused(
        sign_off(&f, &stage).await,
        &["has not closed", "2026-03-03"],
    );
    f.now = at(CLOSES);
    refused(
        sign_off(&f, &stage).await,
        &["2 evaluations", "cancel them"],
    );
    let cancelled = f
        .store
        .cancel_evaluation(Actor::Organiser, started[1].id, "late", f.now);
    cancelled.await.unwrap();
    f.run_all(10.0).await;
    let beta = started[1].team;
    let out = f
        .store
        .disqualify_team(Actor::Organiser, beta, "why", f.now);
    out.await.unwrap();

    f.store.check_can_sign_off(stage.id, f.now).await.unwrap();
    assert_eq!(f.store.stage(stage.id).await.unwrap().sign_off, None);
    let done = sign_off(&f, &stage).await.unwrap();
    let expected = SignOff {
        signed_off_at: f.now,
        actor: Actor::Organiser,
        disqualified_teams: vec![beta],
    };
    assert_eq!(done.sign_off, Some(expected));
    let signed = kinds(&f).await;
    assert!(signed.contains(&Event::StageFinalised));

    f.later(60);
    let words = [
        "Warm-up",
        "signed off on 2026-03-03 at 10:00:00 UTC by organiser",
    ];
    refused(sign_off(&f, &stage).await, &words);
    let (of, id) = (started[0].stage_day, started[0].id);
    refused(
        f.store
            .void_evaluation(Actor::Organiser, id, "why", f.now)
            .await,
        &words,
    );
    refused(
        f.store.void_day(Actor::Organiser, of, "why", f.now).await,
        &words,
    );
    let rerun = f
        .store
        .rerun_evaluation(Actor::Organiser, started[1].id, f.now);
    refused(rerun.await, &words);
    let change = set(&f, &stage, |settings| {
        settings.publishes = Publication::AtRelease
    });
    refused(change.await, &words);
    let rename = StageChange {
        name: Some("Other".parse().unwrap()),
        ..StageChange::default()
    };
    let renamed = f
        .store
        .change_stage(Actor::Organiser, stage.id, rename, f.now);
    refused(renamed.await, &words);

    // A later disqualification or reinstatement changes other boards, but not this one.
    let alpha = started[0].team;
    let teams = async || {
        let board = f.store.board(stage.id, 1).await.unwrap();
        let by_day = f
            .store
            .board_of_days(stage.id, 1, BoardDays::All, &BoardScope::default())
            .await
            .unwrap();
        let teams = |board: Vec<BoardRecord>| -> Vec<TeamId> {
            board.into_iter().map(|row| row.team.id).collect()
        };
        assert_eq!(teams(by_day), teams(board.clone()));
        teams(board)
    };
    assert_eq!(teams().await, [alpha]);
    let out = f
        .store
        .disqualify_team(Actor::Organiser, alpha, "why", f.now);
    out.await.unwrap();
    let back = f.store.reinstate_team(Actor::Organiser, beta, "why", f.now);
    back.await.unwrap();
    assert_eq!(teams().await, [alpha]);

    // The database itself refuses changes that an operation fails to check.
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
        let done = sqlx::query(sql).bind(id).execute(&mut connection).await;
        assert!(
            done.unwrap_err().to_string().contains("signed off"),
            "{sql}"
        );
    }
}

#[tokio::test]
async fn final_day_runs_once_between_close_and_sign_off() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let stage = stage_with(&f, by(CountingResult::Final)).await;
    start(&f, &stage).await;
    f.run_all(10.0).await;
    let last = async |now| {
        f.store
            .start_final_day(Actor::Organiser, stage.id, now)
            .await
    };
    refused(
        last(f.now).await,
        &["has not closed", "final day comes after"],
    );
    assert_eq!(f.store.final_cutoff(stage.id).await.unwrap(), None);
    f.now = at(CLOSES);
    refused(sign_off(&f, &stage).await, &["final day", "start it first"]);
    refused(
        f.store.close_season(Actor::Organiser, f.now).await,
        &["Warm-up", "final day", "start it first"],
    );

    let started = last(f.now).await.unwrap();
    assert_eq!(started.len(), 1);
    let date = jiff::civil::date(2026, 3, 3);
    assert_eq!(started[0].stage_day.date, date);
    refused(last(f.now).await, &["had its cutoff", "only one"]);
    refused(sign_off(&f, &stage).await, &["1 evaluations"]);
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
    f.commit_shard(&claimed.claim, &shard, 0).await;
    f.run_all(40.0).await;

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
        kinds(&f)
            .await
            .contains(&Event::StageFinalStarted { day: date })
    );
    sign_off(&f, &stage).await.unwrap();
}

#[tokio::test]
async fn final_day_needs_its_own_date_and_a_submission() {
    let mut f = TestStore::new().await;
    let without = stage_with(&f, by(CountingResult::Best)).await;
    let other = f.store.start_final_day(Actor::Organiser, without.id, f.now);
    refused(other.await, &["“best”", "no final day"]);
    f.now = at("2026-03-03T09:00:00Z");
    let (rules, settings) = rules_and_settings(&small());
    let new = NewStage {
        name: "Last".parse().unwrap(),
        opens_at: f.now,
        closes_at: Some(at(CLOSES)),
        zone: Zone::UTC,
        rules,
        settings: StageSettings {
            standings: CountingResult::Final,
            ..settings
        },
    };
    let stage = f
        .store
        .create_stage(Actor::Organiser, new, f.now)
        .await
        .unwrap();
    let empty = f
        .store
        .start_final_day(Actor::Organiser, stage.id, at(CLOSES));
    refused(empty.await, &["no team has a valid submission"]);
    f.ready_team("Alpha").await;
    start(&f, &stage).await;
    f.run_all(1.0).await;
    f.now = at(CLOSES);
    let same_date = f.store.start_final_day(Actor::Organiser, stage.id, f.now);
    assert!(matches!(
        same_date.await,
        Err(StoreError::CutoffPassed { .. })
    ));
    f.later(24 * 3600);
    let next = f.store.start_final_day(Actor::Organiser, stage.id, f.now);
    assert_eq!(next.await.unwrap().len(), 1);
}

#[tokio::test]
async fn evaluation_is_publishable_once_released_and_not_blind() {
    let mut f = TestStore::new().await;
    let alpha = f.ready_team("Alpha").await.team;
    f.ready_team("Beta").await;
    let stage = stage_with(&f, blind()).await;
    let started = start(&f, &stage).await;
    let publish = async |f: &TestStore, id| {
        let done = f.store.publish_evaluation(Actor::Team(alpha), id, f.now);
        done.await
    };
    let id = started[0].id;
    refused(publish(&f, id).await, &["finished evaluation"]);
    assert_eq!(f.finish_next().await, id);
    refused(publish(&f, id).await, &["blind"]);
    // The stage is opened, but the day is not released.
    let opened = set(&f, &stage, |settings| settings.blind = false).await;
    opened.unwrap();
    refused(publish(&f, id).await, &["same episodes"]);
    f.run_all(1.0).await;
    let published = publish(&f, id).await.unwrap();
    assert_eq!(published.published_at, Some(f.now));
    let first = f.now;
    f.later(5);
    assert_eq!(publish(&f, id).await.unwrap().published_at, Some(first));
    let recorded = kinds(&f).await;
    let times = recorded
        .iter()
        .filter(|event| **event == Event::EvaluationPublished);
    assert_eq!(times.count(), 1);
}
