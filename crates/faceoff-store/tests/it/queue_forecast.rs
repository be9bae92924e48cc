//! The queue forecast: positions and expected ends of queued validation runs and evaluations, from the measured durations of
//! earlier jobs. An evaluation consists of its shards (groups of episodes that are run together) and its scoring.

use crate::fixture::*;
use faceoff_store::*;
use jiff::SignedDuration;

/// The forecast for one slot (a worker runs one job at a time in each slot).
async fn forecast(f: &TestStore) -> QueueForecast {
    f.store.queue_forecast(1, f.now).await.unwrap()
}

/// Runs the next job: a validation run takes 20 s, a shard 10 s, scoring 4 s. True if the job was a scoring.
async fn run_next_job(f: &mut TestStore) -> bool {
    let ClaimedJob { claim, job } = f.claim().await.expect("a job is queued");
    match job {
        Job::Validation { .. } => {
            f.advance_clock_s(20);
            let outcome = valid_outcome("native", "striker", "");
            f.store
                .commit_validation(&claim, outcome, f.now)
                .await
                .unwrap();
        }
        Job::Shard { shard, .. } => {
            f.advance_clock_s(10);
            f.commit_shard(&claim, &shard).await;
        }
        Job::Scoring { .. } => {
            f.advance_clock_s(4);
            f.finish_scoring(&claim, 1.0, DATASET_KEY).await;
            return true;
        }
        Job::Game { .. } => panic!("no game is queued"),
    }
    false
}

/// Position in the queue, and length of the queue.
fn position_and_total(position: Option<&QueuePosition>) -> (u32, u32) {
    let position = position.expect("the job is queued");
    (position.position, position.total)
}

#[tokio::test]
async fn unmeasured_job_has_position_without_time() {
    let f = TestStore::new().await;
    assert!(forecast(&f).await.submissions.is_empty());
    let [alpha, beta] = [f.create_team("Alpha").await, f.create_team("Beta").await];
    let uploads = [f.upload(&alpha).await, f.upload(&beta).await];
    let estimate = forecast(&f).await;
    for (upload, expected) in uploads.iter().zip([(1, 2), (2, 2)]) {
        let position = estimate.submissions.get(&upload.id);
        assert_eq!(position_and_total(position), expected);
        assert_eq!(position.unwrap().expected_at, None);
    }
    assert!(estimate.evaluations.is_empty());
}

#[tokio::test]
async fn forecast_uses_recent_durations() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = [f.create_team("Alpha").await, f.create_team("Beta").await];
    f.upload(&alpha).await;
    run_next_job(&mut f).await;
    // Two more uploads, one after the other.
    let uploads = [f.upload(&alpha).await, f.upload(&beta).await];
    let estimate = forecast(&f).await;
    let expected = |upload: &Submission| estimate.submissions[&upload.id].expected_at.unwrap();
    // Either validation run may be the first: 20 s each.
    let mut ends = uploads.each_ref().map(expected);
    ends.sort_unstable();
    assert_eq!(
        ends,
        [20, 40].map(|seconds| f.now + SignedDuration::from_secs(seconds))
    );
    // Halfway through the next validation run, half of its time is left.
    let claimed = f.claim().await.unwrap();
    let Job::Validation { submission, .. } = &claimed.job else {
        panic!("expected a validation run, claimed {claimed:?}")
    };
    f.advance_clock_s(10);
    let estimate = forecast(&f).await;
    let position = estimate.submissions[&submission.id];
    assert_eq!(
        position.expected_at,
        Some(f.now + SignedDuration::from_secs(10))
    );
    assert_eq!(position.position, 1);
    f.store.release(&claimed.claim, f.now).await.unwrap();
    for _ in uploads {
        run_next_job(&mut f).await;
    }

    // Evaluations: two shards each, without measured durations.
    let stage = f.configure_stage(&two_shard_plan()).await;
    let day = f.store.start_day(Actor::Operator, stage, f.now).await;
    let day = day.unwrap();
    let estimate = forecast(&f).await;
    assert!(
        day.iter()
            .all(|evaluation| estimate.evaluations[&evaluation.id].expected_at.is_none())
    );
    assert_eq!(estimate.evaluations.len(), 2);
    // Two evaluations, each with two shards and a scoring.
    for _ in 0..6 {
        run_next_job(&mut f).await;
    }
    // On the next day, all durations are known: 5 s per episode, 4 s for scoring.
    f.advance_clock_s(24 * 3600);
    let gamma = f.create_team("Gamma").await;
    f.upload(&gamma).await;
    run_next_job(&mut f).await;
    let day = f.store.start_day(Actor::Operator, stage, f.now).await;
    let day = day.unwrap();
    let estimate = forecast(&f).await;
    let mut ends_s: Vec<i64> = day
        .iter()
        .map(|evaluation| estimate.evaluations[&evaluation.id].expected_at.unwrap())
        .map(|expected_at| expected_at.duration_since(f.now).as_secs())
        .collect();
    ends_s.sort_unstable();
    // The shards of three teams alternate. The first evaluation ends after four shards (10 s each) and its scoring (4 s), and
    // each other one after one shard and one scoring more.
    assert_eq!(ends_s, [44, 58, 72]);
    let mut positions: Vec<u32> = day
        .iter()
        .map(|evaluation| position_and_total(estimate.evaluations.get(&evaluation.id)).0)
        .collect();
    positions.sort_unstable();
    assert_eq!(positions, [1, 2, 3]);
    // With two slots the last evaluation ends after about half of the time.
    let with_two_slots = f.store.queue_forecast(2, f.now).await.unwrap();
    let last_end = with_two_slots
        .evaluations
        .values()
        .map(|position| position.expected_at)
        .max();
    let last_end_s = last_end.unwrap().unwrap().duration_since(f.now).as_secs();
    assert!((34..=44).contains(&last_end_s), "{last_end_s}");
    // The jobs (six shards and three scorings) end at the forecast times.
    let started_at = f.now;
    let mut actual_ends_s = Vec::new();
    for _ in 0..9 {
        if run_next_job(&mut f).await {
            actual_ends_s.push(f.now.duration_since(started_at).as_secs());
        }
    }
    assert_eq!(actual_ends_s, ends_s);
}

#[tokio::test]
async fn paused_queue_has_positions_without_times() {
    let mut f = TestStore::new().await;
    let alpha = f.create_team("Alpha").await;
    f.upload(&alpha).await;
    run_next_job(&mut f).await;
    let upload = f.upload(&alpha).await;
    let paused = f.store.pause_queue(Actor::Operator, "new disks", f.now);
    paused.await.unwrap();
    let position = forecast(&f).await.submissions[&upload.id];
    assert_eq!(
        (position.position, position.total, position.expected_at),
        (1, 1, None)
    );
    // Durations measured more than a week ago are ignored.
    f.store.resume_queue(Actor::Operator, f.now).await.unwrap();
    f.advance_clock_s(8 * 24 * 3600);
    let position = forecast(&f).await.submissions[&upload.id];
    assert_eq!(position.expected_at, None);
}
