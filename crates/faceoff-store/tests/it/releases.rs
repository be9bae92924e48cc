use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{EvaluationId, StageDay};
use jiff::civil::date;

async fn rerun(f: &Fixture, id: EvaluationId) -> Result<Evaluation, StoreError> {
    f.store.rerun_evaluation(Actor::Organiser, id, f.now).await
}

async fn released_at(f: &Fixture) -> Option<jiff::Timestamp> {
    let newest = f.store.newest_day(f.stage(&plan()).await).await.unwrap();
    newest.expect("the day had its cut").released_at
}

#[tokio::test]
async fn a_day_is_released_by_the_end_of_its_last_evaluation() {
    let mut f = Fixture::new().await;
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
    assert_eq!(released_at(&f).await, None, "a run that outlasts its day");
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
async fn the_agents_own_end_and_the_organisers_release_the_day_as_well() {
    let f = Fixture::new().await;
    let failing = f.ready_team("failing").await;
    let stopped = f.ready_team("stopped").await;
    let strict = RunPlan {
        max_faults: 0,
        ..small()
    };
    f.evaluate(failing.id, &strict).await;
    let stopped = f.evaluate(stopped.id, &strict).await.id;
    let (claim, _, shard) = f.claim_shard().await;
    f.play(&claim, &shard, 1).await;
    assert_eq!(released_at(&f).await, None);
    let stop = f
        .store
        .cancel_evaluation(Actor::Organiser, stopped, "rain", f.now);
    stop.await.unwrap();
    assert_eq!(released_at(&f).await, Some(f.now));
}

#[tokio::test]
async fn what_we_broke_is_played_again_before_the_release_and_only_so_often() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("alpha").await;
    let first = f.evaluate(submission.id, &small()).await;
    // A newer upload and a choice change nothing: the cut's submission plays.
    f.later(1);
    let team = f.store.team(submission.team).await.unwrap();
    f.upload(&team).await;
    f.validate().await;
    let mut broken = Vec::new();
    for pause_s in RERUN_PAUSES_S {
        broken.push(f.break_next().await);
        assert_eq!(released_at(&f).await, None);
        assert!(f.claim().await.is_none(), "it rests");
        f.later(i64::from(pause_s) - 1);
        assert!(f.claim().await.is_none(), "for {pause_s} s");
        f.later(1);
    }
    let all = f.store.evaluations_of(team.id).await.unwrap();
    assert_eq!(all.len(), 3);
    assert_eq!(broken, [all[2].id, all[1].id]);
    assert_eq!(first.id, all[2].id);
    assert_eq!(
        (all[1].rerun_of, all[0].rerun_of),
        (Some(all[2].id), Some(all[1].id))
    );
    let secret = f.store.season().await.unwrap().secret;
    for evaluation in &all {
        assert_eq!(evaluation.submission, submission.id);
        assert_eq!(
            (evaluation.of.date, &evaluation.plan),
            (first.of.date, &first.plan)
        );
    }
    let Some(Claimed {
        claim,
        work: Work::Shard {
            seeds,
            bundle: plays,
            ..
        },
    }) = f.claim().await
    else {
        panic!("the last try is queued")
    };
    assert_eq!(
        seeds.episodes,
        secret.stage(first.of.stage).day(first.of.date)
    );
    assert_eq!(plays, bundle());
    f.store.release(&claim, f.now).await.unwrap();

    // The last try fails too: the day ends all the same.
    assert_eq!(f.break_next().await, all[0].id);
    assert_eq!(released_at(&f).await, Some(f.now));
    f.later(86_400);
    assert!(f.claim().await.is_none());
    assert_eq!(f.store.evaluations_of(team.id).await.unwrap().len(), 3);
}

#[tokio::test]
async fn a_try_that_succeeds_releases_the_day() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("alpha").await;
    f.evaluate(submission.id, &small()).await;
    let broken = f.break_next().await;
    f.later(i64::from(RERUN_PAUSES_S[0]));
    let finished = f.finish_next().await;
    let finished = f.store.evaluation(finished).await.unwrap();
    assert_eq!(finished.rerun_of, Some(broken));
    assert_eq!(finished.released_at, Some(f.now));
    assert_eq!(f.board().await[0].evaluation, finished.id);
}

#[tokio::test]
async fn after_the_release_only_the_cuts_submission_plays_the_day_again() {
    let mut f = Fixture::new().await;
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
    let best_of_n = f.validate().await;
    assert!(best_of_n.active);
    let again = rerun(&f, stopped.id).await.unwrap();
    assert_eq!(
        (again.submission, again.of.date),
        (submission.id, stopped.of.date)
    );
    assert_eq!(again.rerun_of, Some(stopped.id));
    let twice = rerun(&f, stopped.id).await;
    assert!(
        matches!(twice, Err(StoreError::Conflict(_))),
        "one at a time"
    );
    // Broken after the release, it is the organiser's to have played again.
    assert_eq!(f.break_next().await, again.id);
    f.later(3600);
    assert!(f.claim().await.is_none());
    let again = rerun(&f, again.id).await.unwrap();
    assert_eq!(again.submission, submission.id);
    f.finish_next().await;
    let twice = rerun(&f, stopped.id).await;
    assert!(
        matches!(twice, Err(StoreError::Conflict(_))),
        "it has its score"
    );
    // The new one plays another day, on other episodes.
    f.later(86_400);
    let next = f.evaluate(best_of_n.id, &small()).await;
    assert_ne!(next.of.date, stopped.of.date);
}

#[tokio::test]
async fn a_closed_season_takes_nothing_more_and_stays_closed() {
    let mut site = Fixture::new().await;
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
        .create_ablation(Actor::Organiser, submission.id, &plan, site.now);
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
async fn a_season_keeps_the_name_it_is_given() {
    let site = Fixture::new().await;
    assert_eq!(site.store.season().await.unwrap().name, "Season 1");
    for _ in 0..2 {
        site.store
            .name_season(Actor::Organiser, "Spring 2026", site.now)
            .await
            .unwrap();
    }
    let events = site.store.events_after(0, 10).await.unwrap();
    assert_eq!(events.len(), 1, "its name before is no event: {events:?}");
    assert_eq!(
        site.reopen().await.season().await.unwrap().name,
        "Spring 2026"
    );
}

#[tokio::test]
async fn a_summary_is_kept_with_its_version() {
    let site = Fixture::new().await;
    let submission = site.ready_team("alpha").await;
    let run = site.evaluate(submission.id, &plan()).await.run;
    let stored = async |version| {
        let mut of_runs = site.store.episode_summaries(&[run], version).await.unwrap();
        of_runs.remove(&run)
    };
    let keep = |version, summary| {
        site.store
            .keep_episode_summary(run, version, summary, site.now)
    };
    assert_eq!(stored(1).await, None);
    keep(1, "{}").await.unwrap();
    assert_eq!(stored(1).await.as_deref(), Some("{}"));
    keep(2, "[]").await.unwrap();
    assert_eq!(stored(1).await, None);
}
