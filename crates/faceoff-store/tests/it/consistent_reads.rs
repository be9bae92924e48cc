//! *Groups* of reads, all of which see the same state of the database although others write meanwhile, as a page needs them.

use crate::fixture::*;

async fn count_submissions(store: &faceoff_store::Store) -> usize {
    store.active_submissions().await.unwrap().len()
}

#[tokio::test]
async fn reads_of_a_group_see_one_state() {
    let f = TestStore::new().await;
    let other = TestStore::new().await;
    let store = f.store.clone();
    let _f = store
        .read_consistently(async {
            assert_eq!(count_submissions(&store).await, 0);
            // Another task writes, because this setup reads what it has written.
            let written = tokio::spawn(async move {
                f.valid_submission_of("Alpha").await;
                f
            });
            let f = written.await.unwrap();
            assert_eq!(
                count_submissions(&store).await,
                0,
                "the state of the first read"
            );
            let other_task = store.clone();
            let seen = tokio::spawn(async move { count_submissions(&other_task).await });
            assert_eq!(seen.await.unwrap(), 1, "another task reads for itself");
            other.valid_submission_of("Beta").await;
            assert_eq!(count_submissions(&other.store).await, 1, "another database");
            f
        })
        .await;
    assert_eq!(count_submissions(&store).await, 1);
    let again = store.read_consistently(count_submissions(&store));
    assert_eq!(again.await, 1);
}

/// There are fewer connections than groups; each group waits, between two reads, for another task that reads.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn more_groups_than_connections_all_finish() {
    let f = TestStore::new().await;
    let mut groups = tokio::task::JoinSet::new();
    for _ in 0..60 {
        let store = f.store.clone();
        groups.spawn(async move {
            let reads = async {
                let before = count_submissions(&store).await;
                let other_task = store.clone();
                let seen = tokio::spawn(async move { count_submissions(&other_task).await });
                (before, seen.await.unwrap(), count_submissions(&store).await)
            };
            store.read_consistently(reads).await
        });
    }
    let results = groups.join_all().await;
    assert_eq!(results, vec![(0, 0, 0); 60]);
}
