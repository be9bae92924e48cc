//! Where what waits stands, and when it will be over.

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

async fn places(f: &Fixture) -> Outlook {
    f.store.outlook(1, f.now).await.unwrap()
}

/// Does the next unit of work: a smoke run takes 20 s, a shard 10 s, a score 4 s. Was it a score?
async fn work(f: &mut Fixture) -> bool {
    let Claimed { claim, work } = f.claim().await.expect("work is queued");
    match work {
        Work::Smoke { .. } => {
            f.later(20);
            let outcome = SmokeOutcome::Valid {
                runtime: "native".into(),
                agent_name: "striker".into(),
                timing: Vec::new(),
                log: String::new(),
            };
            f.store.commit_smoke(&claim, outcome, f.now).await.unwrap();
        }
        Work::Shard { shard, .. } => {
            f.later(10);
            f.play(&claim, &shard, 0).await;
        }
        Work::Finalise { .. } => {
            f.later(4);
            f.finish(&claim, 1.0, "d").await;
            return true;
        }
        Work::Game { .. } => panic!("no game is queued"),
    }
    false
}

fn place(of: Option<&QueuePlace>) -> (u32, u32) {
    let of = of.expect("it waits");
    (of.place, of.of)
}

#[tokio::test]
async fn what_was_never_measured_has_a_place_and_no_time() {
    let f = Fixture::new().await;
    assert!(places(&f).await.submissions.is_empty());
    let [alpha, beta] = [f.team("Alpha").await, f.team("Beta").await];
    let uploads = [f.upload(&alpha).await, f.upload(&beta).await];
    let outlook = places(&f).await;
    for (upload, expected) in uploads.iter().zip([(1, 2), (2, 2)]) {
        let of = outlook.submissions.get(&upload.id);
        assert_eq!(place(of), expected);
        assert_eq!(of.unwrap().expected_at, None);
    }
    assert!(outlook.evaluations.is_empty());
}

#[tokio::test]
async fn a_time_is_what_such_work_took_of_late() {
    let mut f = Fixture::new().await;
    let [alpha, beta] = [f.team("Alpha").await, f.team("Beta").await];
    f.upload(&alpha).await;
    work(&mut f).await;
    // Two more: one after the other.
    let uploads = [f.upload(&alpha).await, f.upload(&beta).await];
    let outlook = places(&f).await;
    let expected = |of: &Submission| outlook.submissions[&of.id].expected_at.unwrap();
    // Beta's upload is served first: its team had nothing yet, or the queue's order decides; both end as it says.
    let mut ends = uploads.each_ref().map(expected);
    ends.sort_unstable();
    assert_eq!(ends, [20, 40].map(|s| f.now + SignedDuration::from_secs(s)));
    // Halfway through the next, half of it is left.
    let held = f.claim().await.unwrap();
    let Work::Smoke { submission, .. } = &held.work else {
        panic!("{held:?}")
    };
    f.later(10);
    let outlook = places(&f).await;
    let of = outlook.submissions[&submission.id];
    assert_eq!(of.expected_at, Some(f.now + SignedDuration::from_secs(10)));
    assert_eq!(of.place, 1);
    f.store.release(&held.claim, f.now).await.unwrap();
    for _ in uploads {
        work(&mut f).await;
    }

    // Evaluations: two shards of each, which nobody has timed yet.
    let stage = f.stage(&two_shards()).await;
    let day = f.store.start_day(Actor::Organiser, stage, f.now).await;
    let day = day.unwrap();
    let outlook = places(&f).await;
    assert!(
        day.iter()
            .all(|one| outlook.evaluations[&one.id].expected_at.is_none())
    );
    assert_eq!(outlook.evaluations.len(), 2);
    for _ in 0..6 {
        work(&mut f).await;
    }
    // The day after, all are known: 5 s per episode, 4 s for a score.
    f.later(24 * 3600);
    let gamma = f.team("Gamma").await;
    f.upload(&gamma).await;
    work(&mut f).await;
    let day = f.store.start_day(Actor::Organiser, stage, f.now).await;
    let day = day.unwrap();
    let outlook = places(&f).await;
    let mut ends: Vec<i64> = day
        .iter()
        .map(|one| outlook.evaluations[&one.id].expected_at.unwrap())
        .map(|at| at.duration_since(f.now).as_secs())
        .collect();
    ends.sort_unstable();
    // Three teams, six shards of 10 s taking turns, and each score when its last shard is done.
    assert_eq!(ends, [44, 58, 72]);
    let mut order: Vec<u32> = day
        .iter()
        .map(|one| place(outlook.evaluations.get(&one.id)).0)
        .collect();
    order.sort_unstable();
    assert_eq!(order, [1, 2, 3]);
    // Twice the slots, and it takes as long as the longest row.
    let with_two = f.store.outlook(2, f.now).await.unwrap();
    let last = with_two.evaluations.values().map(|of| of.expected_at).max();
    let last = last.unwrap().unwrap().duration_since(f.now).as_secs();
    assert!((34..=44).contains(&last), "{last}");
    // What is said is what comes.
    let began = f.now;
    let mut came = Vec::new();
    for _ in 0..9 {
        if work(&mut f).await {
            came.push(f.now.duration_since(began).as_secs());
        }
    }
    assert_eq!(came, ends);
}

#[tokio::test]
async fn a_held_queue_keeps_places_and_tells_no_time() {
    let mut f = Fixture::new().await;
    let alpha = f.team("Alpha").await;
    f.upload(&alpha).await;
    work(&mut f).await;
    let upload = f.upload(&alpha).await;
    let paused = f.store.pause_queue(Actor::Organiser, "new disks", f.now);
    paused.await.unwrap();
    let of = places(&f).await.submissions[&upload.id];
    assert_eq!((of.place, of.of, of.expected_at), (1, 1, None));
    // What was measured more than a week ago says nothing.
    f.store.resume_queue(Actor::Organiser, f.now).await.unwrap();
    f.later(8 * 24 * 3600);
    let of = places(&f).await.submissions[&upload.id];
    assert_eq!(of.expected_at, None);
}
