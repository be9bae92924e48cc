//! Failing writes, as on a full disk, the recovery afterwards, and the health that the store reports.

use crate::fixture::*;
use faceoff_store::*;
use sqlx::Executor;

/// Makes the creation of a team named "Full" fail as SQLite does when the disk is full: the transaction is rolled back.
const ROLLS_BACK: &str = "CREATE TRIGGER full BEFORE INSERT ON teams WHEN NEW.name = 'Full'
                          BEGIN SELECT RAISE(ROLLBACK, 'the disk is full'); END";

#[tokio::test]
async fn rolled_back_write_does_not_block_the_writer() {
    let f = TestStore::new().await;
    let mut connection = f.connection().await;
    connection.execute(ROLLS_BACK).await.unwrap();
    for attempt in 0..3 {
        let name = "Full".parse().unwrap();
        let failed = f
            .store
            .create_team(
                Actor::Operator,
                &name,
                [attempt; 32],
                Requester::default(),
                f.now,
            )
            .await;
        assert!(failed.is_err());
        f.create_team(&format!("After {attempt}")).await;
    }
    assert_eq!(f.store.teams().await.unwrap().len(), 3);
    assert!(f.store.health(f.now).await.database_writable);
}

#[tokio::test]
async fn job_on_full_disk_pauses_without_losing_an_attempt() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    f.upload(&team).await;
    // More often than a job is attempted that fails, or whose workers are killed.
    for _ in 0..60 {
        let claim = f.claim().await.expect("the job's pause is over").claim;
        f.store.release_disk_full(&claim, f.now).await.unwrap();
        assert!(f.claim().await.is_none(), "the job pauses");
        f.advance_clock_s(10);
    }
    f.validate().await;
}

#[tokio::test]
async fn health_reports_job_that_repeatedly_lacks_space() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    f.upload(&team).await;
    let out_of_space = async |f: &TestStore| match f.store.health(f.now).await.queue {
        QueueHealth::Running { out_of_space, .. } => out_of_space,
        other => panic!("expected a running queue, found {other:?}"),
    };
    for expected in [0, 0, 1, 1] {
        let claim = f.claim().await.expect("the job's pause is over").claim;
        f.store.release_disk_full(&claim, f.now).await.unwrap();
        assert_eq!(out_of_space(&f).await, expected);
        f.advance_clock_s(10);
    }
    // A shutdown is no sign of missing space.
    let claim = f.claim().await.expect("the job's pause is over").claim;
    f.store.release(&claim, f.now).await.unwrap();
    assert_eq!(out_of_space(&f).await, 1);
    f.validate().await;
    assert_eq!(out_of_space(&f).await, 0);
}

#[tokio::test]
async fn renewed_leases_stay_with_their_holder() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    f.upload(&team).await;
    let claim = f.claim().await.unwrap().claim;
    f.advance_clock_s(10 * i64::from(LEASE_S));
    f.store.renew_all_leases(LEASE_S, f.now).await.unwrap();
    assert!(f.claim().await.is_none(), "the job is still leased");
    assert!(f.store.heartbeat(&claim, 0, LEASE_S, f.now).await.unwrap());
}

#[tokio::test]
async fn health_reports_stuck_queue() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    f.upload(&team).await;
    let queue_health = async |f: &TestStore| f.store.health(f.now).await.queue;
    let just_queued = QueueHealth::Running {
        running: 0,
        waiting: 1,
        out_of_space: 0,
    };
    assert_eq!(queue_health(&f).await, just_queued);
    let queued_at = f.now;
    f.advance_clock_s(61);
    let stuck = QueueHealth::Stuck {
        waiting: 1,
        since: queued_at,
    };
    assert_eq!(queue_health(&f).await, stuck);

    f.store.record_poll(f.now);
    assert_eq!(
        queue_health(&f).await,
        just_queued,
        "a worker polls for jobs"
    );
    f.advance_clock_s(61);
    assert_eq!(queue_health(&f).await, stuck);
    let claimed = f.claim().await.unwrap();
    let running = QueueHealth::Running {
        running: 1,
        waiting: 0,
        out_of_space: 0,
    };
    assert_eq!(queue_health(&f).await, running);
    drop(claimed);

    let no_space = FreeSpace::new(vec![f.folder.path().to_owned()], u64::MAX);
    let store = f.store.clone().with_free_space(no_space);
    let paused = QueueHealth::DiskFull { waiting: 0 };
    assert_eq!(store.health(f.now).await.queue, paused);
}

#[tokio::test]
async fn health_reports_unwritable_database() {
    let mut f = TestStore::new().await;
    assert!(f.store.health(f.now).await.database_writable);
    f.store.close().await;
    f.advance_clock_s(1);
    let health = f.store.health(f.now).await;
    assert!(!health.database_writable);
    assert_eq!(health.queue, QueueHealth::Unknown);
}
