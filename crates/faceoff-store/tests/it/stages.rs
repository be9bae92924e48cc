//! Stages (parts of the season with their own rules, evaluation days and boards): the date of a day and when it may start, revisions
//! (numbered versions of a stage's rules, each with its own board), and the first stage, which the server's configuration creates.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::{SignedDuration, civil::date};

/// A second stage, which is open from the initial time of the test store until 3 March.
fn warm_up_stage() -> NewStage {
    let (rules, settings) = rules_and_settings(&one_shard_plan());
    NewStage {
        name: "Warm-up".parse().unwrap(),
        opens_at: time("2026-03-01T10:00:00Z"),
        closes_at: Some(time("2026-03-03T10:00:00Z")),
        zone: IanaTimeZone::UTC,
        rules,
        settings,
    }
}

async fn create_stage(f: &TestStore, stage: NewStage) -> Stage {
    let created = f.store.create_stage(Actor::Operator, stage, f.now);
    created.await.unwrap()
}

async fn start_day(f: &TestStore, stage: StageId) -> Result<Vec<Evaluation>, StoreError> {
    f.store.start_day(Actor::Operator, stage, f.now).await
}

async fn change_stage(
    f: &TestStore,
    stage: StageId,
    change: StageChange,
) -> Result<Stage, StoreError> {
    let changed = f.store.change_stage(Actor::Operator, stage, change, f.now);
    changed.await
}

#[tokio::test]
async fn stages_have_their_own_days_seeds_and_boards() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let first = f.configure_stage(&one_shard_plan()).await;
    let second = create_stage(&f, warm_up_stage()).await.id;
    let secret = f.store.season().await.unwrap().secret;
    let date = date(2026, 3, 1);
    let mut seeds = Vec::new();
    for (stage, score) in [(first, 10.0), (second, 20.0)] {
        let started = start_day(&f, stage).await.unwrap();
        assert_eq!(started.len(), 1);
        assert_eq!(started[0].stage_day, StageDay { stage, date });
        assert_eq!(started[0].submission, submission.id);
        let second_start = start_day(&f, stage).await;
        assert!(
            matches!(second_start, Err(StoreError::CutoffPassed { .. })),
            "a stage has one evaluation day per date: {second_start:?}"
        );
        let claimed = f.claim().await.unwrap();
        let Job::Shard {
            seeds: job_seeds,
            shard,
            ..
        } = claimed.job
        else {
            panic!("expected a shard");
        };
        assert_eq!(job_seeds.episodes, secret.stage(stage).day(date));
        assert_eq!(job_seeds.mismatch, secret.model_mismatch());
        seeds.push(job_seeds.episodes);
        f.commit_shard(&claimed.claim, &shard).await;
        f.run_all_with_score(score).await;
        let board = f.store.board(stage, 1).await.unwrap();
        assert_eq!(board.len(), 1);
        assert_eq!(board[0].result.score, score);
        assert!(
            board[0].released_at.is_some(),
            "a day is released without waiting for the other stage's day"
        );
    }
    assert_ne!(seeds[0], seeds[1]);
    assert_eq!(f.store.evaluations_on(date).await.unwrap().len(), 2);
    let stage_day = StageDay {
        stage: second,
        date,
    };
    assert_eq!(
        f.store.evaluations_of_day(stage_day).await.unwrap().len(),
        1
    );
    assert_eq!(f.store.days().await.unwrap().len(), 2);
}

#[tokio::test]
async fn day_is_the_date_in_the_stages_zone() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let auckland = NewStage {
        zone: "Pacific/Auckland".parse().unwrap(),
        ..warm_up_stage()
    };
    let stage = create_stage(&f, auckland).await.id;
    let date_of = |started: Vec<Evaluation>| started[0].stage_day.date;
    assert_eq!(
        date_of(start_day(&f, stage).await.unwrap()),
        date(2026, 3, 1)
    );
    f.run_all_with_score(1.0).await;
    // A date has at most one evaluation day. Midnight in Auckland, where the next date begins, is 11:00 UTC.
    f.now = time("2026-03-01T10:59:59Z");
    assert!(matches!(
        start_day(&f, stage).await,
        Err(StoreError::CutoffPassed { .. })
    ));
    f.now = time("2026-03-01T11:00:00Z");
    assert_eq!(
        date_of(start_day(&f, stage).await.unwrap()),
        date(2026, 3, 2)
    );
}

#[tokio::test]
async fn days_start_only_between_opening_and_closing() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let upcoming = NewStage {
        opens_at: time("2026-03-02T10:00:00Z"),
        ..warm_up_stage()
    };
    let stage = create_stage(&f, upcoming).await;
    assert_eq!(stage.phase(f.now), StagePhase::Upcoming);
    f.now = stage.opens_at - SignedDuration::from_millis(1);
    let early = start_day(&f, stage.id).await;
    let Err(
        error @ StoreError::StageNotOpen {
            closed_at: None, ..
        },
    ) = early
    else {
        panic!("expected that the stage is not open, got {early:?}");
    };
    assert!(
        error.to_string().contains("opens at 2026-03-02T10:00:00Z"),
        "{error}"
    );
    assert_eq!(
        f.store.start_scheduled_day(stage.id, f.now).await.unwrap(),
        None
    );
    f.now = stage.opens_at;
    assert_eq!(start_day(&f, stage.id).await.unwrap().len(), 1);

    let closes_at = stage.closes_at.unwrap();
    f.now = closes_at - SignedDuration::from_millis(1);
    assert_eq!(
        start_day(&f, stage.id).await.unwrap().len(),
        1,
        "the last millisecond"
    );
    f.now = closes_at;
    assert_eq!(stage.phase(f.now), StagePhase::Closed);
    let late = start_day(&f, stage.id).await;
    assert!(
        matches!(late, Err(StoreError::StageNotOpen { closed_at: Some(at), .. }) if at == closes_at),
        "{late:?}"
    );
    assert_eq!(
        f.store.start_scheduled_day(stage.id, f.now).await.unwrap(),
        None
    );
    // Days that started before the closing continue, with automatic reruns.
    assert!(f.claim().await.is_some());
}

#[tokio::test]
async fn new_rules_of_open_stage_create_revision_and_board() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let stage = create_stage(&f, warm_up_stage()).await;
    start_day(&f, stage.id).await.unwrap();
    f.run_all_with_score(10.0).await;

    let rules = StageRules {
        episodes_per_task: 2,
        ..stage.revision.rules.clone()
    };
    let new_rules = StageChange {
        rules: Some(rules.clone()),
        ..StageChange::default()
    };
    f.advance_clock_s(60);
    let changed = change_stage(&f, stage.id, new_rules.clone()).await.unwrap();
    assert_eq!(
        (changed.revision.number, changed.revision.since),
        (2, f.now)
    );
    let unchanged = change_stage(&f, stage.id, new_rules).await.unwrap();
    assert_eq!(unchanged, changed, "identical rules are no change");
    assert_eq!(
        f.store.board_revision(&unchanged).await.unwrap(),
        1,
        "there is no result of revision 2 yet"
    );

    f.now = time("2026-03-02T10:00:00Z");
    let started = start_day(&f, stage.id).await.unwrap().remove(0);
    assert_eq!((started.revision, started.plan.episodes_per_task), (2, 2));
    f.run_all_with_score(20.0).await;
    assert_eq!(f.store.board_revision(&unchanged).await.unwrap(), 2);
    for (revision, score) in [(1, 10.0), (2, 20.0)] {
        let board = f.store.board(stage.id, revision).await.unwrap();
        assert_eq!(board.len(), 1);
        assert_eq!(board[0].result.score, score);
    }
    let revisions = f.store.stage_revisions(stage.id).await.unwrap();
    let revisions: Vec<_> = revisions
        .iter()
        .map(|revision| (revision.number, &revision.rules))
        .collect();
    assert_eq!(revisions, [(1, &stage.revision.rules), (2, &rules)]);
    let events = f.store.events_after(0, 1000).await.unwrap();
    let revised = events.iter().filter(|record| {
        record.event
            == Event::StageRulesChanged {
                revision: 2,
                rules: rules.clone(),
            }
    });
    assert_eq!(revised.count(), 1);
}

#[tokio::test]
async fn settings_change_creates_no_revision() {
    let f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let stage = create_stage(&f, warm_up_stage()).await;
    let settings = StageSettings {
        schedule: Some(Schedule::daily("06:00".parse().unwrap())),
        ablation_episodes: 3,
        day_deadline: DayDeadline::Hours(30),
        episodes_per_shard: 7,
        ..StageSettings::default()
    };
    let new_settings = StageChange {
        settings: Some(settings.clone()),
        closes_at: Some(None),
        name: Some("Qualifying 2".parse().unwrap()),
        ..StageChange::default()
    };
    let changed = change_stage(&f, stage.id, new_settings).await.unwrap();
    assert_eq!((changed.settings, changed.closes_at), (settings, None));
    assert_eq!(changed.name.as_str(), "Qualifying 2");
    assert_eq!(changed.revision, stage.revision);
}

#[tokio::test]
async fn first_stage_follows_configuration_until_changed() {
    let mut f = TestStore::new().await;
    // What a start of the server does with the first stage's part of its configuration.
    let configure = async |f: &TestStore, plan: &RunPlan| {
        let (rules, settings) = rules_and_settings(plan);
        let change = f
            .store
            .configure_stage(rules, settings, IanaTimeZone::UTC, f.now);
        change.await.unwrap();
        f.store.stages().await.unwrap()
    };
    let first = configure(&f, &six_shard_plan()).await;
    assert_eq!(first.len(), 1);
    assert!(first[0].configured && first[0].seeds_derive_from_id);
    assert_eq!(first[0].plan(), six_shard_plan());
    f.advance_clock_s(60);
    assert_eq!(
        configure(&f, &six_shard_plan()).await,
        first,
        "an identical configuration is no change"
    );
    let changed_configuration = configure(&f, &one_shard_plan()).await;
    assert_eq!(
        (
            changed_configuration[0].id,
            changed_configuration[0].revision.number
        ),
        (first[0].id, 2)
    );
    assert_eq!(changed_configuration[0].plan(), one_shard_plan());

    let request = StageChange {
        rules: Some(first[0].revision.rules.clone()),
        ..StageChange::default()
    };
    // After an organiser's change the configuration no longer applies.
    let changed = change_stage(&f, first[0].id, request).await.unwrap();
    assert_eq!((changed.revision.number, changed.configured), (3, false));
    assert_eq!(configure(&f, &one_shard_plan()).await, [changed]);
}

#[tokio::test]
async fn stage_of_closed_season_is_unchangeable() {
    let mut f = TestStore::new().await;
    f.store.close_season(Actor::Operator, f.now).await.unwrap();
    f.advance_clock_s(1);
    let first = f.configure_stage(&six_shard_plan()).await;
    let stage = f.store.stage(first).await.unwrap();
    assert_eq!(f.configure_stage(&one_shard_plan()).await, first);
    assert_eq!(f.store.stage(first).await.unwrap(), stage);
    let changed = change_stage(&f, first, StageChange::default()).await;
    assert!(
        matches!(changed, Err(StoreError::SeasonClosed { .. })),
        "{changed:?}"
    );
}

#[tokio::test]
async fn current_stage_is_the_open_or_nearest_one() {
    let f = TestStore::new().await;
    let current_stage = async |text: &str| {
        let stage = f.store.current_stage(time(text)).await.unwrap();
        stage.map(|stage| stage.name.to_string())
    };
    assert_eq!(current_stage("2026-03-01T10:00:00Z").await, None);
    for (name, opens_at, closes_at) in [
        ("A", "2026-03-02T00:00:00Z", "2026-03-04T00:00:00Z"),
        ("B", "2026-03-03T00:00:00Z", "2026-03-05T00:00:00Z"),
        ("C", "2026-03-07T00:00:00Z", "2026-03-08T00:00:00Z"),
    ] {
        let stage = NewStage {
            name: name.parse().unwrap(),
            opens_at: time(opens_at),
            closes_at: Some(time(closes_at)),
            ..warm_up_stage()
        };
        create_stage(&f, stage).await;
    }
    for (now, expected) in [
        ("2026-03-01T10:00:00Z", "A"),
        ("2026-03-02T10:00:00Z", "A"),
        ("2026-03-03T10:00:00Z", "B"),
        ("2026-03-04T10:00:00Z", "B"),
        ("2026-03-06T10:00:00Z", "B"),
        ("2026-03-07T10:00:00Z", "C"),
        ("2026-03-09T10:00:00Z", "C"),
    ] {
        assert_eq!(current_stage(now).await.as_deref(), Some(expected), "{now}");
    }
}
