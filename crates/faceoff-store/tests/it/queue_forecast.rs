//! The queue forecast: position and expected end of queued jobs.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::SignedDuration;

/// Two shards of two episodes each.
fn two_shards() -> RunPlan {
    RunPlan {
        tasks: vec![Task::Hit],
        ..plan()
    }
}

async fn forecast(f: &TestStore) -> QueueForecast {
    f.store.queue_forecast(1, f.now).await.unwrap()
}

/// Runs the next job: a validation run takes 20 s, a shard 10 s, scoring 4 s. True for scoring.
async fn run_next(f: &mut TestStore) -> bool {
    let ClaimedJob { claim, job } = f.claim().await.expect("a job is queued");
    match job {
        Job::Validation { .. } => {
            f.later(20);
            let outcome = ValidationOutcome::Valid {
                runtime: "native".into(),
                agent_name: "striker".into(),
                timing: Vec::new(),
                log: String::new(),
            };
            f.store
                .commit_validation(&claim, outcome, f.now)
                .await
                .unwrap();
        }
        Job::Shard { shard, .. } => {
            f.later(10);
            f.commit_shard(&claim, &shard, 0).await;
        }
        Job::Scoring { .. } => {
            f.later(4);
            f.finish(&claim, 1.0, "d").await;
            return true;
        }
        Job::Game { .. } => panic!("no game is queued"),
    }
    false
}

fn position(found: Option<&QueuePosition>) -> (u32, u32) {
    let found = found.expect("it is queued");
    (found.position, found.total)
}

#[tokio::test]
async fn unmeasured_job_has_position_without_time() {
    let f = TestStore::new().await;
    assert!(forecast(&f).await.submissions.is_empty());
    let [alpha, beta] = [f.team("Alpha").await, f.team("Beta").await];
    let uploads = [f.upload(&alpha).await, f.upload(&beta).await];
    let estimate = forecast(&f).await;
    for (upload, expected) in uploads.iter().zip([(1, 2), (2, 2)]) {
        let found = estimate.submissions.get(&upload.id);
        assert_eq!(position(found), expected);
        assert_eq!(found.unwrap().expected_at, None);
    }
    assert!(estimate.evaluations.is_empty());
}

#[tokio::test]
async fn forecast_uses_recent_durations() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = [f.team("Alpha").await, f.team("Beta").await];
    f.upload(&alpha).await;
    run_next(&mut f).await;
    // Two more uploads, one after the other.
    let uploads = [f.upload(&alpha).await, f.upload(&beta).await];
    let estimate = forecast(&f).await;
    let expected = |upload: &Submission| estimate.submissions[&upload.id].expected_at.unwrap();
    // Either upload may be first; both end at the forecast times.
    let mut ends = uploads.each_ref().map(expected);
    ends.sort_unstable();
    assert_eq!(ends, [20, 40].map(|s| f.now + SignedDuration::from_secs(s)));
    // Halfway through the next validation run, half of its time is left.
    let held = f.claim().await.unwrap();
    let Job::Validation { submission, .. } = &held.job else {
        panic!("{held:?}")
    };
    f.later(10);
    let estimate = forecast(&f).await;
    let found = estimate.submissions[&submission.id];
    assert_eq!(
        found.expected_at,
        Some(f.now + SignedDuration::from_secs(10))
    );
    assert_eq!(found.position, 1);
    f.store.release(&held.claim, f.now).await.unwrap();
    for _ in uploads {
        run_next(&mut f).await;
    }

    // Evaluations: two shards each, without measured durations.
    let stage = f.stage(&two_shards()).await;
    let day = f.store.start_day(Actor::Organiser, stage, f.now).await;
    let day = day.unwrap();
    let estimate = forecast(&f).await;
    assert!(
        day.iter()
            .all(|one| estimate.evaluations[&one.id].expected_at.is_none())
    );
    assert_eq!(estimate.evaluations.len(), 2);
    for _ in 0..6 {
        run_next(&mut f).await;
    }
    // On the next day, all durations are known: 5 s per episode, 4 s for scoring.
    f.later(24 * 3600);
    let gamma = f.team("Gamma").await;
    f.upload(&gamma).await;
    run_next(&mut f).await;
    let day = f.store.start_day(Actor::Organiser, stage, f.now).await;
    let day = day.unwrap();
    let estimate = forecast(&f).await;
    let mut ends: Vec<i64> = day
        .iter()
        .map(|one| estimate.evaluations[&one.id].expected_at.unwrap())
        .map(|at| at.duration_since(f.now).as_secs())
        .collect();
    ends.sort_unstable();
    // Three teams, six alternating shards of 10 s, and each scoring after the last shard.
    assert_eq!(ends, [44, 58, 72]);
    let mut order: Vec<u32> = day
        .iter()
        .map(|one| position(estimate.evaluations.get(&one.id)).0)
        .collect();
    order.sort_unstable();
    assert_eq!(order, [1, 2, 3]);
    // With two slots it takes as long as the longest sequence.
    let with_two = f.store.queue_forecast(2, f.now).await.unwrap();
    let last = with_two
        .evaluations
        .values()
        .map(|one| one.expected_at)
        .max();
    let last = last.unwrap().unwrap().duration_since(f.now).as_secs();
    assert!((34..=44).contains(&last), "{last}");
    // The forecast is what happens.
    let began = f.now;
    let mut actual = Vec::new();
    for _ in 0..9 {
        if run_next(&mut f).await {
            actual.push(f.now.duration_since(began).as_secs());
        }
    }
    assert_eq!(actual, ends);
}

#[tokio::test]
async fn paused_queue_has_positions_without_times() {
    let mut f = TestStore::new().await;
    let alpha = f.team("Alpha").await;
    f.upload(&alpha).await;
    run_next(&mut f).await;
    let upload = f.upload(&alpha).await;
    let paused = f.store.pause_queue(Actor::Organiser, "new disks", f.now);
    paused.await.unwrap();
    let found = forecast(&f).await.submissions[&upload.id];
    assert_eq!(
        (found.position, found.total, found.expected_at),
        (1, 1, None)
    );
    // Durations measured more than a week ago are ignored.
    f.store.resume_queue(Actor::Organiser, f.now).await.unwrap();
    f.later(8 * 24 * 3600);
    let found = forecast(&f).await.submissions[&upload.id];
    assert_eq!(found.expected_at, None);
}
