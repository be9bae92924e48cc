//! Storage and removal of bundles (the archives that teams upload), and the quota of uploads.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::{SignedDuration, Timestamp};

/// Stores a bundle under a key with this name, and submits it with this size.
async fn upload_stored(f: &TestStore, team: &Team, name: &str, bytes: u64) -> Submission {
    upload_with_content(f, team, name, bytes, name).await
}

async fn upload_with_content(
    f: &TestStore,
    team: &Team,
    name: &str,
    bytes: u64,
    content: &str,
) -> Submission {
    let key = format!("bundles/{}/{name}", team.id);
    let file = f.folder.path().join("upload");
    std::fs::write(&file, "an archive").unwrap();
    f.store.artifacts().put_file(&key, &file).await.unwrap();
    let bundle = BundleRef {
        key,
        bytes,
        blake3: blake3::hash(content.as_bytes()).to_string(),
        ..bundle()
    };
    let quota = UploadQuota::default();
    f.store
        .create_submission(Actor::Team(team.id), team.id, bundle, &quota, f.now)
        .await
        .unwrap()
}

async fn is_kept(f: &TestStore, submission: &Submission) -> bool {
    f.store
        .artifacts()
        .read(&submission.bundle.key)
        .await
        .is_ok()
}

/// Commits the next validation run with the result that the agent is invalid.
async fn commit_invalid(f: &TestStore) {
    commit_invalid_with_log(f, "its log\n").await;
}

async fn commit_invalid_with_log(f: &TestStore, log: &str) {
    let (claim, _) = f.claim_validation().await;
    let outcome = ValidationOutcome::Invalid {
        runtime: None,
        agent_name: None,
        reason: "there is no agent.toml".into(),
        timing: Vec::new(),
        log: log.into(),
    };
    f.store
        .commit_validation(&claim, outcome, f.now)
        .await
        .unwrap();
}

/// Ends the next validation run by platform faults.
async fn fail_validation(f: &mut TestStore) {
    for _ in 0..MAX_PLATFORM_FAULTS {
        let (claim, _) = f.claim_validation().await;
        f.store
            .release_after_platform_fault(&claim, "no disk", f.now)
            .await
            .unwrap();
        f.advance_clock_s(3600);
    }
}

#[tokio::test]
async fn invalid_bundle_is_deleted_but_reason_and_log_stay() {
    let f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let valid = upload_stored(&f, &team, "valid", 100).await;
    f.validate().await;
    let invalid = upload_stored(&f, &team, "invalid", 1000).await;
    assert_eq!(f.store.clean_up_failed_submissions(f.now).await.unwrap(), 0);
    commit_invalid(&f).await;
    let waiting = upload_stored(&f, &team, "waiting", 10).await;
    let usage = f.store.upload_usage(team.id, f.now).await.unwrap();
    assert_eq!((usage.day_bytes, usage.stored_bytes), (1110, 1110));

    assert_eq!(f.store.clean_up_failed_submissions(f.now).await.unwrap(), 1);
    assert_eq!(f.store.clean_up_failed_submissions(f.now).await.unwrap(), 0);
    assert!(!is_kept(&f, &invalid).await);
    assert!(is_kept(&f, &valid).await && is_kept(&f, &waiting).await);
    let stored = f.store.submission(invalid.id).await.unwrap();
    assert!(
        matches!(stored.state, SubmissionState::Invalid { reason } if reason.contains("agent.toml"))
    );
    let log = f.store.submission_log(invalid.id).await.unwrap();
    assert_eq!(log.as_deref(), Some("its log\n"));
    let usage = f.store.upload_usage(team.id, f.now).await.unwrap();
    assert_eq!((usage.day_bytes, usage.stored_bytes), (1110, 110));
}

#[tokio::test]
async fn identical_invalid_bundles_share_the_newest_log() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = [f.create_team("Alpha").await, f.create_team("Beta").await];
    let mut uploaded = Vec::new();
    for (team, name, content, log) in [
        (&alpha, "first", "same", "log of the first\n"),
        (&beta, "other", "same", "log of Beta\n"),
        (&alpha, "different", "different", "log of another\n"),
        (&alpha, "second", "same", "log of the second\n"),
        // A run that wrote nothing has no log to share.
        (&alpha, "third", "same", ""),
    ] {
        f.advance_clock_s(1);
        uploaded.push(upload_with_content(&f, team, name, 10, content).await.id);
        commit_invalid_with_log(&f, log).await;
    }
    f.store.clean_up_failed_submissions(f.now).await.unwrap();
    let shared = "log of the second\n";
    for (id, expected) in
        uploaded
            .iter()
            .zip([shared, "log of Beta\n", "log of another\n", shared, shared])
    {
        let log = f.store.submission_log(*id).await.unwrap();
        assert_eq!(log.as_deref(), Some(expected));
    }
    let stored = sqlx::query_scalar("SELECT COUNT(*) FROM submissions WHERE log <> ''");
    let stored: i64 = stored.fetch_one(&mut f.connection().await).await.unwrap();
    assert_eq!(stored, 3);
}

#[tokio::test]
async fn logs_of_the_last_invalid_submissions_are_kept() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = [f.create_team("Alpha").await, f.create_team("Beta").await];
    let of_beta = upload_stored(&f, &beta, "beta", 10).await;
    commit_invalid(&f).await;
    let mut uploaded = Vec::new();
    for number in 0..INVALID_LOGS_KEPT + 2 {
        f.advance_clock_s(1);
        uploaded.push(upload_stored(&f, &alpha, &format!("bundle-{number}"), 10).await);
        commit_invalid(&f).await;
    }
    f.store.clean_up_failed_submissions(f.now).await.unwrap();
    // Of Alpha's logs the first two are older than the last INVALID_LOGS_KEPT.
    let has_log = async |id| f.store.submission_log(id).await.unwrap().unwrap() != "";
    assert!(!has_log(uploaded[0].id).await && !has_log(uploaded[1].id).await);
    for submission in &uploaded[2..] {
        assert!(has_log(submission.id).await);
    }
    assert!(has_log(of_beta.id).await, "teams are counted separately");
}

#[tokio::test]
async fn bundle_after_platform_fault_is_kept_a_day_outside_quota() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let failed = upload_stored(&f, &team, "failed", 1000).await;
    let uploaded_at = f.now;
    fail_validation(&mut f).await;
    let usage = f.store.upload_usage(team.id, f.now).await.unwrap();
    assert_eq!((usage.day_bytes, usage.stored_bytes), (0, 1000));
    assert_eq!(f.store.clean_up_failed_submissions(f.now).await.unwrap(), 0);
    let removable_at = uploaded_at + PLATFORM_FAILED_BUNDLES_KEPT_FOR;
    assert_eq!(
        f.store
            .clean_up_failed_submissions(removable_at)
            .await
            .unwrap(),
        1
    );
    assert!(!is_kept(&f, &failed).await);
}

#[tokio::test]
async fn shared_bundle_is_not_deleted() {
    let f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    // Two submissions with the same bundle key; real uploads do not create this.
    let valid = upload_stored(&f, &team, "shared", 100).await;
    f.validate().await;
    upload_stored(&f, &team, "shared", 100).await;
    commit_invalid(&f).await;
    assert_eq!(f.store.clean_up_failed_submissions(f.now).await.unwrap(), 0);
    assert!(is_kept(&f, &valid).await);
}

#[tokio::test]
async fn orphaned_bundle_is_deleted_after_a_delay() {
    let f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let submitted = upload_stored(&f, &team, "named", 100).await;
    let orphan = format!("bundles/{}/orphan", team.id);
    let file = f.folder.path().join("upload");
    f.store.artifacts().put_file(&orphan, &file).await.unwrap();
    let hour = SignedDuration::from_hours(1);
    // A file's time of change comes from the host's clock.
    let (before, after) = (Timestamp::now() - hour, Timestamp::now() + hour);
    assert_eq!(f.store.remove_orphaned_bundles(before).await.unwrap(), 0);
    assert_eq!(f.store.remove_orphaned_bundles(after).await.unwrap(), 1);
    assert!(f.store.artifacts().read(&orphan).await.is_err());
    assert!(is_kept(&f, &submitted).await);
}

#[tokio::test]
async fn upload_quota_is_per_team_and_checked_on_insert() {
    let mut f = TestStore::new().await;
    let (alpha, beta) = (f.create_team("Alpha").await, f.create_team("Beta").await);
    let quota = UploadQuota {
        day_bytes: 1000,
        stored_bytes: 1500,
    };
    let upload = async |f: &TestStore, team: &Team, bytes: u64| {
        let bundle = BundleRef { bytes, ..bundle() };
        f.store
            .create_submission(Actor::Team(team.id), team.id, bundle, &quota, f.now)
            .await
    };
    upload(&f, &alpha, 600).await.unwrap();
    let error = upload(&f, &alpha, 500).await.unwrap_err();
    assert!(
        matches!(
            error,
            StoreError::DailyQuotaExceeded {
                limit_bytes: 1000,
                used_bytes: 600,
                bundle_bytes: 500
            }
        ),
        "{error}"
    );
    upload(&f, &alpha, 400).await.unwrap();
    upload(&f, &beta, 1000).await.unwrap();
    let error = upload(&f, &alpha, u64::MAX).await.unwrap_err();
    assert!(
        matches!(error, StoreError::DailyQuotaExceeded { .. }),
        "{error}"
    );
    // At midnight UTC the daily quota begins again.
    f.advance_clock_s(14 * 3600);
    let error = upload(&f, &alpha, 600).await.unwrap_err();
    assert!(
        matches!(
            error,
            StoreError::StorageQuotaExceeded {
                used_bytes: 1000,
                ..
            }
        ),
        "{error}"
    );
    upload(&f, &alpha, 500).await.unwrap();
}
