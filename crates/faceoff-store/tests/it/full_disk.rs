//! Writes that fail, as they do on a full disk, and what must be as before once they work again.

use crate::fixture::*;
use faceoff_store::*;
use sqlx::Executor;

/// As SQLite does when the disk is full: the statement fails, and the transaction is rolled back.
const ROLLS_BACK: &str = "CREATE TRIGGER full BEFORE INSERT ON teams WHEN NEW.name = 'Full'
                          BEGIN SELECT RAISE(ROLLBACK, 'the disk is full'); END";

#[tokio::test]
async fn a_write_that_sqlite_rolled_back_does_not_wedge_the_writer() {
    let f = Fixture::new().await;
    let mut past_the_store = f.connection().await;
    past_the_store.execute(ROLLS_BACK).await.unwrap();
    for attempt in 0..3 {
        let name = "Full".parse().unwrap();
        let failed = f
            .store
            .create_team(Actor::Organiser, &name, [attempt; 32], f.now)
            .await;
        assert!(failed.is_err());
        f.team(&format!("After {attempt}")).await;
    }
    assert_eq!(f.store.teams().await.unwrap().len(), 3);
    assert!(f.store.health(f.now).await.database_writable);
}

#[tokio::test]
async fn a_unit_that_met_a_full_disk_rests_and_has_lost_no_try() {
    let mut f = Fixture::new().await;
    let team = f.team("Alpha").await;
    f.upload(&team).await;
    // more often than a failing unit, or one whose workers die, is tried
    for _ in 0..60 {
        let claim = f.claim().await.expect("it has rested").claim;
        f.store.release_full(&claim, f.now).await.unwrap();
        assert!(f.claim().await.is_none(), "it rests");
        f.later(10);
    }
    f.validate().await;
}

#[tokio::test]
async fn health_tells_of_a_unit_that_never_finds_room_until_it_does() {
    let mut f = Fixture::new().await;
    let team = f.team("Alpha").await;
    f.upload(&team).await;
    let without_room = async |f: &Fixture| match f.store.health(f.now).await.queue {
        QueueHealth::Moving { without_room, .. } => without_room,
        other => panic!("{other:?}"),
    };
    for told in [0, 0, 1, 1] {
        let claim = f.claim().await.expect("it has rested").claim;
        f.store.release_full(&claim, f.now).await.unwrap();
        assert_eq!(without_room(&f).await, told);
        f.later(10);
    }
    // A shutdown says nothing of room.
    let claim = f.claim().await.expect("it has rested").claim;
    f.store.release(&claim, f.now).await.unwrap();
    assert_eq!(without_room(&f).await, 1);
    f.validate().await;
    assert_eq!(without_room(&f).await, 0);
}

#[tokio::test]
async fn a_lease_that_could_not_be_renewed_is_its_holders_after_the_pause() {
    let mut f = Fixture::new().await;
    let team = f.team("Alpha").await;
    f.upload(&team).await;
    let held = f.claim().await.unwrap().claim;
    f.later(10 * i64::from(LEASE_S));
    f.store.renew_all_leases(LEASE_S, f.now).await.unwrap();
    assert!(f.claim().await.is_none(), "it is taken");
    assert!(f.store.heartbeat(&held, 0, LEASE_S, f.now).await.unwrap());
}

#[tokio::test]
async fn health_tells_whether_the_queue_moves() {
    let mut f = Fixture::new().await;
    let team = f.team("Alpha").await;
    f.upload(&team).await;
    let queue = async |f: &Fixture| f.store.health(f.now).await.queue;
    let just_queued = QueueHealth::Moving {
        running: 0,
        waiting: 1,
        without_room: 0,
    };
    assert_eq!(queue(&f).await, just_queued);
    let since = f.now;
    f.later(61);
    let nobody_came = QueueHealth::Stuck { waiting: 1, since };
    assert_eq!(queue(&f).await, nobody_came);

    f.store.looked_for_work(f.now);
    assert_eq!(queue(&f).await, just_queued, "somebody looks for work");
    f.later(61);
    assert_eq!(queue(&f).await, nobody_came);
    let claimed = f.claim().await.unwrap();
    let running = QueueHealth::Moving {
        running: 1,
        waiting: 0,
        without_room: 0,
    };
    assert_eq!(queue(&f).await, running);
    drop(claimed);

    let no_room = Room::new(vec![f.folder.path().to_owned()], u64::MAX);
    let store = f.store.clone().with_room(no_room);
    let paused = QueueHealth::Paused { waiting: 0 };
    assert_eq!(store.health(f.now).await.queue, paused);
}

#[tokio::test]
async fn health_tells_that_the_database_cannot_be_written() {
    let mut f = Fixture::new().await;
    assert!(f.store.health(f.now).await.database_writable);
    f.store.close().await;
    f.later(1);
    let health = f.store.health(f.now).await;
    assert!(!health.database_writable);
    assert_eq!(health.queue, QueueHealth::Unknown);
}
