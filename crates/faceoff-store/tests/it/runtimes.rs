//! Stages that take agents of some runtimes only: at the cut, by whatever way it comes.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

/// Has the season's first stage take these only.
async fn takes(f: &Fixture, stage: StageId, runtime: &str) {
    let rules = StageRules {
        runtimes: Some([runtime.to_owned()].into_iter().collect()),
        ..f.store.stage(stage).await.unwrap().rules.rules
    };
    let change = StageChange {
        rules: Some(rules),
        ..StageChange::default()
    };
    let changed = f.store.change_stage(Actor::Organiser, stage, change, f.now);
    changed.await.unwrap();
}

async fn not_taken(f: &Fixture) -> Vec<Subject> {
    let events = f.store.events_after(0, 1000).await.unwrap();
    let left_out = events.into_iter().filter(|record| {
        matches!(&record.event, Event::SubmissionNotTaken { reason, .. } if reason.contains("“Qualifying”"))
    });
    left_out.map(|record| record.subject).collect()
}

#[tokio::test]
async fn a_scheduled_day_that_takes_nobody_has_its_cut_and_is_over() {
    let f = Fixture::new().await;
    let native = f.ready_team("Alpha").await;
    let stage = f.stage(&plan()).await;
    takes(&f, stage, "python3").await;
    let started = f.store.start_scheduled_day(stage, f.now).await.unwrap();
    assert_eq!(started, Some(Vec::new()));
    assert_eq!(not_taken(&f).await, [Subject::Submission(native.id)]);
    let day = f.store.newest_day(stage).await.unwrap().unwrap();
    assert_eq!(day.released_at, Some(f.now));
    assert!(f.claim().await.is_none(), "nothing is played");
}

#[tokio::test]
async fn an_agent_that_was_checked_before_runtimes_were_told_is_taken_once_it_is_uploaded_again() {
    let f = Fixture::new().await;
    let team = f.team("Alpha").await;
    f.upload(&team).await;
    let old = f.validate().await;
    let mut connection = f.connection().await;
    sqlx::query("UPDATE submissions SET runtime = NULL")
        .execute(&mut connection)
        .await
        .unwrap();
    let stage = f.stage(&plan()).await;
    let active = || async { f.store.active_submissions().await.unwrap().remove(0) };
    let told = async || f.store.stage(stage).await.unwrap();
    assert_eq!(told().await.check_takes(&active().await), Ok(()), "all are");
    takes(&f, stage, "native").await;
    let refused = told().await.check_takes(&active().await).unwrap_err();
    assert!(refused.to_string().contains("upload it again"), "{refused}");
    let started = f.store.start_day(Actor::Organiser, stage, f.now).await;
    let Err(StoreError::Conflict(why)) = started else {
        panic!("expected a refusal, got {started:?}");
    };
    assert!(why.contains("that the stage takes"), "{why}");
    assert!(not_taken(&f).await.is_empty(), "nothing is done");

    f.upload(&team).await;
    let new = f.validate().await;
    assert_eq!(new.same_as, Some(old.id));
    assert_eq!(told().await.check_takes(&active().await), Ok(()));
    let started = f.store.start_day(Actor::Organiser, stage, f.now).await;
    assert_eq!(started.unwrap()[0].submission, new.id);
}
