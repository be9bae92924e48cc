//! The opening of a store, its behaviour when values in its database are damaged, and the competition that a season is bound to.

use crate::fixture::*;
use faceoff_airhockey::{HIT, IDEAL};
use faceoff_store::*;
use faceoff_types::{ActionSpace, Competition, Millionths, RecordingColumns, TaskInfo};
use sqlx::Connection;

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn concurrent_openers_agree_on_one_season() {
    let folder = tempfile::tempdir().unwrap();
    let openers: Vec<_> = (0..8)
        .map(|_| {
            let path = folder.path().to_owned();
            tokio::spawn(async move { Store::open(&path).await.unwrap().season().await.unwrap() })
        })
        .collect();
    let mut commitments = Vec::new();
    for opener in openers {
        let season = opener.await.unwrap();
        assert_eq!(
            season.commitment,
            blake3::hash(season.secret.as_bytes()).to_string(),
            "the commitment is the hash of the secret"
        );
        commitments.push(season.commitment);
    }
    commitments.dedup();
    assert_eq!(commitments.len(), 1);
    let other_season = TestStore::new().await.store.season().await.unwrap();
    assert_ne!(
        other_season.commitment, commitments[0],
        "secrets are random"
    );
}

#[tokio::test]
async fn reopened_store_has_all_data() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let evaluation = f.evaluate(submission.id, &six_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard_with_faults(&claim, &shard, 1).await;
    let (claim_before, ..) = f.claim_shard().await;
    let evaluation_before = f.store.evaluation(evaluation.id).await.unwrap();
    let season = f.store.season().await.unwrap();
    f.store.close().await;
    let reopened = f.reopen().await;
    assert_eq!(
        reopened.evaluation(evaluation.id).await.unwrap(),
        evaluation_before
    );
    assert_eq!(
        reopened.submission(submission.id).await.unwrap(),
        submission
    );
    assert_eq!(reopened.season().await.unwrap().secret, season.secret);
    assert!(
        reopened
            .heartbeat(&claim_before, 1, LEASE_S, f.now)
            .await
            .unwrap(),
        "leases stay valid in another process"
    );
}

/// Damages the database with a statement of another connection.
async fn damage(f: &TestStore, sql: &'static str) {
    let mut connection = f.connection().await;
    let without_checks = "PRAGMA foreign_keys = OFF";
    sqlx::raw_sql(without_checks)
        .execute(&mut connection)
        .await
        .unwrap();
    sqlx::raw_sql(sql).execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
}

#[tokio::test]
async fn damaged_values_are_reported_without_panic() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let evaluation = f.evaluate(submission.id, &six_shard_plan()).await;
    let damages = [
        "UPDATE evaluations SET day = 'someday'",
        "UPDATE runs SET profile = '?'",
        "UPDATE runs SET tasks = '[\"hit\"'",
        "UPDATE evaluations SET created_at = 9223372036854775807",
        "UPDATE runs SET max_faults = 5000000000",
    ];
    for sql in damages {
        damage(&f, sql).await;
        let error = f.store.evaluation(evaluation.id).await.unwrap_err();
        assert!(matches!(&error, StoreError::Damaged(_)), "{sql}: {error:?}");
        let error = f.store.evaluations_of(submission.team).await.unwrap_err();
        assert!(matches!(&error, StoreError::Damaged(_)), "{sql}: {error:?}");
    }
    damage(&f, "UPDATE teams SET name = '<b>'").await;
    assert!(matches!(f.store.teams().await, Err(StoreError::Damaged(_))));
    damage(&f, "PRAGMA foreign_keys = OFF; UPDATE teams SET id = 'x'").await;
    assert!(matches!(f.store.teams().await, Err(StoreError::Damaged(_))));
}

#[tokio::test]
async fn damaged_job_does_not_block_others() {
    let f = TestStore::new().await;
    let [alpha, beta] = f.two_valid_submissions().await;
    let undamaged = f.evaluate(beta.id, &six_shard_plan()).await;
    damage(
        &f,
        "UPDATE runs SET profile = '?' WHERE id = (SELECT run_id FROM contestants c
             JOIN submissions s ON s.id = c.submission_id JOIN teams t ON t.id = s.team_id
             WHERE t.name = 'Alpha')",
    )
    .await;
    let (_, run, _) = f.claim_shard().await;
    assert_eq!(run.id, undamaged.run);
    damage(&f, "UPDATE runs SET profile = 'ideal' WHERE profile = '?'").await;
    let evaluations = f.store.evaluations_of(alpha.team).await.unwrap();
    let state = &evaluations[0].state;
    assert!(
        matches!(state, EvaluationState::PlatformFailed { .. }),
        "{state:?}"
    );
    assert_eq!(evaluations.len(), 1, "the evaluation is not rerun");
}

#[tokio::test]
async fn rows_without_data_of_their_state_are_refused() {
    let f = TestStore::new().await;
    f.start_evaluation(&six_shard_plan()).await;
    let mut connection = f.connection().await;
    for sql in [
        "UPDATE evaluations SET state = 'finished', finished_at = 1, dataset = 'd'",
        "UPDATE evaluations SET state = 'platform_failed', finished_at = 1",
        "UPDATE submissions SET state = 'invalid'",
        "UPDATE shards SET committed_at = 1, recording = 'r'",
        "UPDATE jobs SET state = 'leased'",
        "UPDATE tokens SET hash = x'00'",
        "UPDATE tokens SET owner = 'person'",
        "UPDATE tokens SET kind = 'session'",
        "UPDATE teams SET disqualified_at = 1",
    ] {
        let error = sqlx::raw_sql(sql)
            .execute(&mut connection)
            .await
            .unwrap_err();
        assert!(
            error.to_string().contains("CHECK constraint failed"),
            "{sql}: {error}"
        );
    }
}

#[tokio::test]
async fn season_belongs_to_one_competition() {
    let f = TestStore::new().await;
    let competition = |id: &str, max_steps| Competition {
        id: id.to_owned(),
        title: "A competition".to_owned(),
        short_title: "A competition".to_owned(),
        subject: "a subject".to_owned(),
        summary: "A summary.".to_owned(),
        has_replays: false,
        has_games: false,
        rulesets: Vec::new(),
        tasks: vec![TaskInfo {
            task: HIT,
            title: "A task".to_owned(),
            aim: "An aim.".to_owned(),
            achievement: "success".to_owned(),
            drawing: String::new(),
            weight: Millionths::new(1_000_000),
            max_steps,
            control_step_s: 0.1,
        }],
        ends: Vec::new(),
        violations: Vec::new(),
        actions: ActionSpace {
            agents_choose_layout: false,
            layouts: Vec::new(),
        },
        recording: RecordingColumns::default(),
        tiers: None,
        profiles: Vec::new(),
        ideal_profile: IDEAL,
        counting_profile: IDEAL,
        magnitudes: Vec::new(),
    };
    let stored = async || -> (Option<String>, Option<String>) {
        sqlx::query_as("SELECT competition_id, competition_hash FROM season")
            .fetch_one(&mut f.connection().await)
            .await
            .unwrap()
    };
    assert_eq!(stored().await, (None, None));
    for max_steps in [500, 500, 400] {
        let first = competition("first", max_steps);
        f.store.bind_competition(&first, f.now).await.unwrap();
        assert_eq!(
            stored().await,
            (Some("first".to_owned()), Some(first.hash()))
        );
    }
    let other = f
        .store
        .bind_competition(&competition("other", 500), f.now)
        .await;
    assert_conflict(
        other,
        &["belongs to the competition \"first\"", "\"other\""],
    );
}
