use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{EvaluationId, StageDay};
use jiff::civil::date;

async fn rerun(f: &TestStore, id: EvaluationId) -> Result<Evaluation, StoreError> {
    f.store.rerun_evaluation(Actor::Organiser, id, f.now).await
}

async fn released_at(f: &TestStore) -> Option<jiff::Timestamp> {
    let newest = f.store.newest_day(f.stage(&plan()).await).await.unwrap();
    newest.expect("the day has started").released_at
}

#[tokio::test]
async fn day_is_released_by_its_last_evaluation() {
    let mut f = TestStore::new().await;
    let submissions = [f.ready_team("alpha").await, f.ready_team("beta").await];
    let mut evaluations = Vec::new();
    for submission in &submissions {
        evaluations.push(f.evaluate(submission.id, &plan()).await.id);
    }
    assert_eq!(f.finish_next().await, evaluations[0]);
    assert_eq!(released_at(&f).await, None);
    assert_eq!(
        f.store
            .evaluation(evaluations[0])
            .await
            .unwrap()
            .released_at,
        None
    );
    f.later(86_400);
    assert_eq!(
        released_at(&f).await,
        None,
        "an evaluation can outlast its day"
    );
    assert_eq!(f.finish_next().await, evaluations[1]);
    let end = f.now;
    f.later(60);
    assert_eq!(released_at(&f).await, Some(end));
    for id in evaluations {
        assert_eq!(f.store.evaluation(id).await.unwrap().released_at, Some(end));
    }
    for record in f.board().await {
        assert_eq!(record.released_at, Some(end));
    }
    let events = f.store.events_after(0, 1000).await.unwrap();
    let released: Vec<_> = events
        .iter()
        .filter(|record| record.event == Event::DayReleased)
        .collect();
    assert_eq!(released.len(), 1);
    let of = StageDay {
        stage: f.stage(&plan()).await,
        date: date(2026, 3, 1),
    };
    assert_eq!(released[0].subject, Subject::Day(of));
}

#[tokio::test]
async fn day_is_released_by_agent_failure_and_cancellation() {
    let f = TestStore::new().await;
    let failing = f.ready_team("failing").await;
    let stopped = f.ready_team("stopped").await;
    let strict = RunPlan {
        max_faults: 0,
        ..small()
    };
    f.evaluate(failing.id, &strict).await;
    let stopped = f.evaluate(stopped.id, &strict).await.id;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard, 1).await;
    assert_eq!(released_at(&f).await, None);
    let stop = f
        .store
        .cancel_evaluation(Actor::Organiser, stopped, "rain", f.now);
    stop.await.unwrap();
    assert_eq!(released_at(&f).await, Some(f.now));
}

#[tokio::test]
async fn platform_faults_rerun_before_release_with_a_limit() {
    let mut f = TestStore::new().await;
    let submission = f.ready_team("alpha").await;
    let first = f.evaluate(submission.id, &small()).await;
    // A newer upload does not matter: the submission of the cutoff is rerun.
    f.later(1);
    let team = f.store.team(submission.team).await.unwrap();
    f.upload(&team).await;
    f.validate().await;
    let mut failed = Vec::new();
    for pause_s in RERUN_PAUSES_S {
        failed.push(f.fail_next().await);
        assert_eq!(released_at(&f).await, None);
        assert!(f.claim().await.is_none(), "the rerun pauses");
        f.later(i64::from(pause_s) - 1);
        assert!(f.claim().await.is_none(), "for {pause_s} s");
        f.later(1);
    }
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
        job: Job::Shard {
            seeds,
            bundle: evaluated,
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
    assert_eq!(evaluated, bundle());
    f.store.release(&claim, f.now).await.unwrap();

    // The last rerun fails too: the day ends all the same.
    assert_eq!(f.fail_next().await, all[0].id);
    assert_eq!(released_at(&f).await, Some(f.now));
    f.later(86_400);
    assert!(f.claim().await.is_none());
    assert_eq!(f.store.evaluations_of(team.id).await.unwrap().len(), 3);
}

#[tokio::test]
async fn successful_rerun_releases_the_day() {
    let mut f = TestStore::new().await;
    let submission = f.ready_team("alpha").await;
    f.evaluate(submission.id, &small()).await;
    let failed = f.fail_next().await;
    f.later(i64::from(RERUN_PAUSES_S[0]));
    let finished = f.finish_next().await;
    let finished = f.store.evaluation(finished).await.unwrap();
    assert_eq!(finished.rerun_of, Some(failed));
    assert_eq!(finished.released_at, Some(f.now));
    assert_eq!(f.board().await[0].evaluation, finished.id);
}

#[tokio::test]
async fn rerun_after_release_uses_submission_of_cutoff() {
    let mut f = TestStore::new().await;
    let submission = f.ready_team("alpha").await;
    let stopped = f.evaluate(submission.id, &small()).await;
    let stop = f
        .store
        .cancel_evaluation(Actor::Organiser, stopped.id, "wrong runtime", f.now);
    stop.await.unwrap();
    assert_eq!(released_at(&f).await, Some(f.now));
    f.later(1);
    let team = f.store.team(submission.team).await.unwrap();
    f.upload(&team).await;
    let newer = f.validate().await;
    assert!(newer.active);
    let second_run = rerun(&f, stopped.id).await.unwrap();
    assert_eq!(
        (second_run.submission, second_run.stage_day.date),
        (submission.id, stopped.stage_day.date)
    );
    assert_eq!(second_run.rerun_of, Some(stopped.id));
    let twice = rerun(&f, stopped.id).await;
    assert!(
        matches!(twice, Err(StoreError::Conflict(_))),
        "only one rerun at a time"
    );
    // After the release, platform faults cause no automatic rerun; an organiser can request one.
    assert_eq!(f.fail_next().await, second_run.id);
    f.later(3600);
    assert!(f.claim().await.is_none());
    let third_run = rerun(&f, second_run.id).await.unwrap();
    assert_eq!(third_run.submission, submission.id);
    f.finish_next().await;
    let twice = rerun(&f, stopped.id).await;
    assert!(
        matches!(twice, Err(StoreError::Conflict(_))),
        "it has its score"
    );
    // The newer submission is evaluated on a later day, on other episodes.
    f.later(86_400);
    let next = f.evaluate(newer.id, &small()).await;
    assert_ne!(next.stage_day.date, stopped.stage_day.date);
}

#[tokio::test]
async fn closed_season_refuses_everything() {
    let mut site = TestStore::new().await;
    let submission = site.ready_team("alpha").await;
    let evaluation = site.evaluate(submission.id, &plan()).await;
    let busy = site
        .store
        .close_season(Actor::Organiser, site.now)
        .await
        .unwrap_err();
    assert!(busy.to_string().starts_with("1 evaluations"), "{busy}");
    assert_eq!(site.store.season().await.unwrap().closed_at, None);
    site.store
        .cancel_evaluation(Actor::Organiser, evaluation.id, "the end", site.now)
        .await
        .unwrap();
    site.store
        .close_season(Actor::Organiser, site.now)
        .await
        .unwrap();
    let closed_at = site.now;

    site.later(60);
    assert_eq!(
        site.reopen().await.season().await.unwrap().closed_at,
        Some(closed_at)
    );
    let closed = |error: StoreError| {
        assert!(
            matches!(error, StoreError::SeasonClosed { closed_at: at } if at == closed_at),
            "{error}"
        );
    };
    closed(
        site.store
            .close_season(Actor::Organiser, site.now)
            .await
            .unwrap_err(),
    );
    let quota = UploadQuota::default();
    let upload = site.store.create_submission(
        Actor::Organiser,
        submission.team,
        bundle(),
        &quota,
        site.now,
    );
    closed(upload.await.unwrap_err());
    let plan = plan();
    let rerun = site
        .store
        .rerun_evaluation(Actor::Organiser, evaluation.id, site.now);
    closed(rerun.await.unwrap_err());
    let choice = site
        .store
        .activate_submission(Actor::Organiser, submission.id, site.now);
    closed(choice.await.unwrap_err());
    let stage = site.store.stages().await.unwrap().remove(0).id;
    closed(
        site.store
            .start_day(Actor::Organiser, stage, site.now)
            .await
            .unwrap_err(),
    );
    let ablation = site
        .store
        .request_ablation(Actor::Organiser, submission.id, &plan, site.now);
    closed(ablation.await.unwrap_err());
    assert_eq!(
        site.store
            .start_scheduled_day(stage, site.now)
            .await
            .unwrap(),
        None
    );
}

#[tokio::test]
async fn season_keeps_its_name() {
    let site = TestStore::new().await;
    assert_eq!(site.store.season().await.unwrap().name, "Season 1");
    for _ in 0..2 {
        site.store
            .name_season(Actor::Organiser, "Spring 2026", site.now)
            .await
            .unwrap();
    }
    let events = site.store.events_after(0, 10).await.unwrap();
    assert_eq!(events.len(), 1, "an unchanged name is no event: {events:?}");
    assert_eq!(
        site.reopen().await.season().await.unwrap().name,
        "Spring 2026"
    );
}

#[tokio::test]
async fn episode_summary_is_stored_with_its_version() {
    let site = TestStore::new().await;
    let submission = site.ready_team("alpha").await;
    let run = site.evaluate(submission.id, &plan()).await.run;
    let stored = async |version| {
        let mut of_runs = site.store.episode_summaries(&[run], version).await.unwrap();
        of_runs.remove(&run)
    };
    let keep = |version, summary| {
        site.store
            .store_episode_summary(run, version, summary, site.now)
    };
    assert_eq!(stored(1).await, None);
    keep(1, "{}").await.unwrap();
    assert_eq!(stored(1).await.as_deref(), Some("{}"));
    keep(2, "[]").await.unwrap();
    assert_eq!(stored(1).await, None);
}
