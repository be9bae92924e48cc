//! The end of a day: it is *released* once all its evaluations have ended, so that its seed is public and teams get their datasets.
//! After platform faults evaluations are rerun first. Also the end of a season.

use crate::fixture::*;
use faceoff_airhockey::ABLATION_PROFILES;
use faceoff_store::*;
use faceoff_types::{EvaluationId, StageDay};
use jiff::civil::date;

async fn rerun(f: &TestStore, id: EvaluationId) -> Result<Evaluation, StoreError> {
    f.store.rerun_evaluation(Actor::Operator, id, f.now).await
}

/// When the newest day of the first stage was released.
async fn released_at(f: &TestStore) -> Option<jiff::Timestamp> {
    // Configures the first stage again, for its id; a day that has started keeps its plan.
    let stage = f.configure_stage(&six_shard_plan()).await;
    let newest = f.store.newest_day(stage).await.unwrap();
    newest.expect("the day has started").released_at
}

#[tokio::test]
async fn day_is_released_by_its_last_evaluation() {
    let mut f = TestStore::new().await;
    let submissions = [
        f.valid_submission_of("alpha").await,
        f.valid_submission_of("beta").await,
    ];
    let mut evaluations = Vec::new();
    for submission in &submissions {
        evaluations.push(f.evaluate(submission.id, &six_shard_plan()).await.id);
    }
    assert_eq!(f.finish_next_evaluation().await, evaluations[0]);
    assert_eq!(released_at(&f).await, None);
    assert_eq!(
        f.store
            .evaluation(evaluations[0])
            .await
            .unwrap()
            .released_at,
        None
    );
    f.advance_clock_s(86_400);
    assert_eq!(
        released_at(&f).await,
        None,
        "an evaluation can outlast its day"
    );
    assert_eq!(f.finish_next_evaluation().await, evaluations[1]);
    let ended_at = f.now;
    f.advance_clock_s(60);
    assert_eq!(released_at(&f).await, Some(ended_at));
    for id in evaluations {
        assert_eq!(
            f.store.evaluation(id).await.unwrap().released_at,
            Some(ended_at)
        );
    }
    for record in f.board().await {
        assert_eq!(record.released_at, Some(ended_at));
    }
    let events = f.store.events_after(0, 1000).await.unwrap();
    let released: Vec<_> = events
        .iter()
        .filter(|record| record.event == Event::DayReleased)
        .collect();
    assert_eq!(released.len(), 1);
    let stage_day = StageDay {
        stage: f.configure_stage(&six_shard_plan()).await,
        date: date(2026, 3, 1),
    };
    assert_eq!(released[0].subject, Subject::Day(stage_day));
}

#[tokio::test]
async fn day_is_released_by_agent_failure_and_cancellation() {
    let f = TestStore::new().await;
    let failing = f.valid_submission_of("failing").await;
    let cancelled = f.valid_submission_of("cancelled").await;
    let strict = RunPlan {
        max_faults: 0,
        ..one_shard_plan()
    };
    f.evaluate(failing.id, &strict).await;
    let cancelled = f.evaluate(cancelled.id, &strict).await.id;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard_with_faults(&claim, &shard, 1).await;
    assert_eq!(released_at(&f).await, None);
    let result = f
        .store
        .cancel_evaluation(Actor::Operator, cancelled, "rain", f.now);
    result.await.unwrap();
    assert_eq!(released_at(&f).await, Some(f.now));
}

#[tokio::test]
async fn platform_faults_rerun_before_release_with_a_limit() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("alpha").await;
    let first = f.evaluate(submission.id, &one_shard_plan()).await;
    // A newer upload does not matter: the submission that was active at the cutoff is rerun.
    f.advance_clock_s(1);
    let team = f.store.team(submission.team).await.unwrap();
    f.upload(&team).await;
    f.validate().await;
    let mut failed = Vec::new();
    for pause_s in RERUN_PAUSES_S {
        failed.push(f.fail_next_evaluation().await);
        assert_eq!(released_at(&f).await, None);
        assert!(f.claim().await.is_none(), "the rerun pauses");
        f.advance_clock_s(i64::from(pause_s) - 1);
        assert!(
            f.claim().await.is_none(),
            "the rerun pauses for {pause_s} s"
        );
        f.advance_clock_s(1);
    }
    // The newest evaluation is first.
    let all = f.store.evaluations_of(team.id).await.unwrap();
    assert_eq!(all.len(), 3);
    assert_eq!(failed, [all[2].id, all[1].id]);
    assert_eq!(first.id, all[2].id);
    assert_eq!(
        (all[1].rerun_of, all[0].rerun_of),
        (Some(all[2].id), Some(all[1].id))
    );
    let secret = f.store.season().await.unwrap().secret;
    for evaluation in &all {
        assert_eq!(evaluation.submission, submission.id);
        assert_eq!(
            (evaluation.stage_day.date, &evaluation.plan),
            (first.stage_day.date, &first.plan)
        );
    }
    let Some(ClaimedJob {
        claim,
        job:
            Job::Shard {
                seeds,
                bundle: evaluated_bundle,
                ..
            },
    }) = f.claim().await
    else {
        panic!("the last rerun is queued")
    };
    assert_eq!(
        seeds.episodes,
        secret
            .stage(first.stage_day.stage)
            .day(first.stage_day.date)
    );
    assert_eq!(evaluated_bundle, bundle());
    f.store.release(&claim, f.now).await.unwrap();

    // The last rerun fails, too, and the day is released.
    assert_eq!(f.fail_next_evaluation().await, all[0].id);
    assert_eq!(released_at(&f).await, Some(f.now));
    f.advance_clock_s(86_400);
    assert!(f.claim().await.is_none());
    assert_eq!(f.store.evaluations_of(team.id).await.unwrap().len(), 3);
}

#[tokio::test]
async fn successful_rerun_releases_the_day() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("alpha").await;
    f.evaluate(submission.id, &one_shard_plan()).await;
    let failed = f.fail_next_evaluation().await;
    f.advance_clock_s(i64::from(RERUN_PAUSES_S[0]));
    let id = f.finish_next_evaluation().await;
    let finished = f.store.evaluation(id).await.unwrap();
    assert_eq!(finished.rerun_of, Some(failed));
    assert_eq!(finished.released_at, Some(f.now));
    let on_board = &f.board().await[0];
    assert_eq!(on_board.evaluation, finished.id);
    assert!(!on_board.rerun_after_release, "it began before the release");
}

#[tokio::test]
async fn rerun_after_release_uses_submission_of_cutoff() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("alpha").await;
    let cancelled = f.evaluate(submission.id, &one_shard_plan()).await;
    let result = f
        .store
        .cancel_evaluation(Actor::Operator, cancelled.id, "wrong runtime", f.now);
    result.await.unwrap();
    assert_eq!(released_at(&f).await, Some(f.now));
    f.advance_clock_s(1);
    let team = f.store.team(submission.team).await.unwrap();
    f.upload(&team).await;
    let newer = f.validate().await;
    assert!(newer.active);
    let second_run = rerun(&f, cancelled.id).await.unwrap();
    assert_eq!(
        (second_run.submission, second_run.stage_day.date),
        (submission.id, cancelled.stage_day.date)
    );
    assert_eq!(second_run.rerun_of, Some(cancelled.id));
    let repeated = rerun(&f, cancelled.id).await;
    assert!(
        matches!(repeated, Err(StoreError::Conflict(_))),
        "only one rerun at a time"
    );
    // After the release, platform faults cause no automatic rerun; an organiser can request one.
    assert_eq!(f.fail_next_evaluation().await, second_run.id);
    f.advance_clock_s(3600);
    assert!(f.claim().await.is_none());
    let third_run = rerun(&f, second_run.id).await.unwrap();
    assert_eq!(third_run.submission, submission.id);
    f.finish_next_evaluation().await;
    assert!(
        f.board().await[0].rerun_after_release,
        "the board says that the episodes were public"
    );
    let repeated = rerun(&f, cancelled.id).await;
    assert!(
        matches!(repeated, Err(StoreError::Conflict(_))),
        "the evaluation's rerun has a score"
    );
    // The newer submission is evaluated on a later day, on other episodes.
    f.advance_clock_s(86_400);
    let next = f.evaluate(newer.id, &one_shard_plan()).await;
    assert_ne!(next.stage_day.date, cancelled.stage_day.date);
}

#[tokio::test]
async fn closed_season_refuses_all_operations() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("alpha").await;
    let evaluation = f.evaluate(submission.id, &six_shard_plan()).await;
    let error = f
        .store
        .close_season(Actor::Operator, f.now)
        .await
        .unwrap_err();
    assert!(error.to_string().starts_with("1 evaluations"), "{error}");
    assert_eq!(f.store.season().await.unwrap().closed_at, None);
    f.store
        .cancel_evaluation(Actor::Operator, evaluation.id, "the end", f.now)
        .await
        .unwrap();
    f.store.close_season(Actor::Operator, f.now).await.unwrap();
    let closed_at = f.now;

    f.advance_clock_s(60);
    assert_eq!(
        f.reopen().await.season().await.unwrap().closed_at,
        Some(closed_at)
    );
    let assert_season_closed = |error: StoreError| {
        assert!(
            matches!(error, StoreError::SeasonClosed { closed_at: at } if at == closed_at),
            "{error}"
        );
    };
    let plan = six_shard_plan();
    let rerun = f
        .store
        .rerun_evaluation(Actor::Operator, evaluation.id, f.now);
    assert_season_closed(rerun.await.unwrap_err());
    let stage = f.store.stages().await.unwrap().remove(0).id;
    let ablation = f.store.request_ablation(
        Actor::Operator,
        submission.id,
        faceoff_airhockey::RULESET,
        &plan,
        &ABLATION_PROFILES,
        f.now,
    );
    assert_season_closed(ablation.await.unwrap_err());
    assert_eq!(
        f.store.start_scheduled_day(stage, f.now).await.unwrap(),
        None
    );
}

#[tokio::test]
async fn season_keeps_its_name() {
    let f = TestStore::new().await;
    assert_eq!(f.store.season().await.unwrap().name, "Season 1");
    for _ in 0..2 {
        f.store
            .name_season(Actor::Operator, "Spring 2026", f.now)
            .await
            .unwrap();
    }
    let events = f.store.events_after(0, 10).await.unwrap();
    assert_eq!(events.len(), 1, "an unchanged name is no event: {events:?}");
    assert_eq!(f.reopen().await.season().await.unwrap().name, "Spring 2026");
}

#[tokio::test]
async fn episode_summary_is_stored_with_its_version() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("alpha").await;
    let run = f.evaluate(submission.id, &six_shard_plan()).await.run;
    let stored_summary = async |version| {
        let mut summaries = f.store.episode_summaries(&[run], version).await.unwrap();
        summaries.remove(&run)
    };
    let store_summary =
        |version, summary| f.store.store_episode_summary(run, version, summary, f.now);
    assert_eq!(stored_summary(1).await, None);
    store_summary(1, "{}").await.unwrap();
    assert_eq!(stored_summary(1).await.as_deref(), Some("{}"));
    store_summary(2, "[]").await.unwrap();
    assert_eq!(stored_summary(1).await, None);
}
