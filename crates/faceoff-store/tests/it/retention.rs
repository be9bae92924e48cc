//! Retention: for how long the datasets of a stage (published archives of evaluations) and the bundles of its submissions are
//! kept. Also the deletion of submissions by teams, and the files of disqualified teams, which are kept as evidence.

use crate::fixture::*;
use faceoff_airhockey::ABLATION_PROFILES;
use faceoff_store::*;
use faceoff_testkit::change_settings;
use faceoff_types::*;
use jiff::SignedDuration;
use sqlx::{Connection, SqliteConnection, migrate::Migrator, sqlite::SqliteConnectOptions};

const DAY_S: i64 = 24 * 3600;
/// Size of each submission's bundle.
const BUNDLE_BYTES: usize = 10;

/// Evaluates all teams today, each with a dataset of `dataset_bytes` bytes. Returns the evaluations in the order of `scores`.
async fn run_day(
    f: &TestStore,
    scores: &[(&Submission, f64)],
    dataset_bytes: usize,
) -> Vec<EvaluationId> {
    let stage = f.configure_stage(&one_shard_plan()).await;
    let started = f.store.start_day(Actor::Operator, stage, f.now).await;
    started.unwrap();
    while let Some(ClaimedJob { claim, job }) = f.claim().await {
        match job {
            Job::Shard { shard, .. } => {
                f.commit_shard(&claim, &shard).await;
            }
            Job::Scoring { evaluation, .. } => {
                let submission = f.store.evaluation(evaluation).await.unwrap().submission;
                let (_, score) = scores
                    .iter()
                    .find(|(evaluated, _)| evaluated.id == submission)
                    .unwrap();
                let key = format!("datasets/{evaluation}/1.zip");
                store_file(f, &key, dataset_bytes).await;
                f.finish_scoring(&claim, *score, &key).await;
            }
            Job::Validation { .. } | Job::Game { .. } => {
                panic!("expected no validation run and no game")
            }
        }
    }
    let mut evaluations = Vec::new();
    for (submission, _) in scores {
        let newest_first = f.store.evaluations_of(submission.team).await.unwrap();
        evaluations.push(newest_first[0].id);
    }
    evaluations
}

/// Closes a stage in an hour, and signs it off then (declares its results final).
async fn sign_off(f: &mut TestStore, stage: StageId) {
    f.close_stage_after_s(stage, 3600).await;
    f.store
        .sign_off_stage(Actor::Operator, stage, f.now)
        .await
        .unwrap();
}

async fn store_file(f: &TestStore, key: &str, bytes: usize) {
    let file = f.folder.path().join("file");
    std::fs::write(&file, vec![7; bytes]).unwrap();
    f.store.artifacts().put_file(key, &file).await.unwrap();
}

/// Creates a team with a valid submission whose bundle is stored.
async fn stored_submission_of(f: &TestStore, name: &str) -> Submission {
    let team = f.create_team(name).await;
    upload_stored(f, &team).await
}

/// Creates another valid submission of a team.
async fn upload_stored(f: &TestStore, team: &Team) -> Submission {
    let key = format!("bundles/{}/{}", team.id, uuid::Uuid::now_v7());
    store_file(f, &key, BUNDLE_BYTES).await;
    let bundle = BundleRef {
        key,
        bytes: BUNDLE_BYTES as u64,
        ..bundle()
    };
    let quota = UploadQuota::default();
    let created = f
        .store
        .create_submission(Actor::Team(team.id), team.id, bundle, &quota, f.now);
    created.await.unwrap();
    f.validate().await
}

async fn set_retention(
    f: &TestStore,
    stage: StageId,
    retention: Retention,
) -> Result<Stage, StoreError> {
    let change = StageChange {
        retention: Some(retention),
        ..StageChange::default()
    };
    f.store
        .change_stage(Actor::Operator, stage, change, f.now)
        .await
}

/// Keeps the newest datasets of each team, besides the best.
fn keep_last(last: u32) -> Retention {
    Retention {
        last: Some(last),
        ..Retention::default()
    }
}

/// The reason why an evaluation's dataset was removed.
async fn removal_reason(f: &TestStore, id: EvaluationId) -> Option<String> {
    let removed = f.store.evaluation(id).await.unwrap().dataset_removed;
    removed.map(|removed| removed.reason)
}

/// For each evaluation: does its dataset exist?
async fn datasets_exist(f: &TestStore, evaluations: &[EvaluationId]) -> Vec<bool> {
    let mut exist = Vec::new();
    for id in evaluations {
        exist.push(removal_reason(f, *id).await.is_none());
    }
    exist
}

async fn has_file(f: &TestStore, key: &str) -> bool {
    f.store.artifacts().read(key).await.is_ok()
}

async fn first_stage(f: &TestStore) -> StageId {
    f.store.stages().await.unwrap()[0].id
}

#[tokio::test]
async fn retention_keeps_last_and_best_of_each_team() {
    let mut f = TestStore::new().await;
    let (alpha, beta) = (
        stored_submission_of(&f, "Alpha").await,
        stored_submission_of(&f, "Beta").await,
    );
    let mut days = Vec::new();
    // Alpha's best day is the second, Beta's the last.
    for (alpha_score, beta_score) in [(1.0, 1.0), (9.0, 2.0), (2.0, 3.0), (3.0, 4.0)] {
        let scores = [(&alpha, alpha_score), (&beta, beta_score)];
        days.push(run_day(&f, &scores, 1000).await);
        f.advance_clock_s(DAY_S);
    }
    let stage = first_stage(&f).await;
    let revision = f.store.stage(stage).await.unwrap().revision.number;
    assert_eq!(
        f.store.stage_retention(stage).await.unwrap(),
        Retention::default()
    );
    let removed = f.store.apply_retentions(f.now).await.unwrap();
    assert!(removed.is_empty(), "by default all files are kept");

    let preview = f
        .store
        .preview_removal(stage, &keep_last(2), f.now)
        .await
        .unwrap();
    let expected = RemovalSummary {
        datasets: 3,
        teams: 2,
        bundles: 0,
        bytes: 3000,
        unmeasured: 0,
        next_removal_at: None,
    };
    assert_eq!(preview, expected);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_empty());
    set_retention(&f, stage, keep_last(2)).await.unwrap();
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap(), expected);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_empty());
    let alpha_evaluations: Vec<_> = days.iter().map(|day| day[0]).collect();
    let beta_evaluations: Vec<_> = days.iter().map(|day| day[1]).collect();
    assert_eq!(
        datasets_exist(&f, &alpha_evaluations).await,
        [false, true, true, true]
    );
    assert_eq!(
        datasets_exist(&f, &beta_evaluations).await,
        [false, false, true, true]
    );
    let reason = removal_reason(&f, days[0][0]).await.unwrap();
    assert!(
        reason.contains("the last 2 and the best of each team"),
        "{reason}"
    );
    // The result stays, and there is no new revision.
    let state = f.state(days[0][0]).await;
    assert!(matches!(state, EvaluationState::Finished { result, .. } if result.score == 1.0));
    let stage_after = f.store.stage(stage).await.unwrap();
    assert_eq!(stage_after.revision.number, revision);
    let events = f.store.events_after(0, 10_000).await.unwrap();
    let is_removal = |event: &Event| matches!(event, Event::DatasetRemoved { .. });
    assert_eq!(
        events
            .iter()
            .filter(|record| is_removal(&record.event))
            .count(),
        3
    );

    // A voided evaluation counts neither as one of the last two nor as the best.
    let voided = f
        .store
        .void_evaluation(Actor::Operator, days[1][0], "a test", f.now);
    voided.await.unwrap();
    f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!(
        datasets_exist(&f, &alpha_evaluations).await,
        [false, false, true, true]
    );
    // A longer retention does not restore removed datasets.
    set_retention(&f, stage, Retention::default())
        .await
        .unwrap();
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_empty());
    assert_eq!(
        datasets_exist(&f, &beta_evaluations).await,
        [false, false, true, true]
    );
}

#[tokio::test]
async fn dataset_file_is_deleted_despite_restarts() {
    let mut f = TestStore::new().await;
    let alpha = stored_submission_of(&f, "Alpha").await;
    let mut evaluations = Vec::new();
    for score in [1.0, 2.0] {
        evaluations.extend(run_day(&f, &[(&alpha, score)], 10).await);
        f.advance_clock_s(DAY_S);
    }
    let stage = first_stage(&f).await;
    set_retention(&f, stage, keep_last(1)).await.unwrap();
    let key = format!("datasets/{}/1.zip", evaluations[0]);
    f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!(datasets_exist(&f, &evaluations).await, [false, true]);
    assert!(
        has_file(&f, &key).await,
        "a backup that started before may still read the file"
    );
    // After a restart the file is still to be deleted.
    f.store = f.reopen().await;
    f.advance_clock_s(FILES_KEPT_FOR.as_secs() - 1);
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 0);
    f.advance_clock_s(1);
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 1);
    assert!(!has_file(&f, &key).await);
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 0);
    // A process was killed between deleting the file and recording it.
    let mut connection = f.connection().await;
    sqlx::query("UPDATE evaluations SET dataset_gone = 0")
        .execute(&mut connection)
        .await
        .unwrap();
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 1);
    let other = format!("datasets/{}/1.zip", evaluations[1]);
    assert!(has_file(&f, &other).await);
}

#[tokio::test]
async fn retention_waits_for_open_evaluations_and_trials() {
    let mut f = TestStore::new().await;
    let alpha = stored_submission_of(&f, "Alpha").await;
    for score in [1.0, 2.0, 3.0] {
        run_day(&f, &[(&alpha, score)], 10).await;
        f.advance_clock_s(DAY_S);
    }
    let stage = first_stage(&f).await;
    set_retention(&f, stage, keep_last(1)).await.unwrap();
    let expect_no_removal = async |f: &TestStore| {
        assert!(f.store.apply_retentions(f.now).await.unwrap().is_empty());
        // The preview still shows what will be removed later.
        let preview = f
            .store
            .preview_removal(stage, &keep_last(1), f.now)
            .await
            .unwrap();
        assert_eq!(preview.datasets, 2);
    };
    // While a trial (an evaluation on request) is open.
    let trial = f
        .store
        .propose_trial(Actor::Operator, stage, None, "a test", f.now)
        .await
        .unwrap();
    expect_no_removal(&f).await;
    f.store
        .drop_proposal(Actor::Operator, trial.id, f.now)
        .await
        .unwrap();
    // While a day is not released.
    let evaluation = f.evaluate(alpha.id, &one_shard_plan()).await;
    expect_no_removal(&f).await;
    f.store
        .cancel_evaluation(Actor::Operator, evaluation.id, "rain", f.now)
        .await
        .unwrap();
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap().datasets, 2);
}

#[tokio::test]
async fn retention_keeps_datasets_of_blind_stage() {
    let mut f = TestStore::new().await;
    let alpha = stored_submission_of(&f, "Alpha").await;
    let (rules, settings) = rules_and_settings(&one_shard_plan());
    // The results of a blind stage are hidden from teams.
    let blind = StageSettings {
        blind: true,
        ..settings
    };
    f.store
        .configure_stage(rules, blind.clone(), IanaTimeZone::UTC, f.now)
        .await
        .unwrap();
    let stage = first_stage(&f).await;
    for score in [1.0, 2.0] {
        f.store
            .start_day(Actor::Operator, stage, f.now)
            .await
            .unwrap();
        let (claim, _, shard) = f.claim_shard().await;
        f.commit_shard(&claim, &shard).await;
        let (claim, _) = f.claim_scoring().await;
        f.finish_scoring(&claim, score, DATASET_KEY).await;
        f.advance_clock_s(DAY_S);
    }
    set_retention(&f, stage, keep_last(1)).await.unwrap();
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_empty());
    // The size of the datasets is hidden, too.
    let storage = f
        .store
        .storage(Some(alpha.team), StorageScope::VisibleToTeam)
        .await;
    assert_eq!(storage.unwrap()[0].datasets, 0);
    change_settings(&f.store, stage, f.now, |settings| settings.blind = false)
        .await
        .unwrap();
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap().datasets, 1);
}

#[tokio::test]
async fn retention_ends_at_its_date_or_after_sign_off() {
    let mut f = TestStore::new().await;
    let alpha = stored_submission_of(&f, "Alpha").await;
    let evaluations = run_day(&f, &[(&alpha, 1.0)], 10).await;
    let stage = first_stage(&f).await;
    let ends_now = Retention {
        until: Some(f.now),
        ..Retention::default()
    };
    // The date has passed, but the stage is still open.
    let removed = f
        .store
        .preview_removal(stage, &ends_now, f.now)
        .await
        .unwrap();
    assert!(removed.is_empty());
    f.close_stage_after_s(stage, 3600).await;
    let removed = f
        .store
        .preview_removal(stage, &ends_now, f.now)
        .await
        .unwrap();
    assert_eq!((removed.datasets, removed.teams), (1, 1));

    let thirty_days = Retention {
        days_after_sign_off: Some(30),
        ..Retention::default()
    };
    set_retention(&f, stage, thirty_days).await.unwrap();
    f.advance_clock_s(40 * DAY_S);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_empty());
    f.store
        .sign_off_stage(Actor::Operator, stage, f.now)
        .await
        .unwrap();
    f.advance_clock_s(30 * DAY_S - 1);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_empty());
    // The retention can be changed after the sign-off, unlike the other settings.
    let longer = Retention {
        days_after_sign_off: Some(31),
        ..Retention::default()
    };
    set_retention(&f, stage, longer).await.unwrap();
    f.advance_clock_s(1);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_empty());
    let renamed = StageChange {
        name: Some("Other".parse().unwrap()),
        retention: Some(thirty_days),
        ..StageChange::default()
    };
    let changed = f.store.change_stage(Actor::Operator, stage, renamed, f.now);
    assert_conflict(changed.await, &["signed off"]);
    assert_eq!(
        f.store.stage_retention(stage).await.unwrap(),
        longer,
        "the change is atomic"
    );
    f.advance_clock_s(DAY_S);
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap().datasets, 1);
    let reason = removal_reason(&f, evaluations[0]).await.unwrap();
    assert!(reason.contains("31 days after the sign-off"), "{reason}");
    // The active submission stays: it may be evaluated in another stage.
    let submission = f.store.submission(alpha.id).await.unwrap();
    assert_eq!(submission.bundle_removed, None);
}

#[tokio::test]
async fn invalid_retention_is_refused() {
    let f = TestStore::new().await;
    let stage = f.configure_stage(&one_shard_plan()).await;
    for (retention, phrase) in [
        (keep_last(0), "expected 1 to 1000, got 0"),
        (keep_last(u32::MAX), "expected 1 to 1000"),
        (
            Retention {
                days_after_sign_off: Some(0),
                ..Retention::default()
            },
            "expected 1 to 3650",
        ),
        (
            Retention {
                until: Some(f.now),
                days_after_sign_off: Some(1),
                ..Retention::default()
            },
            "one of them at most",
        ),
    ] {
        assert_conflict(
            set_retention(&f, stage, retention).await,
            &["retention", phrase],
        );
    }
    assert!(f.store.stage_retention(stage).await.unwrap().keeps_all());
    let result = set_retention(&f, StageId::new(), keep_last(1)).await;
    assert!(matches!(result, Err(StoreError::NotFound("stage"))));
}

#[tokio::test]
async fn bundle_is_removed_with_its_last_dataset_unless_active() {
    let mut f = TestStore::new().await;
    let old = stored_submission_of(&f, "Alpha").await;
    let team = f.store.team(old.team).await.unwrap();
    run_day(&f, &[(&old, 1.0)], 10).await;
    f.advance_clock_s(DAY_S);
    let new = upload_stored(&f, &team).await;
    let never_evaluated = {
        let unused = upload_stored(&f, &team).await;
        let chosen = f
            .store
            .activate_submission(Actor::Team(team.id), new.id, f.now);
        chosen.await.unwrap();
        unused
    };
    for score in [5.0, 6.0] {
        run_day(&f, &[(&new, score)], 10).await;
        f.advance_clock_s(DAY_S);
    }
    let stage = first_stage(&f).await;
    set_retention(&f, stage, keep_last(1)).await.unwrap();
    let removed = f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!(
        (removed.datasets, removed.bundles, removed.bytes),
        (2, 0, 20),
        "until the sign-off an evaluation of the submission may be rerun"
    );
    sign_off(&mut f, stage).await;
    let removed = f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!((removed.datasets, removed.bundles), (0, 1));
    assert_eq!(removed.bytes, 10);
    let removed = f.store.submission(old.id).await.unwrap();
    let reason = removed.bundle_removed.unwrap().reason;
    assert!(reason.contains("the last 1 and the best"), "{reason}");
    assert_eq!(
        removed.deletion_request, None,
        "the submission was not deleted on request"
    );
    for submission in [&new, &never_evaluated] {
        let submission = f.store.submission(submission.id).await.unwrap();
        assert_eq!(submission.bundle_removed, None);
    }
    f.advance_clock_s(DAY_S);
    f.store.remove_files_of_removed(f.now).await.unwrap();
    assert!(!has_file(&f, &old.bundle.key).await);
    // The submission cannot be evaluated again.
    let chosen = f
        .store
        .activate_submission(Actor::Team(team.id), old.id, f.now);
    assert_conflict(
        chosen.await,
        &["bundle", "was removed", "cannot be evaluated again"],
    );
    let plan = one_shard_plan();
    let ablation = f.store.request_ablation(
        Actor::Operator,
        old.id,
        faceoff_airhockey::RULESET,
        &plan,
        &ABLATION_PROFILES,
        f.now,
    );
    assert_conflict(ablation.await, &["was removed"]);
    assert!(f.claim().await.is_none(), "no job is queued");
}

#[tokio::test]
async fn team_can_delete_unneeded_submission() {
    let mut f = TestStore::new().await;
    let first = stored_submission_of(&f, "Alpha").await;
    let team = f.store.team(first.team).await.unwrap();
    let actor = Actor::Team(team.id);
    let delete = async |f: &TestStore, id: SubmissionId| {
        f.store
            .delete_submission(Actor::Team(team.id), id, "by its team", f.now)
            .await
    };
    assert_conflict(delete(&f, first.id).await, &["active", "withdraw it"]);
    let evaluation = f.evaluate(first.id, &one_shard_plan()).await;
    let second = upload_stored(&f, &team).await;
    assert_conflict(delete(&f, first.id).await, &["being evaluated"]);
    f.run_all_with_score(4.0).await;
    // A trial of the submission.
    let trial = f
        .store
        .propose_trial(
            Actor::Operator,
            evaluation.stage_day.stage,
            Some(first.id),
            "a test",
            f.now,
        )
        .await
        .unwrap();
    assert_conflict(delete(&f, first.id).await, &["not decided yet"]);
    f.store
        .drop_proposal(Actor::Operator, trial.id, f.now)
        .await
        .unwrap();

    let usage = f.store.upload_usage(team.id, f.now).await.unwrap();
    assert_eq!(usage.stored_bytes, 20);
    f.store.check_deletable(first.id, f.now).await.unwrap();
    let deleted = delete(&f, first.id).await.unwrap();
    let request = deleted.deletion_request.unwrap();
    assert_eq!(
        (request.requested_at, request.actor),
        (f.now, actor.clone())
    );
    assert_eq!(deleted.bundle_removed.unwrap().reason, "by its team");
    assert_eq!(deleted.bundle.blake3, first.bundle.blake3);
    assert_eq!(deleted.agent_name.as_deref(), Some("striker"));
    let log = f.store.submission_log(first.id).await.unwrap();
    assert_eq!(log.as_deref(), Some("hello\n"));
    let usage = f.store.upload_usage(team.id, f.now).await.unwrap();
    assert_eq!(usage.stored_bytes, 10, "the quota is free again at once");
    assert_eq!(
        f.board().await[0].result.score,
        4.0,
        "the submission's result stays"
    );
    assert_conflict(delete(&f, first.id).await, &["was deleted on", "team:"]);

    // The bundle's file is deleted later. Until then the store does not remove it as an orphan.
    assert!(has_file(&f, &first.bundle.key).await);
    // (A file's time of change comes from the host's clock.)
    let hour = SignedDuration::from_hours(1);
    let orphans = f
        .store
        .remove_orphaned_bundles(jiff::Timestamp::now() + hour);
    assert_eq!(orphans.await.unwrap(), 0);
    f.advance_clock_s(DAY_S);
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 1);
    assert!(!has_file(&f, &first.bundle.key).await);
    assert!(has_file(&f, &second.bundle.key).await);
    // The submission cannot be evaluated again.
    let chosen = f.store.activate_submission(actor, first.id, f.now);
    assert_conflict(chosen.await, &["was removed", "by its team"]);
    let voided = f
        .store
        .void_evaluation(Actor::Operator, evaluation.id, "a test", f.now);
    voided.await.unwrap();
    let rerun = f
        .store
        .rerun_evaluation(Actor::Operator, evaluation.id, f.now);
    assert_conflict(rerun.await, &["was removed", "by its team"]);
}

#[tokio::test]
async fn submission_of_unreleased_day_cannot_be_deleted() {
    let f = TestStore::new().await;
    let alpha = stored_submission_of(&f, "Alpha").await;
    let beta = stored_submission_of(&f, "Beta").await;
    f.evaluate(alpha.id, &one_shard_plan()).await;
    // One of the two evaluations is over, but the day is not.
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard).await;
    let (claim, finished) = f.claim_scoring().await;
    f.finish_scoring(&claim, 1.0, DATASET_KEY).await;
    let evaluated = f.store.evaluation(finished).await.unwrap().submission;
    assert!([alpha.id, beta.id].contains(&evaluated));
    f.store
        .withdraw_submission(Actor::Operator, evaluated, f.now)
        .await
        .unwrap();
    let refusal = f
        .store
        .delete_submission(Actor::Operator, evaluated, "a test", f.now)
        .await;
    assert_conflict(refusal, &["a day that is not released"]);
    f.run_all_with_score(2.0).await;
    f.store
        .delete_submission(Actor::Operator, evaluated, "a test", f.now)
        .await
        .unwrap();
    // The deleted submission does not prevent a re-evaluation of the other team.
    let stage = first_stage(&f).await;
    let stage_day = f.store.evaluation(finished).await.unwrap().stage_day;
    assert_eq!(stage_day.stage, stage);
    let propose = async |scope| {
        f.store
            .propose_reevaluation(Actor::Operator, scope, "a test", f.now)
            .await
    };
    let proposal = propose(Reevaluation::Day(stage_day)).await.unwrap();
    let evaluations = f.store.proposal(proposal.id).await.unwrap().1;
    assert_eq!(evaluations.len(), 1);
    assert_ne!(evaluations[0].submission, evaluated);
    let result = propose(Reevaluation::Evaluation(finished)).await;
    assert_conflict(result, &["was removed", "cannot be evaluated again"]);
}

#[tokio::test]
async fn evidence_is_exempt_from_retention_and_deletion() {
    let mut f = TestStore::new().await;
    let (alpha, beta) = (
        stored_submission_of(&f, "Alpha").await,
        stored_submission_of(&f, "Beta").await,
    );
    let mut first_day = Vec::new();
    for score in [1.0, 2.0] {
        let evaluations = run_day(&f, &[(&alpha, score), (&beta, score)], 10).await;
        if first_day.is_empty() {
            first_day = evaluations;
        }
        f.advance_clock_s(DAY_S);
    }
    let stage = first_stage(&f).await;
    let team = f.store.team(alpha.team).await.unwrap();
    // The team deletes a submission before it is disqualified.
    let deleted_early = upload_stored(&f, &team).await;
    upload_stored(&f, &team).await;
    let delete = async |f: &TestStore, id: SubmissionId| {
        f.store
            .delete_submission(Actor::Team(team.id), id, "by its team", f.now)
            .await
    };
    delete(&f, deleted_early.id).await.unwrap();
    f.store
        .disqualify_team(Actor::Operator, team.id, "it copied", f.now)
        .await
        .unwrap();
    set_retention(&f, stage, keep_last(1)).await.unwrap();
    let removed = f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!(
        (removed.datasets, removed.teams),
        (1, 1),
        "only a dataset of Beta"
    );
    assert_eq!(datasets_exist(&f, &first_day).await, [true, false]);
    assert_conflict(
        delete(&f, alpha.id).await,
        &["disqualified", "it copied", "evidence"],
    );
    // Removed files become evidence, too, as long as they exist.
    f.store
        .disqualify_team(Actor::Operator, beta.team, "it attacked", f.now)
        .await
        .unwrap();
    let EvaluationState::Finished { dataset, .. } = f.state(first_day[1]).await else {
        panic!("expected a finished evaluation")
    };
    f.advance_clock_s(2 * DAY_S);
    f.store.remove_files_of_removed(f.now).await.unwrap();
    assert!(
        has_file(&f, &deleted_early.bundle.key).await,
        "the bundle is evidence"
    );
    assert!(has_file(&f, &dataset).await);
    f.store
        .reinstate_team(Actor::Operator, beta.team, "a mistake", f.now)
        .await
        .unwrap();
    f.store.remove_files_of_removed(f.now).await.unwrap();
    assert!(!has_file(&f, &dataset).await);

    // After the reinstatement the usual rules apply.
    f.store
        .reinstate_team(Actor::Operator, team.id, "a mistake", f.now)
        .await
        .unwrap();
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap().datasets, 1);
    assert!(!has_file(&f, &deleted_early.bundle.key).await);
}

#[tokio::test]
async fn team_retired_by_organiser_cannot_delete_files() {
    let f = TestStore::new().await;
    let alpha = stored_submission_of(&f, "Alpha").await;
    let team = f.store.team(alpha.team).await.unwrap();
    upload_stored(&f, &team).await;
    let retire = async |actor: Actor| f.store.retire_team(actor, team.id, f.now).await;
    let delete = async || {
        f.store
            .check_deletable(alpha.id, f.now)
            .await
            .map(|submission| submission.id)
    };
    retire(Actor::Operator).await.unwrap();
    assert_conflict(delete().await, &["an organiser", "kept"]);
    f.store
        .return_team(Actor::Operator, team.id, f.now)
        .await
        .unwrap();
    delete().await.unwrap();
    // A team that retires on its own can delete its files.
    retire(Actor::Team(team.id)).await.unwrap();
    delete().await.unwrap();
}

#[tokio::test]
async fn storage_sums_stored_sizes_and_hides_unreleased_days() {
    let mut f = TestStore::new().await;
    let alpha = stored_submission_of(&f, "Alpha").await;
    let beta = stored_submission_of(&f, "Beta").await;
    run_day(&f, &[(&alpha, 1.0), (&beta, 1.0)], 1000).await;
    f.advance_clock_s(DAY_S);
    let storage_of_alpha = async |f: &TestStore, scope: StorageScope| {
        let all = f.store.storage(None, scope).await.unwrap();
        let alone = f.store.storage(Some(alpha.team), scope).await.unwrap();
        assert_eq!(all[0], alone[0]);
        assert_eq!((all.len(), alone.len()), (2, 1));
        alone[0].clone()
    };
    let storage = storage_of_alpha(&f, StorageScope::All).await;
    assert_eq!(storage.name.as_str(), "Alpha");
    assert_eq!((storage.bundles, storage.bundle_bytes), (1, 10));
    assert_eq!((storage.datasets, storage.dataset_bytes), (1, 1000));
    assert_eq!(
        storage_of_alpha(&f, StorageScope::VisibleToTeam).await,
        storage
    );

    // The size of a dataset is hidden from its team until the day is released.
    f.evaluate(alpha.id, &one_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard).await;
    let (claim, evaluation) = f.claim_scoring().await;
    let owner = f.store.evaluation(evaluation).await.unwrap().team;
    store_file(&f, "datasets/today.zip", 77).await;
    f.finish_scoring(&claim, 1.0, "datasets/today.zip").await;
    let storage_of_owner =
        async |scope| f.store.storage(Some(owner), scope).await.unwrap()[0].clone();
    assert_eq!(
        storage_of_owner(StorageScope::All).await.dataset_bytes,
        1077
    );
    assert_eq!(
        storage_of_owner(StorageScope::VisibleToTeam)
            .await
            .dataset_bytes,
        1000
    );

    // Datasets that older versions stored without their size are measured once. A missing dataset takes no space.
    let mut connection = f.connection().await;
    sqlx::query("UPDATE evaluations SET dataset_bytes = NULL WHERE state = 'finished'")
        .execute(&mut connection)
        .await
        .unwrap();
    f.store
        .artifacts()
        .delete("datasets/today.zip")
        .await
        .unwrap();
    let unmeasured = storage_of_owner(StorageScope::All).await;
    assert_eq!((unmeasured.dataset_bytes, unmeasured.unmeasured), (0, 2));
    assert_eq!(f.store.measure_datasets(f.now).await.unwrap(), 3);
    assert_eq!(f.store.measure_datasets(f.now).await.unwrap(), 0);
    let measured = storage_of_owner(StorageScope::All).await;
    assert_eq!((measured.dataset_bytes, measured.unmeasured), (1000, 0));
    let unknown = f
        .store
        .storage(Some(TeamId::new()), StorageScope::All)
        .await;
    assert!(unknown.unwrap().is_empty());
}

/// The first migration of retentions.
const RETENTION_MIGRATION: &str = "0027";

fn old_id(number: u32) -> String {
    format!("01890000-0000-7000-8000-{number:012}")
}

/// Creates a data folder of a version before retentions. Team 1 was retired by an organiser, team 2 by its own decision. Each
/// team has the valid submission of its number, and an invalid one of its number × 10, whose bundle was removed.
async fn create_old_folder(folder: &std::path::Path) {
    let migrations = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../migrations");
    let old_migrations = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(migrations).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if name.as_str() < RETENTION_MIGRATION {
            std::fs::copy(entry.path(), old_migrations.path().join(name)).unwrap();
        }
    }
    let options = SqliteConnectOptions::new()
        .filename(folder.join("faceoff.sqlite3"))
        .create_if_missing(true)
        .foreign_keys(true);
    let mut connection = SqliteConnection::connect_with(&options).await.unwrap();
    let migrator = Migrator::new(old_migrations.path()).await.unwrap();
    migrator.run(&mut connection).await.unwrap();
    let mut sql = String::new();
    for (number, actor) in [
        (1, "organiser".to_owned()),
        (2, format!("team:{}", old_id(2))),
    ] {
        let team = old_id(number);
        sql.push_str(&format!(
            "INSERT INTO teams (id, name, created_at, retired_at) VALUES ('{team}', 'Team {number}', 5, 9);
             INSERT INTO events (at, actor, subject_kind, subject_id, kind, payload)
             VALUES (9, '{actor}', 'team', '{team}', 'team_retired', '{{}}');
             INSERT INTO submissions (id, team_id, bundle_key, bundle_bytes, bundle_blake3, bundle_file_name, created_at,
                                      agent_name, state, reason, log, label, withdrawn_at, bundle_removed_at)
             VALUES ('{team}', '{team}', 'bundles/{number}', 7, 'hash', 'a.zip', 6, 'a', 'valid', NULL, 'its log', 'mine',
                     8, NULL),
                    ('{}', '{team}', 'bundles/{number}0', 9, 'hash', 'b.zip', 7, NULL, 'invalid', 'why', 'a log', NULL,
                     NULL, 8);
             INSERT INTO active_submissions (team_id, submission_id, since) VALUES ('{team}', '{team}', 8);",
            old_id(number * 10)
        ));
    }
    sqlx::raw_sql(sqlx::AssertSqlSafe(sql))
        .execute(&mut connection)
        .await
        .unwrap();
    connection.close().await.unwrap();
}

#[tokio::test]
async fn migration_keeps_submissions_and_retirements() {
    let folder = tempfile::tempdir().unwrap();
    create_old_folder(folder.path()).await;
    let store = Store::open(folder.path()).await.unwrap();
    let now = "2026-03-01T10:00:00Z".parse().unwrap();
    for number in [1, 2] {
        let id: SubmissionId = old_id(number).parse().unwrap();
        let valid = store.submission(id).await.unwrap();
        assert_eq!(valid.state, SubmissionState::Valid);
        assert_eq!(valid.label.as_deref(), Some("mine"));
        assert!(valid.active && valid.withdrawn_at.is_some());
        assert_eq!((valid.bundle_removed, valid.deletion_request), (None, None));
        let log = store.submission_log(valid.id).await.unwrap();
        assert_eq!(log.as_deref(), Some("its log"));
        let id: SubmissionId = old_id(number * 10).parse().unwrap();
        let invalid = store.submission(id).await.unwrap();
        assert!(invalid.bundle_removed.is_some());
        let usage = store.upload_usage(valid.team, now).await.unwrap();
        assert_eq!(usage.stored_bytes, 7);
    }
    // Removed bundles are not deleted again.
    assert_eq!(store.remove_files_of_removed(now).await.unwrap(), 0);
    // The migration reads from the events who retired a team.
    let retired_by_organiser = store.check_deletable(old_id(1).parse().unwrap(), now).await;
    assert_conflict(retired_by_organiser, &["an organiser withdrew the team"]);
    let retired_by_team = store.check_deletable(old_id(2).parse().unwrap(), now).await;
    assert_conflict(retired_by_team, &["it is active"]);
}
