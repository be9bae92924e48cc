//! `kill -9` of a process that writes to the store: acknowledged writes survive, and no write is partial.
//!
//! The tests start this test program as a child process, which writes and reports each acknowledged write as a line
//! `OPERATION ID`, and kill it after a number of lines.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use sqlx::{Connection, SqliteConnection};
use std::{
    collections::HashSet,
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Command, Stdio},
};

/// Size of each recording and dataset: more than one write of a file, so that a kill can interrupt it.
const ARTIFACT_BYTES: usize = 300_000;
/// Environment variable with the data folder of the child process.
const FOLDER_VARIABLE: &str = "FACEOFF_STORE_TEST_FOLDER";
/// Environment variable of the child process. If it is set, every round ends with the removal of files, and has no operations of
/// organisers on results, which take long.
const REMOVES_FILES_VARIABLE: &str = "FACEOFF_STORE_TEST_CLEARS";

/// Writes until its process is killed, and prints every acknowledged write. The tests below start it.
#[tokio::test]
#[ignore = "the child process of the tests below"]
async fn child_process_writes_until_killed() {
    let Ok(folder) = std::env::var(FOLDER_VARIABLE) else {
        return;
    };
    let folder = Path::new(&folder);
    let removes_files = std::env::var_os(REMOVES_FILES_VARIABLE).is_some();
    let store = Store::open(folder).await.unwrap();
    // Each round has its own day, which is a day later, so that leases of earlier processes have expired.
    let mut now: jiff::Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
    let small_plan = RunPlan {
        episodes_per_task: 2,
        episodes_per_shard: 1,
        ..six_shard_plan()
    };
    let stage = configure_first_stage(&store, &small_plan, now).await;
    if let Some(newest) = store.newest_day(stage).await.unwrap() {
        now = now.max(newest.cutoff_at);
    }
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), vec![b'x'; ARTIFACT_BYTES]).unwrap();
    let report = |line: String| {
        let mut out = std::io::stdout().lock();
        // The test harness may have printed an incomplete line before.
        writeln!(out, "\n{line}")
            .and_then(|()| out.flush())
            .unwrap();
    };
    // In the names of stages (`s …`), teams (`t …`) and users, so that those of each process are unique.
    let process = uuid::Uuid::now_v7();
    for round in 0.. {
        sign_off(
            &store,
            &format!("s {} {round}", process.simple()),
            now,
            &report,
        )
        .await;
        let mut token_hash = [0; 32];
        token_hash[..16].copy_from_slice(uuid::Uuid::now_v7().as_bytes());
        let name: TeamName = format!("t {} {round}", process.simple()).parse().unwrap();
        let team = store
            .create_team(
                Actor::Operator,
                &name,
                token_hash,
                Requester::default(),
                now,
            )
            .await
            .unwrap();
        report(format!("team {}", team.id));
        // A user joins, and leaves in every second round. Each of these operations is atomic.
        let code_hash = *blake3::hash(&token_hash).as_bytes();
        let invitation = NewInvitation {
            code_hash,
            role: InvitationRole::Member(team.id),
            note: "a test".into(),
            requester: Requester::default(),
            expires_at: now + jiff::SignedDuration::from_hours(1),
        };
        store
            .invite(Actor::Operator, invitation, now)
            .await
            .unwrap();
        let joined = store
            .join(join_request(code_hash, name.as_str()), now)
            .await
            .unwrap();
        report(format!("joined {}", joined.user.id));
        if round % 2 == 1 {
            let user = joined.user.id;
            store.remove_user(Actor::Operator, user, now).await.unwrap();
            report(format!("left {user}"));
        }
        store
            .create_submission(
                Actor::Operator,
                team.id,
                bundle(),
                &UploadQuota::default(),
                now,
            )
            .await
            .unwrap();
        now += jiff::SignedDuration::from_hours(24);
        loop {
            let Some(ClaimedJob { claim, job }) = store.claim("child", LEASE_S, now).await.unwrap()
            else {
                break;
            };
            match job {
                Job::Validation { submission, .. } => {
                    let outcome = valid_outcome("native", "a", "");
                    store.commit_validation(&claim, outcome, now).await.unwrap();
                    report(format!("valid {}", submission.id));
                    match store.start_day(Actor::Operator, stage, now).await {
                        Ok(started) => {
                            for evaluation in started {
                                report(format!("evaluation {}", evaluation.id));
                            }
                        }
                        Err(StoreError::CutoffPassed { .. }) => {}
                        Err(error) => panic!("{error}"),
                    }
                }
                Job::Shard { run, shard, .. } => {
                    let mut commit = shard_commit(&shard, 0);
                    let recording = claim.recording_key(run.id);
                    let key = format!("{recording}/steps");
                    commit.recording = Some(recording);
                    store.artifacts().put_file(&key, file.path()).await.unwrap();
                    let committed = store.commit_shard(&claim, commit, now).await.unwrap();
                    assert_eq!(committed, CommitOutcome::Stored);
                    report(format!("shard {}", shard.id));
                }
                Job::Game { .. } => panic!("no game is queued"),
                Job::Scoring { evaluation, .. } => {
                    let key = format!("datasets/{evaluation}/{}.zip", claim.nonce);
                    store.artifacts().put_file(&key, file.path()).await.unwrap();
                    let finished = store
                        .finish_evaluation(&claim, &result(1.0), &key, &blake3_of("d"), now)
                        .await
                        .unwrap();
                    assert_eq!(finished, CommitOutcome::Stored);
                    report(format!("finished {evaluation}"));
                    if removes_files {
                        continue;
                    }
                    // The organiser's operations, each of which is atomic.
                    let Ok(scored) = store.evaluation(evaluation).await else {
                        // The evaluation belongs to a trial or a proposal.
                        apply_finished_proposals(&store, now, &report).await;
                        continue;
                    };
                    if scored.extra_reason.is_some() {
                        continue;
                    }
                    if scored.rerun_of.is_some() {
                        let scope = Reevaluation::Evaluation(evaluation);
                        let proposed =
                            store.propose_reevaluation(Actor::Operator, scope, "a test", now);
                        match proposed.await {
                            Ok(proposal) => report(format!("proposal {}", proposal.id)),
                            // The day of the evaluation is not released.
                            Err(StoreError::Conflict(_)) => {}
                            Err(error) => panic!("{error}"),
                        }
                        continue;
                    }
                    let team = scored.team;
                    let disqualified = store.disqualify_team(Actor::Operator, team, "a test", now);
                    disqualified.await.unwrap();
                    report(format!("disqualified {team}"));
                    let reinstated = store.reinstate_team(Actor::Operator, team, "done", now);
                    reinstated.await.unwrap();
                    let voided = store.void_evaluation(Actor::Operator, evaluation, "a test", now);
                    voided.await.unwrap();
                    report(format!("voided {evaluation}"));
                    let rerun = store.rerun_evaluation(Actor::Operator, evaluation, now);
                    report(format!("evaluation {}", rerun.await.unwrap().id));
                    change_boards_and_days(&store, stage, scored.stage_day, now, &report).await;
                }
            }
        }
        if removes_files {
            remove_files(&store, stage, team.id, now, &report).await;
        }
    }
}

/// Does the organiser's operations on boards and days.
async fn change_boards_and_days(
    store: &Store,
    stage: StageId,
    stage_day: StageDay,
    now: jiff::Timestamp,
    report: &impl Fn(String),
) {
    // A killed process may have left the boards frozen.
    if store.board_freeze(stage).await.unwrap().is_none() {
        let frozen = store.freeze_boards(Actor::Operator, stage, "a test", now);
        frozen.await.unwrap();
    }
    let unfrozen = store.unfreeze_boards(Actor::Operator, stage, now);
    unfrozen.await.unwrap();
    let trial = store.propose_trial(Actor::Operator, stage, None, "a test", now);
    let trial = trial.await.unwrap().id;
    report(format!("proposal {trial}"));
    store
        .drop_proposal(Actor::Operator, trial, now)
        .await
        .unwrap();
    report(format!("dropped {trial}"));
    // Starts the day before, if it was missed, once in a folder.
    if !store.missed_days().await.unwrap().is_empty() {
        return;
    }
    let date = stage_day
        .date
        .checked_sub(jiff::Span::new().days(1))
        .unwrap();
    let missed = StageDay { date, ..stage_day };
    match store
        .start_missed_day(Actor::Operator, missed, "a test", now)
        .await
    {
        Ok(started) => {
            for evaluation in started {
                report(format!("evaluation {}", evaluation.id));
            }
        }
        Err(StoreError::CutoffPassed { .. } | StoreError::Conflict(_)) => {}
        Err(error) => panic!("{error}"),
    }
}

/// Keeps the last dataset of each team, and deletes a submission that was never evaluated.
async fn remove_files(
    store: &Store,
    stage: StageId,
    team: TeamId,
    now: jiff::Timestamp,
    report: &impl Fn(String),
) {
    let retention = Some(Retention {
        last: Some(1),
        ..Retention::default()
    });
    let change = StageChange {
        retention,
        ..StageChange::default()
    };
    let changed = store.change_stage(Actor::Operator, stage, change, now);
    changed.await.unwrap();
    report(format!("keeps {stage}"));
    store.apply_retentions(now).await.unwrap();
    for team in store.teams().await.unwrap() {
        for evaluation in store.evaluations_of(team.id).await.unwrap() {
            if evaluation.dataset_removed.is_some() {
                report(format!("removed {}", evaluation.id));
            }
        }
    }
    // The second submission replaces the first as the active one.
    let quota = UploadQuota::default();
    let mut submissions = Vec::new();
    for _ in 0..2 {
        let upload = store.create_submission(Actor::Operator, team, bundle(), &quota, now);
        submissions.push(upload.await.unwrap().id);
    }
    while let Some(ClaimedJob { claim, job }) = store.claim("child", LEASE_S, now).await.unwrap() {
        let Job::Validation { .. } = job else {
            panic!("expected a validation run, claimed {job:?}")
        };
        let outcome = valid_outcome("native", "b", "");
        store.commit_validation(&claim, outcome, now).await.unwrap();
    }
    let first = submissions[0];
    match store
        .delete_submission(Actor::Operator, first, "by an organiser: a test", now)
        .await
    {
        Ok(_) => report(format!("deleted {first}")),
        // A killed process has left an undecided proposal.
        Err(StoreError::Conflict(_)) => {}
        Err(error) => panic!("{error}"),
    }
    store
        .remove_files_of_removed(now + FILES_KEPT_FOR)
        .await
        .unwrap();
}

/// Applies finished proposals, and then replaces a counting evaluation by an extra one.
async fn apply_finished_proposals(store: &Store, now: jiff::Timestamp, report: &impl Fn(String)) {
    for (proposal, evaluations) in open_proposals(store).await {
        if !evaluations
            .iter()
            .all(|evaluation| evaluation.state.is_over())
        {
            continue;
        }
        match store.apply_proposal(Actor::Operator, proposal, now).await {
            Ok(_) => report(format!("applied {proposal}")),
            // The proposal is a trial that a killed process has left.
            Err(StoreError::Conflict(_)) => {
                let dropped = store.drop_proposal(Actor::Operator, proposal, now);
                dropped.await.unwrap();
                continue;
            }
            Err(error) => panic!("{error}"),
        }
        let applied = store.evaluation(evaluations[0].id).await.unwrap();
        let (stage_day, team) = (applied.stage_day, applied.team);
        let extra =
            store.add_extra_evaluation(Actor::Operator, stage_day, team, "a test", true, now);
        report(format!("evaluation {}", extra.await.unwrap().id));
    }
}

async fn open_proposals(store: &Store) -> Vec<(ProposalId, Vec<ProposedEvaluation>)> {
    let mut open = Vec::new();
    for proposal in store.proposals().await.unwrap() {
        if proposal.outcome.is_none() {
            let (_, evaluations) = store.proposal(proposal.id).await.unwrap();
            open.push((proposal.id, evaluations));
        }
    }
    open
}

/// Creates a stage of one hour without days, and signs it off.
async fn sign_off(store: &Store, name: &str, now: jiff::Timestamp, report: &impl Fn(String)) {
    let (rules, settings) = rules_and_settings(&one_shard_plan());
    let hour = jiff::SignedDuration::from_hours(1);
    let stage = NewStage {
        name: name.parse().unwrap(),
        opens_at: now,
        closes_at: Some(now + hour),
        zone: IanaTimeZone::UTC,
        rules,
        settings,
    };
    let created = store
        .create_stage(Actor::Operator, stage, now)
        .await
        .unwrap();
    let signed_off = store.sign_off_stage(Actor::Operator, created.id, now + hour);
    report(format!("finalised {}", signed_off.await.unwrap().id));
}

#[tokio::test]
async fn store_survives_kill_9() {
    // The numbers are chosen such that the kills interrupt different operations.
    survive_kills(&[1, 3, 5, 8, 2, 13, 4, 21, 7, 17, 6, 30], false).await;
}

#[tokio::test]
async fn organiser_operations_survive_kill_9() {
    let acknowledged = survive_kills(&[60, 31, 47, 80], false).await;
    for operation in ["disqualified", "voided", "proposal", "dropped", "applied"] {
        let is_reported = |write: &String| write.starts_with(operation);
        assert!(
            acknowledged.iter().any(is_reported),
            "no process reached {operation}"
        );
    }
}

#[tokio::test]
async fn file_removal_survives_kill_9() {
    let mut acknowledged = HashSet::new();
    // The first rounds in a folder are short: these kills interrupt the file removal.
    for first_kill in [13, 14, 37, 38, 67] {
        acknowledged.extend(survive_kills(&[first_kill, 25], true).await);
    }
    for operation in ["keeps", "removed", "deleted"] {
        let is_reported = |write: &String| write.starts_with(operation);
        assert!(
            acknowledged.iter().any(is_reported),
            "no process reached {operation}"
        );
    }
}

/// Runs processes on the same folder and kills each after the given number of lines. Returns all reported writes.
async fn survive_kills(kill_after_lines: &[usize], removes_files: bool) -> HashSet<String> {
    let folder = tempfile::tempdir().unwrap();
    let mut acknowledged = HashSet::new();
    // The child process writes when it is killed, each time at another point.
    for line_count in kill_after_lines.iter().copied() {
        let mut command = Command::new(std::env::current_exe().unwrap());
        if removes_files {
            command.env(REMOVES_FILES_VARIABLE, "1");
        }
        let mut child = command
            .args([
                "--exact",
                "kill::child_process_writes_until_killed",
                "--ignored",
                "--nocapture",
            ])
            .env(FOLDER_VARIABLE, folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap())
            .lines()
            .map_while(Result::ok);
        let reports = lines.filter(|line| {
            line.split_once(' ').is_some_and(|(operation, id)| {
                id.parse::<uuid::Uuid>().is_ok()
                    && [
                        "team",
                        "valid",
                        "evaluation",
                        "shard",
                        "finished",
                        "disqualified",
                        "finalised",
                        "voided",
                        "joined",
                        "left",
                        "proposal",
                        "dropped",
                        "applied",
                        "keeps",
                        "removed",
                        "deleted",
                    ]
                    .contains(&operation)
            })
        });
        let reported: Vec<String> = reports.take(line_count).collect();
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(
            reported.len(),
            line_count,
            "the child ended before it was killed"
        );
        acknowledged.extend(reported);

        let store = Store::open(folder.path()).await.unwrap();
        check_consistency(folder.path(), &store).await;
        let stored = stored_writes(folder.path()).await;
        for write in &acknowledged {
            assert!(
                stored.contains(write),
                "{write} was acknowledged and is missing"
            );
        }
    }
    acknowledged
}

/// The writes in the database, as the child reports them.
async fn stored_writes(folder: &Path) -> HashSet<String> {
    let mut connection = connect(folder).await;
    let rows: Vec<String> = sqlx::query_scalar(
        "SELECT 'team ' || id FROM teams
         UNION SELECT 'valid ' || id FROM submissions WHERE state = 'valid'
         UNION SELECT 'evaluation ' || id FROM evaluations
         UNION SELECT 'shard ' || id FROM shards WHERE committed_at IS NOT NULL
         UNION SELECT 'finished ' || id FROM evaluations WHERE state = 'finished'
         UNION SELECT 'proposal ' || id FROM proposals
         UNION SELECT outcome || ' ' || id FROM proposals WHERE outcome IS NOT NULL
         UNION SELECT 'finalised ' || id FROM stages WHERE finalised_at IS NOT NULL
         UNION SELECT 'voided ' || id FROM evaluations WHERE voided_at IS NOT NULL
         UNION SELECT 'joined ' || id FROM people
         UNION SELECT 'keeps ' || stage_id FROM stage_retentions
         UNION SELECT 'removed ' || id FROM counting_evaluations WHERE dataset_removed_at IS NOT NULL
         UNION SELECT 'deleted ' || id FROM submissions WHERE deleted_at IS NOT NULL
         UNION SELECT 'left ' || id FROM people WHERE left_at IS NOT NULL
         UNION SELECT 'disqualified ' || subject_id FROM events WHERE kind = 'team_disqualified'",
    )
    .fetch_all(&mut connection)
    .await
    .unwrap();
    rows.into_iter().collect()
}

async fn connect(folder: &Path) -> SqliteConnection {
    let url = format!("sqlite://{}", folder.join("faceoff.sqlite3").display());
    SqliteConnection::connect(&url).await.unwrap()
}

/// Checks the invariants that must hold after any kill.
async fn check_consistency(folder: &Path, store: &Store) {
    let mut connection = connect(folder).await;
    let integrity: String = sqlx::query_scalar("PRAGMA integrity_check")
        .fetch_one(&mut connection)
        .await
        .unwrap();
    assert_eq!(integrity, "ok");
    let orphans = sqlx::query("PRAGMA foreign_key_check")
        .fetch_all(&mut connection)
        .await
        .unwrap();
    assert!(orphans.is_empty());
    // Each query counts breaches of an invariant.
    let breaches = [
        ("a submission without its validation run",
         "SELECT COUNT(*) FROM submissions s WHERE NOT EXISTS
              (SELECT 1 FROM validation_runs r JOIN jobs j ON j.id = r.job_id WHERE r.submission_id = s.id)"),
        ("an evaluation without its contestant or all of its shards",
         "SELECT COUNT(*) FROM counting_evaluations e
              WHERE (SELECT COUNT(*) FROM shards s JOIN jobs j ON j.id = s.job_id
                     WHERE s.run_id = e.run_id) <> 6
                 OR (SELECT COUNT(*) FROM contestants c WHERE c.run_id = e.run_id) <> 1"),
        ("a shard committed but not done, or done but not committed",
         "SELECT COUNT(*) FROM shards s JOIN jobs j ON j.id = s.job_id
              WHERE (s.committed_at IS NOT NULL) <> (j.state = 'done')"),
        ("a complete run with an open shard, or an incomplete one without",
         "SELECT COUNT(*) FROM runs r WHERE (r.state = 'played')
                 = EXISTS (SELECT 1 FROM shards s WHERE s.run_id = r.id AND s.committed_at IS NULL)"),
        ("a scoring job too early or missing",
         "SELECT COUNT(*) FROM evaluations e
              WHERE EXISTS (SELECT 1 FROM scorings f WHERE f.evaluation_id = e.id)
                 = EXISTS (SELECT 1 FROM shards s WHERE s.run_id = e.run_id AND s.committed_at IS NULL)"),
        ("a finished evaluation whose scoring job is open",
         "SELECT COUNT(*) FROM evaluations e JOIN scorings f ON f.evaluation_id = e.id
              JOIN jobs j ON j.id = f.job_id WHERE (e.state = 'finished') <> (j.state = 'done')"),
        ("a day that is over and not released",
         "SELECT COUNT(*) FROM days d WHERE d.released_at IS NULL
              AND NOT EXISTS (SELECT 1 FROM counting_evaluations e WHERE e.stage_id = d.stage_id AND e.day = d.day
                              AND e.state = 'open')"),
        ("a released day with open evaluations other than reruns",
         "SELECT COUNT(*) FROM days d WHERE d.released_at IS NOT NULL
              AND EXISTS (SELECT 1 FROM counting_evaluations e WHERE e.stage_id = d.stage_id AND e.day = d.day
                          AND e.state = 'open' AND e.rerun_of IS NULL AND e.extra_for IS NULL)"),
        ("a valid submission of a team without an active one",
         "SELECT COUNT(*) FROM submissions s WHERE s.state = 'valid'
              AND NOT EXISTS (SELECT 1 FROM active_submissions a WHERE a.team_id = s.team_id)"),
        ("a user who joined without an invitation or a token, or left with a valid one",
         "SELECT COUNT(*) FROM people p
              WHERE (SELECT COUNT(*) FROM invitations i WHERE i.accepted_by = p.id) <> 1
                 OR (SELECT COUNT(*) FROM tokens t WHERE t.person_id = p.id) <> 1
                 OR (p.left_at IS NULL) <> EXISTS (SELECT 1 FROM tokens t WHERE t.person_id = p.id
                                                   AND t.revoked_at IS NULL)"),
        ("an invitation, a user, or a departure without its event",
         "SELECT (SELECT COUNT(*) FROM invitations) + (SELECT COUNT(*) FROM people)
               + (SELECT COUNT(*) FROM people WHERE left_at IS NOT NULL)
               - (SELECT COUNT(*) FROM events WHERE kind IN ('invited', 'person_joined', 'person_left'))"),
        ("a decision without its event",
         "SELECT (SELECT COUNT(*) FROM evaluations WHERE voided_at IS NOT NULL)
               + (SELECT COUNT(*) FROM teams WHERE disqualified_at IS NOT NULL)
               - (SELECT COUNT(*) FROM events WHERE kind IN ('evaluation_voided', 'team_disqualified'))
               + (SELECT COUNT(*) FROM events WHERE kind = 'team_reinstated')"),
        ("a proposal without evaluations, or half applied",
         "SELECT COUNT(*) FROM proposals p
              WHERE NOT EXISTS (SELECT 1 FROM evaluations d WHERE d.proposal_id = p.id)
                 OR (p.outcome IS NOT NULL AND EXISTS
                     (SELECT 1 FROM evaluations d WHERE d.proposal_id = p.id AND d.state = 'open'))
                 OR (p.outcome IS 'applied') <> EXISTS
                     (SELECT 1 FROM counting_evaluations e WHERE e.proposal_id = p.id)"),
        ("an operation without its event",
         "SELECT (SELECT COUNT(*) FROM counting_evaluations WHERE extra_for IS NOT NULL AND rerun_of IS NULL)
               + (SELECT COUNT(*) FROM days WHERE missed_for IS NOT NULL)
               + (SELECT COUNT(*) FROM proposals) + (SELECT COUNT(*) FROM proposals WHERE outcome IS NOT NULL)
               + (SELECT COUNT(*) FROM frozen_boards)
               - (SELECT COUNT(*) FROM events WHERE kind IN ('extra_turn_given', 'missed_day_started', 'proposal_made',
                                                             'proposal_applied', 'proposal_dropped', 'boards_frozen'))
               + (SELECT COUNT(*) FROM events WHERE kind = 'boards_unfrozen')"),
        ("a removal without its event",
         "SELECT (SELECT COUNT(*) FROM submissions WHERE bundle_removed_for IS NOT NULL)
               + (SELECT COUNT(*) FROM counting_evaluations WHERE dataset_removed_at IS NOT NULL)
               + (SELECT COUNT(*) FROM stage_retentions)
               - (SELECT COUNT(*) FROM events WHERE kind IN ('submission_deleted', 'archive_removed', 'dataset_removed',
                                                             'stage_retention_changed'))"),
        ("a sign-off without its event",
         "SELECT (SELECT COUNT(*) FROM stages WHERE finalised_at IS NOT NULL)
               - (SELECT COUNT(*) FROM events WHERE kind = 'stage_finalised')"),
        ("a change without its event",
         "SELECT (SELECT COUNT(*) FROM submissions) + (SELECT COUNT(*) FROM counting_evaluations)
               + (SELECT COUNT(*) FROM shards WHERE committed_at IS NOT NULL)
               + (SELECT COUNT(*) FROM counting_evaluations WHERE state = 'finished')
               - (SELECT COUNT(*) FROM events WHERE kind IN ('submission_uploaded', 'evaluation_queued', 'evaluation_applied',
                                                             'shard_committed', 'evaluation_finished'))"),
    ];
    for (breach, sql) in breaches {
        let count: i64 = sqlx::query_scalar(sql)
            .fetch_one(&mut connection)
            .await
            .unwrap();
        assert_eq!(count, 0, "{breach}");
    }
    let datasets: Vec<(String, bool, bool)> = sqlx::query_as(
        "SELECT dataset, dataset_removed_at IS NULL, dataset_gone FROM evaluations WHERE state = 'finished'",
    )
    .fetch_all(&mut connection)
    .await
    .unwrap();
    for (dataset, is_available, is_deleted) in datasets {
        let exists = store.artifacts().read(&dataset).await.is_ok();
        assert!(
            exists || !is_available,
            "{dataset} should be available and is missing"
        );
        assert!(
            !exists || !is_deleted,
            "{dataset} is marked as deleted and exists"
        );
    }
    let recordings: Vec<String> =
        sqlx::query_scalar("SELECT recording FROM shards WHERE recording IS NOT NULL")
            .fetch_all(&mut connection)
            .await
            .unwrap();
    for recording in recordings {
        let (bytes, _) = store
            .artifacts()
            .read(&format!("{recording}/steps"))
            .await
            .unwrap();
        assert_eq!(
            bytes, ARTIFACT_BYTES as u64,
            "a committed shard's recording is complete"
        );
    }
}
