//! Blind stages, final days, publication, and results that are signed off.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::Timestamp;

fn at(text: &str) -> Timestamp {
    text.parse().unwrap()
}

const CLOSES: &str = "2026-03-03T10:00:00Z";

async fn stage_with(f: &Fixture, settings: StageSettings) -> Stage {
    let (rules, of_plan) = rules_of(&small());
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

fn by(standings: Standings) -> StageSettings {
    StageSettings {
        standings,
        ..StageSettings::default()
    }
}

async fn start(f: &Fixture, stage: &Stage) -> Vec<Evaluation> {
    let started = f.store.start_day(Actor::Organiser, stage.id, f.now);
    started.await.unwrap()
}

/// Changes settings as they are at the moment.
async fn set(
    f: &Fixture,
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

async fn finalise(f: &Fixture, stage: &Stage) -> Result<Stage, StoreError> {
    let done = f.store.finalise_stage(Actor::Organiser, stage.id, f.now);
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

async fn kinds(f: &Fixture) -> Vec<Event> {
    let events = f.store.events_after(0, 1000).await.unwrap();
    events.into_iter().map(|record| record.event).collect()
}

#[tokio::test]
async fn a_blind_stage_is_opened_once_and_no_stage_is_closed_to_eyes_that_have_read_it() {
    let mut f = Fixture::new().await;
    f.ready_team("Alpha").await;
    let stage = stage_with(&f, blind()).await;
    // Before anything is scored it is as the organiser likes.
    set(&f, &stage, |settings| settings.blind = false)
        .await
        .unwrap();
    start(&f, &stage).await;
    set(&f, &stage, |settings| settings.blind = true)
        .await
        .unwrap();
    f.play_to(10.0).await;
    refused(
        f.store.close_season(Actor::Organiser, f.now).await,
        &["Warm-up", "blind", "open it first"],
    );

    f.now = at(CLOSES);
    refused(finalise(&f, &stage).await, &["blind", "open it first"]);
    let other = set(&f, &stage, |settings| {
        settings.blind = false;
        settings.ablation_episodes = 5;
    });
    refused(other.await, &["closed at", "can be opened"]);
    let opened = set(&f, &stage, |settings| settings.blind = false)
        .await
        .unwrap();
    assert!(!opened.settings.blind);
    let again = set(&f, &stage, |settings| settings.blind = true).await;
    refused(again, &["closed at"]);
    f.store.close_season(Actor::Organiser, f.now).await.unwrap();
}

#[tokio::test]
async fn an_open_stage_with_scores_is_not_made_blind() {
    let f = Fixture::new().await;
    f.ready_team("Alpha").await;
    let stage = stage_with(&f, StageSettings::default()).await;
    start(&f, &stage).await;
    f.play_to(10.0).await;
    let hidden = set(&f, &stage, |settings| settings.blind = true).await;
    refused(hidden, &["blind: 1 evaluations", "before that"]);
}

#[tokio::test]
async fn datasets_of_a_closed_stage_can_be_published_sooner_but_not_later() {
    let mut f = Fixture::new().await;
    let stage = stage_with(&f, StageSettings::default()).await;
    f.now = at(CLOSES);
    let sooner = set(&f, &stage, |settings| {
        settings.publishes = Publishes::AtRelease
    });
    assert_eq!(
        sooner.await.unwrap().settings.publishes,
        Publishes::AtRelease
    );
    for later in [Publishes::AtClose, Publishes::Never] {
        let later = set(&f, &stage, |settings| settings.publishes = later);
        refused(later.await, &["stays as it was"]);
    }
}

#[tokio::test]
async fn a_stage_is_signed_off_once_it_is_settled_and_then_nothing_of_it_changes() {
    let mut f = Fixture::new().await;
    f.ready_team("Alpha").await;
    f.ready_team("Beta").await;
    let stage = stage_with(&f, StageSettings::default()).await;
    let started = start(&f, &stage).await;
    refused(
        finalise(&f, &stage).await,
        &["has not closed", "2026-03-03"],
    );
    f.now = at(CLOSES);
    refused(
        finalise(&f, &stage).await,
        &["2 evaluations", "cancel them"],
    );
    let cancelled = f
        .store
        .cancel_evaluation(Actor::Organiser, started[1].id, "late", f.now);
    cancelled.await.unwrap();
    f.play_to(10.0).await;
    let beta = started[1].team;
    let out = f
        .store
        .disqualify_team(Actor::Organiser, beta, "why", f.now);
    out.await.unwrap();

    f.store.check_stage_settled(stage.id, f.now).await.unwrap();
    assert_eq!(f.store.stage(stage.id).await.unwrap().finalised, None);
    let done = finalise(&f, &stage).await.unwrap();
    let expected = Finalised {
        at: f.now,
        by: Actor::Organiser,
        without: vec![beta],
    };
    assert_eq!(done.finalised, Some(expected));
    let signed = kinds(&f).await;
    assert!(signed.contains(&Event::StageFinalised));

    f.later(60);
    let words = [
        "Warm-up",
        "signed off on 2026-03-03 at 10:00:00 UTC by organiser",
    ];
    refused(finalise(&f, &stage).await, &words);
    let (of, id) = (started[0].of, started[0].id);
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
        settings.publishes = Publishes::AtRelease
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

    // Who is disqualified or reinstated later changes other boards, not this one.
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

    // The database itself refuses what a forgetful operation would do.
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
async fn a_final_day_is_cut_once_after_the_close_and_owed_before_the_signature() {
    let mut f = Fixture::new().await;
    f.ready_team("Alpha").await;
    let stage = stage_with(&f, by(Standings::Final)).await;
    start(&f, &stage).await;
    f.play_to(10.0).await;
    let last = async |now| {
        f.store
            .start_final_day(Actor::Organiser, stage.id, now)
            .await
    };
    refused(
        last(f.now).await,
        &["has not closed", "final day comes after"],
    );
    assert_eq!(f.store.final_cut(stage.id).await.unwrap(), None);
    f.now = at(CLOSES);
    refused(finalise(&f, &stage).await, &["final day", "start it first"]);
    refused(
        f.store.close_season(Actor::Organiser, f.now).await,
        &["Warm-up", "final day", "start it first"],
    );

    let started = last(f.now).await.unwrap();
    assert_eq!(started.len(), 1);
    let date = jiff::civil::date(2026, 3, 3);
    assert_eq!(started[0].of.date, date);
    refused(last(f.now).await, &["had its cut", "there is one"]);
    refused(finalise(&f, &stage).await, &["1 evaluations"]);
    let secret = f.store.season().await.unwrap().secret;
    let claimed = f.claim().await.unwrap();
    let Work::Shard { seeds, shard, .. } = claimed.work else {
        panic!("expected a shard");
    };
    assert_eq!(
        seeds.episodes,
        secret.stage(stage.id).day(date),
        "seeds of its own"
    );
    f.play(&claimed.claim, &shard, 0).await;
    f.play_to(40.0).await;

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
    assert_eq!(f.store.final_cut(stage.id).await.unwrap(), Some(f.now));
    assert!(
        kinds(&f)
            .await
            .contains(&Event::StageFinalStarted { day: date })
    );
    finalise(&f, &stage).await.unwrap();
}

#[tokio::test]
async fn a_final_day_needs_a_date_of_its_own_somebody_who_plays_and_a_stage_that_has_one() {
    let mut f = Fixture::new().await;
    let without = stage_with(&f, by(Standings::Best)).await;
    let other = f.store.start_final_day(Actor::Organiser, without.id, f.now);
    refused(other.await, &["“best”", "no final day"]);
    f.now = at("2026-03-03T09:00:00Z");
    let (rules, settings) = rules_of(&small());
    let new = NewStage {
        name: "Last".parse().unwrap(),
        opens_at: f.now,
        closes_at: Some(at(CLOSES)),
        zone: Zone::UTC,
        rules,
        settings: StageSettings {
            standings: Standings::Final,
            ..settings
        },
    };
    let stage = f
        .store
        .create_stage(Actor::Organiser, new, f.now)
        .await
        .unwrap();
    let nobody = f
        .store
        .start_final_day(Actor::Organiser, stage.id, at(CLOSES));
    refused(nobody.await, &["no team has a valid submission"]);
    f.ready_team("Alpha").await;
    start(&f, &stage).await;
    f.play_to(1.0).await;
    f.now = at(CLOSES);
    let same_date = f.store.start_final_day(Actor::Organiser, stage.id, f.now);
    assert!(matches!(same_date.await, Err(StoreError::DayHasCut { .. })));
    f.later(24 * 3600);
    let next = f.store.start_final_day(Actor::Organiser, stage.id, f.now);
    assert_eq!(next.await.unwrap().len(), 1);
}

#[tokio::test]
async fn a_team_publishes_what_is_finished_and_released_and_not_blind() {
    let mut f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await.team;
    f.ready_team("Beta").await;
    let stage = stage_with(&f, blind()).await;
    let started = start(&f, &stage).await;
    let publish = async |f: &Fixture, id| {
        let done = f.store.publish_evaluation(Actor::Team(alpha), id, f.now);
        done.await
    };
    let id = started[0].id;
    refused(publish(&f, id).await, &["finished evaluation"]);
    assert_eq!(f.finish_next().await, id);
    refused(publish(&f, id).await, &["blind"]);
    // Nothing of it could be read.
    let opened = set(&f, &stage, |settings| settings.blind = false).await;
    opened.unwrap();
    refused(publish(&f, id).await, &["same episodes"]);
    f.play_to(1.0).await;
    let published = publish(&f, id).await.unwrap();
    assert_eq!(published.published_at, Some(f.now));
    let first = f.now;
    f.later(5);
    assert_eq!(publish(&f, id).await.unwrap().published_at, Some(first));
    let told = kinds(&f).await;
    let times = told
        .iter()
        .filter(|event| **event == Event::EvaluationPublished);
    assert_eq!(times.count(), 1);
}
