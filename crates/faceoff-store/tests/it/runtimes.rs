//! Stages that accept only agents of some runtimes (the environments that agents run in, for example `python3`).

use crate::fixture::*;
use faceoff_store::*;
use faceoff_testkit::accept_runtimes;

/// Subjects of the events that the stage did not accept a submission.
async fn excluded_submissions(f: &TestStore) -> Vec<Subject> {
    let events = f.store.events_after(0, 1000).await.unwrap();
    let exclusions = events.into_iter().filter(|record| {
        matches!(&record.event, Event::SubmissionExcluded { reason, .. } if reason.contains("“Qualifying”"))
    });
    exclusions.map(|record| record.subject).collect()
}

#[tokio::test]
async fn scheduled_day_without_submissions_is_released() {
    let f = TestStore::new().await;
    let native = f.valid_submission_of("Alpha").await;
    let stage = f.configure_stage(&six_shard_plan()).await;
    accept_runtimes(&f.store, stage, Some(&["python3"]), f.now).await;
    let started = f.store.start_scheduled_day(stage, f.now).await.unwrap();
    assert_eq!(started, Some(Vec::new()));
    assert_eq!(
        excluded_submissions(&f).await,
        [Subject::Submission(native.id)]
    );
    let day = f.store.newest_day(stage).await.unwrap().unwrap();
    assert_eq!(day.released_at, Some(f.now));
    assert!(f.claim().await.is_none(), "no job is queued");
}

#[tokio::test]
async fn submission_with_unknown_runtime_must_be_uploaded_again() {
    let f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    f.upload(&team).await;
    let old = f.validate().await;
    let mut connection = f.connection().await;
    sqlx::query("UPDATE submissions SET runtime = NULL")
        .execute(&mut connection)
        .await
        .unwrap();
    let stage = f.configure_stage(&six_shard_plan()).await;
    let active_submission = || async { f.store.active_submissions().await.unwrap().remove(0) };
    let current_stage = async || f.store.stage(stage).await.unwrap();
    assert_eq!(
        current_stage()
            .await
            .check_accepts(&active_submission().await),
        Ok(()),
        "all runtimes are accepted"
    );
    accept_runtimes(&f.store, stage, Some(&["native"]), f.now).await;
    let refused = current_stage()
        .await
        .check_accepts(&active_submission().await)
        .unwrap_err();
    assert!(refused.to_string().contains("upload it again"), "{refused}");
    let started = f.store.start_day(Actor::Operator, stage, f.now).await;
    let Err(StoreError::Conflict(reason)) = started else {
        panic!("expected a refusal, got {started:?}");
    };
    assert!(reason.contains("that the stage accepts"), "{reason}");
    assert!(
        excluded_submissions(&f).await.is_empty(),
        "no exclusion is recorded"
    );

    f.upload(&team).await;
    let new = f.validate().await;
    assert_eq!(new.duplicate_of, Some(old.id));
    assert_eq!(
        current_stage()
            .await
            .check_accepts(&active_submission().await),
        Ok(())
    );
    let started = f.store.start_day(Actor::Operator, stage, f.now).await;
    assert_eq!(started.unwrap()[0].submission, new.id);
}
