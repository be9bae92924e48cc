use crate::fixture::*;
use faceoff_store::*;
use jiff::civil::date;

/// Plays the evaluation that comes next to its end.
async fn finish(site: &Fixture) {
    loop {
        let Claimed { claim, work } = site.claim().await.unwrap();
        match work {
            Work::Shard { shard, .. } => {
                site.play(&claim, &shard, 0).await;
            }
            Work::Finalise { .. } => {
                site.finish(&claim, 1.0, "d").await;
                return;
            }
            Work::Smoke { .. } => panic!("expected a shard or a finalisation"),
        }
    }
}

#[tokio::test]
async fn a_days_seed_stays_until_nothing_of_the_day_is_under_way() {
    let mut site = Fixture::new().await;
    let day = date(2026, 3, 1);
    let (alpha, beta) = (
        site.ready_team("alpha").await,
        site.ready_team("beta").await,
    );
    let seeds = |site: &Fixture| {
        let (store, now) = (site.store.clone(), site.now);
        async move { store.day_seeds([day].into(), now).await.unwrap()[&day] }
    };
    assert_eq!(seeds(&site).await, DaySeed::Releasable);
    for submission in [&alpha, &beta] {
        site.evaluate(submission.id, &plan()).await;
    }
    finish(&site).await;
    let secret = DaySeed::Secret { under_way: 1 };
    assert_eq!(seeds(&site).await, secret);
    assert_eq!(
        site.store
            .release_day(Actor::Organiser, day, site.now)
            .await
            .unwrap(),
        secret
    );
    site.later(86_400);
    assert_eq!(seeds(&site).await, secret, "a run that outlasts its day");
    finish(&site).await;
    assert_eq!(seeds(&site).await, DaySeed::Public, "the day is over");
    assert_eq!(site.store.days().await.unwrap(), [(day, 2)]);
}

#[tokio::test]
async fn after_the_release_only_what_was_uploaded_before_plays_the_day() {
    let mut site = Fixture::new().await;
    let day = date(2026, 3, 1);
    let (alpha, early) = (
        site.ready_team("alpha").await,
        site.ready_team("early").await,
    );
    let slow = site.team("slow").await;
    site.later(60);
    site.evaluate(alpha.id, &plan()).await;
    finish(&site).await;
    site.later(60);
    assert_eq!(
        site.store
            .release_day(Actor::Organiser, day, site.now)
            .await
            .unwrap(),
        DaySeed::Public
    );
    let released_at = site.now;
    site.later(60);
    // Seen by everybody from now on; a later request does not move the instant.
    site.store
        .release_day(Actor::Organiser, day, site.now)
        .await
        .unwrap();
    site.upload(&slow).await;
    let late = site.validate().await;
    let refused = site
        .store
        .create_evaluation(Actor::Organiser, late.id, &plan(), site.now)
        .await
        .unwrap_err();
    let StoreError::DayReleased {
        day: of,
        released_at: at,
        next,
    } = refused
    else {
        panic!("{refused}")
    };
    assert_eq!((of, at, next), (day, released_at, date(2026, 3, 2)));
    // Nothing of the refused one stays behind.
    assert_eq!(site.store.evaluations_of(slow.id).await.unwrap(), []);
    assert!(site.claim().await.is_none());

    // Another upload of the early team is passed over for the one before the release.
    site.store
        .create_submission(Actor::Organiser, early.team, bundle(), site.now)
        .await
        .unwrap();
    site.validate().await;
    let started = site
        .store
        .start_day(Actor::Organiser, &plan(), site.now)
        .await
        .unwrap();
    assert_eq!(started.len(), 1);
    assert_eq!(started[0].submission, early.id);
    assert_eq!(
        site.store.day_seeds([day].into(), site.now).await.unwrap()[&day],
        DaySeed::Public,
        "what is known stays known"
    );
    let again = site
        .store
        .create_evaluation(Actor::Organiser, alpha.id, &plan(), site.now)
        .await
        .unwrap_err();
    assert!(
        matches!(again, StoreError::AlreadyEvaluated { .. }),
        "{again}"
    );

    site.later(86_400);
    site.evaluate(late.id, &plan()).await;
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
    let upload =
        site.store
            .create_submission(Actor::Organiser, submission.team, bundle(), site.now);
    closed(upload.await.unwrap_err());
    let plan = plan();
    let evaluation = site
        .store
        .create_evaluation(Actor::Organiser, submission.id, &plan, site.now);
    closed(evaluation.await.unwrap_err());
    closed(
        site.store
            .start_day(Actor::Organiser, &plan, site.now)
            .await
            .unwrap_err(),
    );
    let ablation = site
        .store
        .create_ablation(Actor::Organiser, submission.id, &plan, site.now);
    closed(ablation.await.unwrap_err());
    assert_eq!(
        site.store
            .start_scheduled_day(&plan, site.now)
            .await
            .unwrap(),
        None
    );
    let today = date(2026, 3, 1);
    assert_eq!(
        site.store
            .day_seeds([today].into(), site.now)
            .await
            .unwrap()[&today],
        DaySeed::Public
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
