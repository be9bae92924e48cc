//! Stages: days, revisions of the rules, and permitted changes.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::{SignedDuration, Timestamp, civil::date};

fn at(text: &str) -> Timestamp {
    text.parse().unwrap()
}

/// A stage that is open from the initial time of the test store until 3 March.
fn second() -> NewStage {
    let (rules, settings) = rules_and_settings(&small());
    NewStage {
        name: "Warm-up".parse().unwrap(),
        opens_at: at("2026-03-01T10:00:00Z"),
        closes_at: Some(at("2026-03-03T10:00:00Z")),
        zone: Zone::UTC,
        rules,
        settings,
    }
}

async fn create(f: &TestStore, new: NewStage) -> Stage {
    let made = f.store.create_stage(Actor::Organiser, new, f.now);
    made.await.unwrap()
}

async fn start(f: &TestStore, stage: StageId) -> Result<Vec<Evaluation>, StoreError> {
    f.store.start_day(Actor::Organiser, stage, f.now).await
}

async fn change(f: &TestStore, stage: StageId, change: StageChange) -> Result<Stage, StoreError> {
    let changed = f.store.change_stage(Actor::Organiser, stage, change, f.now);
    changed.await
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

#[tokio::test]
async fn stages_have_their_own_days_seeds_and_boards() {
    let f = TestStore::new().await;
    let agent = f.ready_team("Alpha").await;
    let first = f.stage(&small()).await;
    let second = create(&f, second()).await.id;
    let secret = f.store.season().await.unwrap().secret;
    let date = date(2026, 3, 1);
    let mut seeds = Vec::new();
    for (stage, score) in [(first, 10.0), (second, 20.0)] {
        let started = start(&f, stage).await.unwrap();
        assert_eq!(started.len(), 1);
        assert_eq!(started[0].stage_day, StageDay { stage, date });
        assert_eq!(started[0].submission, agent.id);
        let repeated = start(&f, stage).await;
        assert!(
            matches!(repeated, Err(StoreError::CutoffPassed { .. })),
            "{repeated:?}"
        );
        let claimed = f.claim().await.unwrap();
        let Job::Shard {
            seeds: found,
            shard,
            ..
        } = claimed.job
        else {
            panic!("expected a shard");
        };
        assert_eq!(found.episodes, secret.stage(stage).day(date));
        assert_eq!(found.mismatch, secret.model_mismatch());
        seeds.push(found.episodes);
        f.commit_shard(&claimed.claim, &shard, 0).await;
        f.run_all(score).await;
        let board = f.store.board(stage, 1).await.unwrap();
        assert_eq!(board.len(), 1);
        assert_eq!(board[0].result.score, score);
        assert!(
            board[0].released_at.is_some(),
            "the day of the other stage does not matter"
        );
    }
    assert_ne!(seeds[0], seeds[1]);
    assert_eq!(f.store.evaluations_on(date).await.unwrap().len(), 2);
    let of = StageDay {
        stage: second,
        date,
    };
    assert_eq!(f.store.evaluations_of_day(of).await.unwrap().len(), 1);
    assert_eq!(f.store.days().await.unwrap().len(), 2);
}

#[tokio::test]
async fn day_is_the_date_in_the_stages_zone() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let auckland = NewStage {
        zone: "Pacific/Auckland".parse().unwrap(),
        ..second()
    };
    let stage = create(&f, auckland).await.id;
    let day = |started: Vec<Evaluation>| started[0].stage_day.date;
    assert_eq!(day(start(&f, stage).await.unwrap()), date(2026, 3, 1));
    f.run_all(1.0).await;
    // Midnight in that zone is 11:00 UTC.
    f.now = at("2026-03-01T10:59:59Z");
    assert!(matches!(
        start(&f, stage).await,
        Err(StoreError::CutoffPassed { .. })
    ));
    f.now = at("2026-03-01T11:00:00Z");
    assert_eq!(day(start(&f, stage).await.unwrap()), date(2026, 3, 2));
}

#[tokio::test]
async fn days_start_only_between_opening_and_closing() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let later = NewStage {
        opens_at: at("2026-03-02T10:00:00Z"),
        ..second()
    };
    let stage = create(&f, later).await;
    assert_eq!(stage.phase(f.now), StagePhase::Upcoming);
    f.now = stage.opens_at - SignedDuration::from_millis(1);
    let early = start(&f, stage.id).await;
    let Err(
        error @ StoreError::StageNotOpen {
            closed_at: None, ..
        },
    ) = early
    else {
        panic!("{early:?}");
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
    assert_eq!(start(&f, stage.id).await.unwrap().len(), 1);

    let closes_at = stage.closes_at.unwrap();
    f.now = closes_at - SignedDuration::from_millis(1);
    assert_eq!(
        start(&f, stage.id).await.unwrap().len(),
        1,
        "the last millisecond"
    );
    f.now = closes_at;
    assert_eq!(stage.phase(f.now), StagePhase::Closed);
    let late = start(&f, stage.id).await;
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
    f.ready_team("Alpha").await;
    let stage = create(&f, second()).await;
    start(&f, stage.id).await.unwrap();
    f.run_all(10.0).await;

    let rules = StageRules {
        episodes_per_task: 2,
        ..stage.rules.rules.clone()
    };
    let others = StageChange {
        rules: Some(rules.clone()),
        ..StageChange::default()
    };
    f.later(60);
    let changed = change(&f, stage.id, others.clone()).await.unwrap();
    assert_eq!((changed.rules.number, changed.rules.since), (2, f.now));
    let same = change(&f, stage.id, others).await.unwrap();
    assert_eq!(same, changed, "identical rules are no change");
    assert_eq!(
        f.store.board_revision(&same).await.unwrap(),
        1,
        "there is no result of revision 2 yet"
    );

    f.now = at("2026-03-02T10:00:00Z");
    let started = start(&f, stage.id).await.unwrap().remove(0);
    assert_eq!((started.revision, started.plan.episodes_per_task), (2, 2));
    f.run_all(20.0).await;
    assert_eq!(f.store.board_revision(&same).await.unwrap(), 2);
    for (revision, score) in [(1, 10.0), (2, 20.0)] {
        let board = f.store.board(stage.id, revision).await.unwrap();
        assert_eq!(board.len(), 1);
        assert_eq!(board[0].result.score, score);
    }
    let revisions = f.store.stage_revisions(stage.id).await.unwrap();
    let found: Vec<_> = revisions
        .iter()
        .map(|one| (one.number, &one.rules))
        .collect();
    assert_eq!(found, [(1, &stage.rules.rules), (2, &rules)]);
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
    f.ready_team("Alpha").await;
    let stage = create(&f, second()).await;
    let settings = StageSettings {
        schedule: Some(Schedule::daily("06:00".parse().unwrap())),
        ablation_episodes: 3,
        day_deadline: DayDeadline::Hours(30),
        episodes_per_shard: 7,
        ..StageSettings::default()
    };
    let others = StageChange {
        settings: Some(settings.clone()),
        closes_at: Some(None),
        name: Some("Qualifying 2".parse().unwrap()),
        ..StageChange::default()
    };
    let changed = change(&f, stage.id, others).await.unwrap();
    assert_eq!((changed.settings, changed.closes_at), (settings, None));
    assert_eq!(changed.name.as_str(), "Qualifying 2");
    assert_eq!(changed.rules, stage.rules);
}

#[tokio::test]
async fn started_stage_refuses_most_changes() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let open = create(&f, second()).await;
    let upcoming = NewStage {
        name: "Final".parse().unwrap(),
        opens_at: at("2026-03-02T10:00:00Z"),
        ..second()
    };
    let upcoming = create(&f, upcoming).await;
    let opening = |text| StageChange {
        opens_at: Some(at(text)),
        ..StageChange::default()
    };
    let closing = |text| StageChange {
        closes_at: Some(Some(at(text))),
        ..StageChange::default()
    };
    let zone = || StageChange {
        zone: Some("Europe/Berlin".parse().unwrap()),
        ..StageChange::default()
    };
    let name = |text: &str| StageChange {
        name: Some(text.parse().unwrap()),
        ..StageChange::default()
    };
    refused(
        change(&f, open.id, opening("2026-03-02T00:00:00Z")).await,
        &["opens_at", "opened at 2026-03-01T10:00:00Z"],
    );
    refused(
        change(&f, upcoming.id, opening("2026-03-01T09:00:00Z")).await,
        &["opens_at", "future"],
    );
    refused(
        change(&f, upcoming.id, opening("2026-03-04T10:00:00Z")).await,
        &["closes_at", "after the opening"],
    );
    refused(
        change(&f, open.id, closing("2026-03-01T10:00:00Z")).await,
        &["closes_at"],
    );
    let taken = change(&f, upcoming.id, name("warm-UP")).await;
    assert!(
        matches!(taken, Err(StoreError::StageNameTaken(_))),
        "{taken:?}"
    );
    change(&f, open.id, zone()).await.unwrap();

    // Before the opening, new rules replace the old ones without a new revision.
    let moved = StageChange {
        rules: Some(StageRules {
            episodes_per_task: 9,
            ..upcoming.rules.rules.clone()
        }),
        ..opening("2026-03-02T12:00:00Z")
    };
    let moved = change(&f, upcoming.id, moved).await.unwrap();
    assert_eq!(
        (
            moved.rules.number,
            moved.rules.since,
            moved.rules.rules.episodes_per_task
        ),
        (1, at("2026-03-02T12:00:00Z"), 9)
    );

    start(&f, open.id).await.unwrap();
    let utc = StageChange {
        zone: Some(Zone::UTC),
        ..StageChange::default()
    };
    refused(change(&f, open.id, utc).await, &["zone", "Europe/Berlin"]);
    f.now = open.closes_at.unwrap();
    refused(
        change(&f, open.id, name("Done")).await,
        &["closed at", "another stage"],
    );
    refused(
        change(&f, open.id, closing("2026-03-09T10:00:00Z")).await,
        &["closed at"],
    );
    let none = StageId::new();
    let unknown = change(&f, none, name("Done")).await;
    assert!(
        matches!(unknown, Err(StoreError::NotFound("stage"))),
        "{unknown:?}"
    );
}

#[tokio::test]
async fn invalid_stages_are_refused() {
    let mut f = TestStore::new().await;
    let bad_times = NewStage {
        closes_at: Some(at("2026-03-01T09:00:00Z")),
        ..second()
    };
    let no_tasks = NewStage {
        rules: StageRules {
            tasks: Vec::new(),
            ..second().rules
        },
        ..second()
    };
    let no_shards = NewStage {
        settings: StageSettings {
            episodes_per_shard: 0,
            ..second().settings
        },
        ..second()
    };
    for (new, word) in [
        (bad_times, "closes_at"),
        (no_tasks, "tasks"),
        (no_shards, "episodes_per_shard"),
    ] {
        let made = f.store.create_stage(Actor::Organiser, new, f.now).await;
        refused(made, &[word]);
    }
    assert_eq!(f.store.stages().await.unwrap(), []);
    assert_eq!(f.store.events_after(0, 10).await.unwrap(), []);
    f.store.close_season(Actor::Organiser, f.now).await.unwrap();
    f.later(1);
    let late = f
        .store
        .create_stage(Actor::Organiser, second(), f.now)
        .await;
    assert!(
        matches!(late, Err(StoreError::SeasonClosed { .. })),
        "{late:?}"
    );
}

#[tokio::test]
async fn first_stage_follows_configuration_until_changed() {
    let mut f = TestStore::new().await;
    let configure = async |f: &TestStore, plan: &RunPlan| {
        let (rules, settings) = rules_and_settings(plan);
        let configured = f.store.configure_stage(rules, settings, Zone::UTC, f.now);
        configured.await.unwrap();
        f.store.stages().await.unwrap()
    };
    let first = configure(&f, &plan()).await;
    assert_eq!(first.len(), 1);
    assert!(first[0].configured && first[0].names_seeds);
    assert_eq!(first[0].plan(), plan());
    f.later(60);
    assert_eq!(
        configure(&f, &plan()).await,
        first,
        "an identical configuration is no change"
    );
    let second = configure(&f, &small()).await;
    assert_eq!((second[0].id, second[0].rules.number), (first[0].id, 2));
    assert_eq!(second[0].plan(), small());

    let by_hand = StageChange {
        rules: Some(first[0].rules.rules.clone()),
        ..StageChange::default()
    };
    let changed = change(&f, first[0].id, by_hand).await.unwrap();
    assert_eq!((changed.rules.number, changed.configured), (3, false));
    assert_eq!(configure(&f, &small()).await, [changed]);
}

#[tokio::test]
async fn stage_of_closed_season_is_unchangeable() {
    let mut f = TestStore::new().await;
    f.store.close_season(Actor::Organiser, f.now).await.unwrap();
    f.later(1);
    let first = f.stage(&plan()).await;
    let stage = f.store.stage(first).await.unwrap();
    assert_eq!(f.stage(&small()).await, first);
    assert_eq!(f.store.stage(first).await.unwrap(), stage);
    let change = change(&f, first, StageChange::default()).await;
    assert!(
        matches!(change, Err(StoreError::SeasonClosed { .. })),
        "{change:?}"
    );
}

#[tokio::test]
async fn current_stage_is_the_open_or_nearest_one() {
    let f = TestStore::new().await;
    let current = async |text: &str| {
        let current = f.store.current_stage(at(text)).await.unwrap();
        current.map(|stage| stage.name.to_string())
    };
    assert_eq!(current("2026-03-01T10:00:00Z").await, None);
    for (name, opens_at, closes_at) in [
        ("A", "2026-03-02T00:00:00Z", "2026-03-04T00:00:00Z"),
        ("B", "2026-03-03T00:00:00Z", "2026-03-05T00:00:00Z"),
        ("C", "2026-03-07T00:00:00Z", "2026-03-08T00:00:00Z"),
    ] {
        let new = NewStage {
            name: name.parse().unwrap(),
            opens_at: at(opens_at),
            closes_at: Some(at(closes_at)),
            ..second()
        };
        create(&f, new).await;
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
        assert_eq!(current(now).await.as_deref(), Some(expected), "{now}");
    }
}
