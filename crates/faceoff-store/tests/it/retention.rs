//! What is kept of a stage's files, what goes, and what is kept whatever anybody says.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::SignedDuration;
use sqlx::{Connection, SqliteConnection, migrate::Migrator, sqlite::SqliteConnectOptions};

const DAY_S: i64 = 24 * 3600;

/// Has all teams play today, each with a dataset of its own of `bytes` bytes; the evaluations by their teams' names.
async fn play_day(f: &Fixture, scores: &[(&Submission, f64)], bytes: usize) -> Vec<EvaluationId> {
    let stage = f.stage(&small()).await;
    let started = f.store.start_day(Actor::Organiser, stage, f.now).await;
    started.unwrap();
    while let Some(Claimed { claim, work }) = f.claim().await {
        match work {
            Work::Shard { shard, .. } => {
                f.play(&claim, &shard, 0).await;
            }
            Work::Finalise { evaluation, .. } => {
                let submission = f.store.evaluation(evaluation).await.unwrap().submission;
                let of_team = scores.iter().find(|(one, _)| one.id == submission);
                let key = format!("datasets/{evaluation}/1.zip");
                store_file(f, &key, bytes).await;
                f.finish(&claim, of_team.unwrap().1, &key).await;
            }
            Work::Smoke { .. } | Work::Game { .. } => panic!("no upload waits, no game"),
        }
    }
    let mut played = Vec::new();
    for (submission, _) in scores {
        let own = f.store.evaluations_of(submission.team).await.unwrap();
        played.push(own[0].id);
    }
    played
}

/// Has a stage close in an hour, and signs it off then.
async fn sign_off(f: &mut Fixture, stage: StageId) {
    let closes = StageChange {
        closes_at: Some(Some(f.now + SignedDuration::from_hours(1))),
        ..StageChange::default()
    };
    f.store
        .change_stage(Actor::Organiser, stage, closes, f.now)
        .await
        .unwrap();
    f.later(3600);
    f.store
        .finalise_stage(Actor::Organiser, stage, f.now)
        .await
        .unwrap();
}

async fn store_file(f: &Fixture, key: &str, bytes: usize) {
    let file = f.folder.path().join("file");
    std::fs::write(&file, vec![7; bytes]).unwrap();
    f.store.artifacts().put_file(key, &file).await.unwrap();
}

/// A team whose archive is stored.
async fn stored_team(f: &Fixture, name: &str) -> Submission {
    let team = f.team(name).await;
    upload(f, &team).await
}

/// Another upload of a team, found valid.
async fn upload(f: &Fixture, team: &Team) -> Submission {
    let key = format!("bundles/{}/{}", team.id, uuid::Uuid::now_v7());
    store_file(f, &key, 10).await;
    let bundle = BundleRef {
        key,
        bytes: 10,
        ..bundle()
    };
    let quota = UploadQuota::default();
    let created = f
        .store
        .create_submission(Actor::Team(team.id), team.id, bundle, &quota, f.now);
    created.await.unwrap();
    f.validate().await
}

async fn keep(f: &Fixture, stage: StageId, retention: Retention) -> Result<Stage, StoreError> {
    let change = StageChange {
        retention: Some(retention),
        ..StageChange::default()
    };
    f.store
        .change_stage(Actor::Organiser, stage, change, f.now)
        .await
}

fn last(last: u32) -> Retention {
    Retention {
        last: Some(last),
        ..Retention::default()
    }
}

async fn removal(f: &Fixture, id: EvaluationId) -> Option<String> {
    let removed = f.store.evaluation(id).await.unwrap().dataset_removed;
    removed.map(|removed| removed.reason)
}

async fn kept(f: &Fixture, evaluations: &[EvaluationId]) -> Vec<bool> {
    let mut kept = Vec::new();
    for id in evaluations {
        kept.push(removal(f, *id).await.is_none());
    }
    kept
}

async fn has_file(f: &Fixture, key: &str) -> bool {
    f.store.artifacts().read(key).await.is_ok()
}

async fn stage_of_season(f: &Fixture) -> StageId {
    f.store.stages().await.unwrap()[0].id
}

#[track_caller]
fn refused<T: std::fmt::Debug>(done: Result<T, StoreError>, words: &[&str]) {
    let Err(StoreError::Conflict(why)) = done else {
        panic!("expected a conflict with {words:?}: {done:?}");
    };
    for word in words {
        assert!(why.contains(word), "{word:?} is not in {why:?}");
    }
}

#[tokio::test]
async fn each_teams_last_evaluations_and_its_best_are_kept() {
    let mut f = Fixture::new().await;
    let (alpha, beta) = (
        stored_team(&f, "Alpha").await,
        stored_team(&f, "Beta").await,
    );
    let mut days = Vec::new();
    // Alpha is best on the second day, Beta on the last.
    for (a, b) in [(1.0, 1.0), (9.0, 2.0), (2.0, 3.0), (3.0, 4.0)] {
        days.push(play_day(&f, &[(&alpha, a), (&beta, b)], 1000).await);
        f.later(DAY_S);
    }
    let stage = stage_of_season(&f).await;
    let revision = f.store.stage(stage).await.unwrap().rules.number;
    assert_eq!(
        f.store.stage_retention(stage).await.unwrap(),
        Retention::default()
    );
    let all = f.store.apply_retentions(f.now).await.unwrap();
    assert!(all.is_nothing(), "by default everything is kept");

    let would = f.store.would_remove(stage, &last(2), f.now).await.unwrap();
    let expected = Removed {
        datasets: 3,
        teams: 2,
        archives: 0,
        bytes: 3000,
        unmeasured: 0,
        not_before: None,
    };
    assert_eq!(would, expected);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_nothing());
    keep(&f, stage, last(2)).await.unwrap();
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap(), expected);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_nothing());
    let of = |team: usize| days.iter().map(|day| day[team]).collect::<Vec<_>>();
    assert_eq!(kept(&f, &of(0)).await, [false, true, true, true]);
    assert_eq!(kept(&f, &of(1)).await, [false, false, true, true]);
    let reason = removal(&f, days[0][0]).await.unwrap();
    assert!(
        reason.contains("the last 2 and the best of each team"),
        "{reason}"
    );
    // Its result stays, and no rule is another.
    let state = f.state(days[0][0]).await;
    assert!(matches!(state, EvaluationState::Finished { result, .. } if result.score == 1.0));
    let now = f.store.stage(stage).await.unwrap();
    assert_eq!(now.rules.number, revision);
    let events = f.store.events_after(0, 10_000).await.unwrap();
    let told = |event: &Event| matches!(event, Event::DatasetRemoved { .. });
    assert_eq!(
        events.iter().filter(|record| told(&record.event)).count(),
        3
    );

    // A voided one counts neither as one of the last nor as the best.
    let voided = f
        .store
        .void_evaluation(Actor::Organiser, days[1][0], "why", f.now);
    voided.await.unwrap();
    f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!(kept(&f, &of(0)).await, [false, false, true, true]);
    // What is kept from now on comes back for nobody.
    keep(&f, stage, Retention::default()).await.unwrap();
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_nothing());
    assert_eq!(kept(&f, &of(1)).await, [false, false, true, true]);
}

#[tokio::test]
async fn the_file_follows_the_row_whenever_the_process_dies() {
    let mut f = Fixture::new().await;
    let alpha = stored_team(&f, "Alpha").await;
    let mut played = Vec::new();
    for score in [1.0, 2.0] {
        played.extend(play_day(&f, &[(&alpha, score)], 10).await);
        f.later(DAY_S);
    }
    let stage = stage_of_season(&f).await;
    keep(&f, stage, last(1)).await.unwrap();
    let key = format!("datasets/{}/1.zip", played[0]);
    f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!(kept(&f, &played).await, [false, true]);
    assert!(
        has_file(&f, &key).await,
        "a backup that was begun before may still come to it"
    );
    // Whoever comes next finds what is to be removed.
    f.store = f.reopen().await;
    f.later(FILES_KEPT.as_secs() - 1);
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 0);
    f.later(1);
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 1);
    assert!(!has_file(&f, &key).await);
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 0);
    // Killed between the file and the note that it has gone.
    let mut connection = f.connection().await;
    sqlx::query("UPDATE evaluations SET dataset_gone = 0")
        .execute(&mut connection)
        .await
        .unwrap();
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 1);
    let other = format!("datasets/{}/1.zip", played[1]);
    assert!(has_file(&f, &other).await);
}

#[tokio::test]
async fn nothing_goes_while_somebody_needs_it() {
    let mut f = Fixture::new().await;
    let alpha = stored_team(&f, "Alpha").await;
    for score in [1.0, 2.0, 3.0] {
        play_day(&f, &[(&alpha, score)], 10).await;
        f.later(DAY_S);
    }
    let stage = stage_of_season(&f).await;
    keep(&f, stage, last(1)).await.unwrap();
    let goes_nothing = async |f: &Fixture| {
        assert!(f.store.apply_retentions(f.now).await.unwrap().is_nothing());
        // What will go once it may is told all the same.
        let would = f.store.would_remove(stage, &last(1), f.now).await.unwrap();
        assert_eq!(would.datasets, 2);
    };
    // A trial that is not dropped.
    let trial = f
        .store
        .propose_trial(Actor::Organiser, stage, None, "why", f.now)
        .await
        .unwrap();
    goes_nothing(&f).await;
    f.store
        .drop_proposal(Actor::Organiser, trial.id, f.now)
        .await
        .unwrap();
    // A day that is under way.
    let evaluation = f.evaluate(alpha.id, &small()).await;
    goes_nothing(&f).await;
    f.store
        .cancel_evaluation(Actor::Organiser, evaluation.id, "rain", f.now)
        .await
        .unwrap();
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap().datasets, 2);
}

#[tokio::test]
async fn a_blind_stage_keeps_what_no_team_could_take_home() {
    let mut f = Fixture::new().await;
    let alpha = stored_team(&f, "Alpha").await;
    let (rules, settings) = rules_of(&small());
    let blind = StageSettings {
        blind: true,
        ..settings
    };
    f.store
        .configure_stage(rules, blind.clone(), Zone::UTC, f.now)
        .await
        .unwrap();
    let stage = stage_of_season(&f).await;
    for score in [1.0, 2.0] {
        f.store
            .start_day(Actor::Organiser, stage, f.now)
            .await
            .unwrap();
        let (claim, _, shard) = f.claim_shard().await;
        f.play(&claim, &shard, 0).await;
        let (claim, _) = f.claim_scoring().await;
        f.finish(&claim, score, "d").await;
        f.later(DAY_S);
    }
    keep(&f, stage, last(1)).await.unwrap();
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_nothing());
    // Nor is the room told that they take.
    let storage = f.store.storage(Some(alpha.team), Counted::Released).await;
    assert_eq!(storage.unwrap()[0].datasets, 0);
    let opened = StageChange {
        settings: Some(StageSettings {
            blind: false,
            ..blind
        }),
        ..StageChange::default()
    };
    f.store
        .change_stage(Actor::Organiser, stage, opened, f.now)
        .await
        .unwrap();
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap().datasets, 1);
}

#[tokio::test]
async fn all_of_a_stage_goes_at_its_time_and_after_its_sign_off() {
    let mut f = Fixture::new().await;
    let alpha = stored_team(&f, "Alpha").await;
    let played = play_day(&f, &[(&alpha, 1.0)], 10).await;
    let stage = stage_of_season(&f).await;
    let until = Retention {
        until: Some(f.now),
        ..Retention::default()
    };
    // The time has come, and the stage is open.
    let removed = f.store.would_remove(stage, &until, f.now).await.unwrap();
    assert!(removed.is_nothing());
    let closes = StageChange {
        closes_at: Some(Some(f.now + SignedDuration::from_hours(1))),
        ..StageChange::default()
    };
    f.store
        .change_stage(Actor::Organiser, stage, closes, f.now)
        .await
        .unwrap();
    f.later(3600);
    let removed = f.store.would_remove(stage, &until, f.now).await.unwrap();
    assert_eq!((removed.datasets, removed.teams), (1, 1));

    let days = Retention {
        days_after_sign_off: Some(30),
        ..Retention::default()
    };
    keep(&f, stage, days).await.unwrap();
    f.later(40 * DAY_S);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_nothing());
    f.store
        .finalise_stage(Actor::Organiser, stage, f.now)
        .await
        .unwrap();
    f.later(30 * DAY_S - 1);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_nothing());
    // It can be another after the sign-off, which nothing else can.
    let longer = Retention {
        days_after_sign_off: Some(31),
        ..Retention::default()
    };
    keep(&f, stage, longer).await.unwrap();
    f.later(1);
    assert!(f.store.apply_retentions(f.now).await.unwrap().is_nothing());
    let renamed = StageChange {
        name: Some("Other".parse().unwrap()),
        retention: Some(days),
        ..StageChange::default()
    };
    let both = f
        .store
        .change_stage(Actor::Organiser, stage, renamed, f.now);
    refused(both.await, &["signed off"]);
    assert_eq!(
        f.store.stage_retention(stage).await.unwrap(),
        longer,
        "all of it or nothing"
    );
    f.later(DAY_S);
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap().datasets, 1);
    let reason = removal(&f, played[0]).await.unwrap();
    assert!(reason.contains("31 days after the sign-off"), "{reason}");
    // What it has active stays: it may enter another stage.
    let own = f.store.submission(alpha.id).await.unwrap();
    assert_eq!(own.archive_removed, None);
}

#[tokio::test]
async fn what_no_stage_can_have_is_refused_and_changes_nothing() {
    let f = Fixture::new().await;
    let stage = f.stage(&small()).await;
    for (wrong, words) in [
        (last(0), "expected 1 to 1000, got 0"),
        (last(u32::MAX), "expected 1 to 1000"),
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
        refused(keep(&f, stage, wrong).await, &["retention", words]);
    }
    assert!(f.store.stage_retention(stage).await.unwrap().keeps_all());
    let none = keep(&f, StageId::new(), last(1)).await;
    assert!(matches!(none, Err(StoreError::NotFound("stage"))));
}

#[tokio::test]
async fn an_archive_goes_with_its_last_dataset_unless_somebody_enters_it() {
    let mut f = Fixture::new().await;
    let old = stored_team(&f, "Alpha").await;
    let team = f.store.team(old.team).await.unwrap();
    play_day(&f, &[(&old, 1.0)], 10).await;
    f.later(DAY_S);
    let new = upload(&f, &team).await;
    let never_played = {
        let unused = upload(&f, &team).await;
        let chosen = f
            .store
            .activate_submission(Actor::Team(team.id), new.id, f.now);
        chosen.await.unwrap();
        unused
    };
    for score in [5.0, 6.0] {
        play_day(&f, &[(&new, score)], 10).await;
        f.later(DAY_S);
    }
    let stage = stage_of_season(&f).await;
    keep(&f, stage, last(1)).await.unwrap();
    let removed = f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!(
        (removed.datasets, removed.archives, removed.bytes),
        (2, 0, 20),
        "until the sign-off it may have to play again"
    );
    sign_off(&mut f, stage).await;
    let removed = f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!((removed.datasets, removed.archives), (0, 1));
    assert_eq!(removed.bytes, 10);
    let gone = f.store.submission(old.id).await.unwrap();
    let reason = gone.archive_removed.unwrap().reason;
    assert!(reason.contains("the last 1 and the best"), "{reason}");
    assert_eq!(gone.deleted, None, "nobody wished it");
    for kept in [&new, &never_played] {
        let kept = f.store.submission(kept.id).await.unwrap();
        assert_eq!(kept.archive_removed, None);
    }
    f.later(DAY_S);
    f.store.remove_files_of_removed(f.now).await.unwrap();
    assert!(!has_file(&f, &old.bundle.key).await);
    // It plays nothing again.
    let chosen = f
        .store
        .activate_submission(Actor::Team(team.id), old.id, f.now);
    refused(
        chosen.await,
        &["archive", "was removed", "cannot be played"],
    );
    let plan = small();
    let taken_apart = f
        .store
        .create_ablation(Actor::Organiser, old.id, &plan, f.now);
    refused(taken_apart.await, &["was removed"]);
    assert!(f.claim().await.is_none(), "nothing half done is queued");
}

#[tokio::test]
async fn a_team_deletes_what_it_needs_no_more() {
    let mut f = Fixture::new().await;
    let first = stored_team(&f, "Alpha").await;
    let team = f.store.team(first.team).await.unwrap();
    let actor = Actor::Team(team.id);
    let delete = async |f: &Fixture, id: SubmissionId| {
        f.store
            .delete_submission(Actor::Team(team.id), id, "by its team", f.now)
            .await
    };
    refused(delete(&f, first.id).await, &["active", "withdraw it"]);
    let evaluation = f.evaluate(first.id, &small()).await;
    let second = upload(&f, &team).await;
    refused(delete(&f, first.id).await, &["queued or playing"]);
    f.play_to(4.0).await;
    // A trial with it.
    let trial = f
        .store
        .propose_trial(
            Actor::Organiser,
            evaluation.of.stage,
            Some(first.id),
            "why",
            f.now,
        )
        .await
        .unwrap();
    refused(delete(&f, first.id).await, &["not decided yet"]);
    f.store
        .drop_proposal(Actor::Organiser, trial.id, f.now)
        .await
        .unwrap();

    let used = f.store.upload_usage(team.id, f.now).await.unwrap();
    assert_eq!(used.stored_bytes, 20);
    f.store.check_deletable(first.id, f.now).await.unwrap();
    let deleted = delete(&f, first.id).await.unwrap();
    let by = deleted.deleted.unwrap();
    assert_eq!((by.at, by.by), (f.now, actor.clone()));
    assert_eq!(deleted.archive_removed.unwrap().reason, "by its team");
    assert_eq!(deleted.bundle.blake3, first.bundle.blake3);
    assert_eq!(deleted.agent_name.as_deref(), Some("striker"));
    let log = f.store.submission_log(first.id).await.unwrap();
    assert_eq!(log.as_deref(), Some("hello\n"));
    let used = f.store.upload_usage(team.id, f.now).await.unwrap();
    assert_eq!(used.stored_bytes, 10, "it has room again at once");
    assert_eq!(f.board().await[0].result.score, 4.0, "its result stays");
    refused(delete(&f, first.id).await, &["was deleted on", "team:"]);

    // Its archive follows, and is no orphan of nobody's meanwhile.
    assert!(has_file(&f, &first.bundle.key).await);
    // (The files' times are the host's.)
    let hour = SignedDuration::from_hours(1);
    let orphans = f
        .store
        .remove_orphaned_bundles(jiff::Timestamp::now() + hour);
    assert_eq!(orphans.await.unwrap(), 0);
    f.later(DAY_S);
    assert_eq!(f.store.remove_files_of_removed(f.now).await.unwrap(), 1);
    assert!(!has_file(&f, &first.bundle.key).await);
    assert!(has_file(&f, &second.bundle.key).await);
    // It plays nothing again.
    let chosen = f.store.activate_submission(actor, first.id, f.now);
    refused(chosen.await, &["was removed", "by its team"]);
    let voided = f
        .store
        .void_evaluation(Actor::Organiser, evaluation.id, "why", f.now);
    voided.await.unwrap();
    let rerun = f
        .store
        .rerun_evaluation(Actor::Organiser, evaluation.id, f.now);
    refused(rerun.await, &["was removed", "by its team"]);
}

#[tokio::test]
async fn what_has_no_archive_to_delete_says_so() {
    let f = Fixture::new().await;
    let team = f.team("Alpha").await;
    let waiting = f.upload(&team).await;
    let delete = async |id: SubmissionId| {
        f.store
            .delete_submission(Actor::Organiser, id, "by an organiser: x", f.now)
            .await
    };
    refused(
        delete(waiting.id).await,
        &["smoke run is queued or running"],
    );
    let (claim, _) = f.claim_smoke().await;
    let outcome = SmokeOutcome::Invalid {
        runtime: None,
        agent_name: None,
        reason: "no manifest".into(),
        timing: Vec::new(),
        log: String::new(),
    };
    f.store.commit_smoke(&claim, outcome, f.now).await.unwrap();
    refused(delete(waiting.id).await, &["removes its archive by itself"]);
    f.store.remove_refused_bundles(f.now).await.unwrap();
    refused(delete(waiting.id).await, &["nothing left to delete"]);
    let none = delete(SubmissionId::new()).await;
    assert!(matches!(none, Err(StoreError::NotFound("submission"))));
}

#[tokio::test]
async fn what_a_day_may_have_to_play_again_is_not_deleted() {
    let f = Fixture::new().await;
    let alpha = stored_team(&f, "Alpha").await;
    let beta = stored_team(&f, "Beta").await;
    f.evaluate(alpha.id, &small()).await;
    // Alpha's is over, the day is not.
    let (claim, _, shard) = f.claim_shard().await;
    f.play(&claim, &shard, 0).await;
    let (claim, done) = f.claim_scoring().await;
    f.finish(&claim, 1.0, "d").await;
    let played = f.store.evaluation(done).await.unwrap().submission;
    assert!([alpha.id, beta.id].contains(&played));
    f.store
        .withdraw_submission(Actor::Organiser, played, f.now)
        .await
        .unwrap();
    let refusal = f
        .store
        .delete_submission(Actor::Organiser, played, "why", f.now)
        .await;
    refused(refusal, &["a day that is not released"]);
    f.play_to(2.0).await;
    f.store
        .delete_submission(Actor::Organiser, played, "why", f.now)
        .await
        .unwrap();
    // The other one's turn is not this one's to keep from it.
    let stage = stage_of_season(&f).await;
    let of = f.store.evaluation(done).await.unwrap().of;
    assert_eq!(of.stage, stage);
    let again = async |what| {
        f.store
            .propose_reevaluation(Actor::Organiser, what, "why", f.now)
            .await
    };
    let proposal = again(Reevaluation::Day(of)).await.unwrap();
    let drafts = f.store.proposal(proposal.id).await.unwrap().1;
    assert_eq!(drafts.len(), 1);
    assert_ne!(drafts[0].submission, played);
    let alone = again(Reevaluation::Evaluation(done)).await;
    refused(alone, &["was removed", "cannot be played again"]);
}

#[tokio::test]
async fn evidence_is_kept_whatever_the_retention_or_the_team_says() {
    let mut f = Fixture::new().await;
    let (alpha, beta) = (
        stored_team(&f, "Alpha").await,
        stored_team(&f, "Beta").await,
    );
    let mut first = Vec::new();
    for score in [1.0, 2.0] {
        let played = play_day(&f, &[(&alpha, score), (&beta, score)], 10).await;
        if first.is_empty() {
            first = played;
        }
        f.later(DAY_S);
    }
    let stage = stage_of_season(&f).await;
    let team = f.store.team(alpha.team).await.unwrap();
    // Just before it is found out, the team clears away.
    let cleared = upload(&f, &team).await;
    upload(&f, &team).await;
    let delete = async |f: &Fixture, id: SubmissionId| {
        f.store
            .delete_submission(Actor::Team(team.id), id, "by its team", f.now)
            .await
    };
    delete(&f, cleared.id).await.unwrap();
    f.store
        .disqualify_team(Actor::Organiser, team.id, "it spied", f.now)
        .await
        .unwrap();
    keep(&f, stage, last(1)).await.unwrap();
    let removed = f.store.apply_retentions(f.now).await.unwrap();
    assert_eq!((removed.datasets, removed.teams), (1, 1), "Beta's alone");
    assert_eq!(kept(&f, &first).await, [true, false]);
    refused(
        delete(&f, alpha.id).await,
        &["disqualified", "it spied", "evidence"],
    );
    // So becomes what nobody is promised any more, as long as it is there.
    let ruling = async |f: &Fixture| {
        f.store
            .disqualify_team(Actor::Organiser, beta.team, "it slept", f.now)
            .await
    };
    ruling(&f).await.unwrap();
    let EvaluationState::Finished { dataset, .. } = f.state(first[1]).await else {
        panic!("it was finished")
    };
    f.later(2 * DAY_S);
    f.store.remove_files_of_removed(f.now).await.unwrap();
    assert!(has_file(&f, &cleared.bundle.key).await, "it is evidence");
    assert!(has_file(&f, &dataset).await);
    f.store
        .reinstate_team(Actor::Organiser, beta.team, "it did not", f.now)
        .await
        .unwrap();
    f.store.remove_files_of_removed(f.now).await.unwrap();
    assert!(!has_file(&f, &dataset).await);

    // Reinstated it is a team like any other.
    f.store
        .reinstate_team(Actor::Organiser, team.id, "it did not", f.now)
        .await
        .unwrap();
    assert_eq!(f.store.apply_retentions(f.now).await.unwrap().datasets, 1);
    assert!(!has_file(&f, &cleared.bundle.key).await);
}

#[tokio::test]
async fn a_team_that_an_organiser_retires_leaves_its_files() {
    let f = Fixture::new().await;
    let alpha = stored_team(&f, "Alpha").await;
    let team = f.store.team(alpha.team).await.unwrap();
    upload(&f, &team).await;
    let retire = async |actor: Actor| f.store.retire_team(actor, team.id, f.now).await;
    let delete = async || {
        f.store
            .check_deletable(alpha.id, f.now)
            .await
            .map(|found| found.id)
    };
    retire(Actor::Organiser).await.unwrap();
    refused(delete().await, &["an organiser", "kept"]);
    f.store
        .return_team(Actor::Organiser, team.id, f.now)
        .await
        .unwrap();
    delete().await.unwrap();
    // By its own wish it leaves no evidence.
    retire(Actor::Team(team.id)).await.unwrap();
    delete().await.unwrap();
}

#[tokio::test]
async fn storage_is_told_without_a_look_at_the_files() {
    let mut f = Fixture::new().await;
    let alpha = stored_team(&f, "Alpha").await;
    let beta = stored_team(&f, "Beta").await;
    play_day(&f, &[(&alpha, 1.0), (&beta, 1.0)], 1000).await;
    f.later(DAY_S);
    let of = async |f: &Fixture, counted: Counted| {
        let all = f.store.storage(None, counted).await.unwrap();
        let one = f.store.storage(Some(alpha.team), counted).await.unwrap();
        assert_eq!(all[0], one[0]);
        assert_eq!((all.len(), one.len()), (2, 1));
        one[0].clone()
    };
    let storage = of(&f, Counted::All).await;
    assert_eq!(storage.name.as_str(), "Alpha");
    assert_eq!((storage.archives, storage.archive_bytes), (1, 10));
    assert_eq!((storage.datasets, storage.dataset_bytes), (1, 1000));
    assert_eq!(of(&f, Counted::Released).await, storage);

    // How large a dataset of a day is that is under way, its team does not learn.
    f.evaluate(alpha.id, &small()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.play(&claim, &shard, 0).await;
    let (claim, evaluation) = f.claim_scoring().await;
    let owner = f.store.evaluation(evaluation).await.unwrap().team;
    store_file(&f, "datasets/today.zip", 77).await;
    f.finish(&claim, 1.0, "datasets/today.zip").await;
    let told = async |counted| f.store.storage(Some(owner), counted).await.unwrap()[0].clone();
    assert_eq!(told(Counted::All).await.dataset_bytes, 1077);
    assert_eq!(told(Counted::Released).await.dataset_bytes, 1000);

    // What older programs stored is measured once; one that is lost takes no room.
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
    let unmeasured = told(Counted::All).await;
    assert_eq!((unmeasured.dataset_bytes, unmeasured.unmeasured), (0, 2));
    assert_eq!(f.store.measure_datasets(f.now).await.unwrap(), 3);
    assert_eq!(f.store.measure_datasets(f.now).await.unwrap(), 0);
    let measured = told(Counted::All).await;
    assert_eq!((measured.dataset_bytes, measured.unmeasured), (1000, 0));
    let none = f.store.storage(Some(TeamId::new()), Counted::All).await;
    assert!(none.unwrap().is_empty());
}

/// A data folder of the program before there were retentions.
async fn old_folder(folder: &std::path::Path) {
    let all = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../migrations");
    let old = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(all).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if name.as_str() < "0027" {
            std::fs::copy(entry.path(), old.path().join(name)).unwrap();
        }
    }
    let options = SqliteConnectOptions::new()
        .filename(folder.join("faceoff.sqlite3"))
        .create_if_missing(true)
        .foreign_keys(true);
    let mut connection = SqliteConnection::connect_with(&options).await.unwrap();
    let migrations = Migrator::new(old.path()).await.unwrap();
    migrations.run(&mut connection).await.unwrap();
    let id = |number: u32| format!("01890000-0000-7000-8000-{number:012}");
    let mut sql = String::new();
    for (number, by) in [(1, "organiser".to_owned()), (2, format!("team:{}", id(2)))] {
        let team = id(number);
        sql.push_str(&format!(
            "INSERT INTO teams (id, name, created_at, retired_at) VALUES ('{team}', 'Team {number}', 5, 9);
             INSERT INTO events (at, actor, subject_kind, subject_id, kind, payload)
             VALUES (9, '{by}', 'team', '{team}', 'team_retired', '{{}}');
             INSERT INTO submissions (id, team_id, bundle_key, bundle_bytes, bundle_blake3, bundle_file_name, created_at,
                                      agent_name, state, reason, log, label, withdrawn_at, bundle_removed_at)
             VALUES ('{team}', '{team}', 'bundles/{number}', 7, 'hash', 'a.zip', 6, 'a', 'valid', NULL, 'its log', 'mine',
                     8, NULL),
                    ('{}', '{team}', 'bundles/{number}0', 9, 'hash', 'b.zip', 7, NULL, 'invalid', 'why', 'a log', NULL,
                     NULL, 8);
             INSERT INTO active_submissions (team_id, submission_id, since) VALUES ('{team}', '{team}', 8);",
            id(number * 10)
        ));
    }
    sqlx::raw_sql(sqlx::AssertSqlSafe(sql))
        .execute(&mut connection)
        .await
        .unwrap();
    connection.close().await.unwrap();
}

#[tokio::test]
async fn what_older_programs_have_stored_is_taken_over_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    old_folder(folder.path()).await;
    let store = Store::open(folder.path()).await.unwrap();
    let now = "2026-03-01T10:00:00Z".parse().unwrap();
    let id = |number: u32| format!("01890000-0000-7000-8000-{number:012}");
    for number in [1, 2] {
        let valid: SubmissionId = id(number).parse().unwrap();
        let valid = store.submission(valid).await.unwrap();
        assert_eq!(valid.state, SubmissionState::Valid);
        assert_eq!(valid.label.as_deref(), Some("mine"));
        assert!(valid.active && valid.withdrawn_at.is_some());
        assert_eq!((valid.archive_removed, valid.deleted), (None, None));
        let log = store.submission_log(valid.id).await.unwrap();
        assert_eq!(log.as_deref(), Some("its log"));
        let refused: SubmissionId = id(number * 10).parse().unwrap();
        let refused = store.submission(refused).await.unwrap();
        assert!(refused.archive_removed.is_some());
        let used = store.upload_usage(valid.team, now).await.unwrap();
        assert_eq!(used.stored_bytes, 7);
    }
    // Nothing is removed a second time.
    assert_eq!(store.remove_files_of_removed(now).await.unwrap(), 0);
    // Who retired a team is in the log.
    let by_organiser = store.check_deletable(id(1).parse().unwrap(), now).await;
    refused(by_organiser, &["an organiser has taken the team out"]);
    let by_itself = store.check_deletable(id(2).parse().unwrap(), now).await;
    refused(by_itself, &["it is active"]);
}
