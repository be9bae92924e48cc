//! `kill -9` during writes: acknowledged writes survive, and no write is partial.

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

const FOLDER: &str = "FACEOFF_STORE_TEST_FOLDER";
/// If set, every round ends with file removal, and skips the organiser's operations on results, which take long.
const CLEARS: &str = "FACEOFF_STORE_TEST_CLEARS";

/// Writes until it is killed, and prints every acknowledged write. Started by the tests below.
#[tokio::test]
#[ignore = "the child process of the tests below"]
async fn child_process_writes_until_killed() {
    let Ok(folder) = std::env::var(FOLDER) else {
        return;
    };
    let folder = Path::new(&folder);
    let clears = std::env::var_os(CLEARS).is_some();
    let store = Store::open(folder).await.unwrap();
    // each round has its own day, and leases of earlier processes have expired
    let mut now: jiff::Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
    let small = RunPlan {
        episodes_per_task: 2,
        episodes_per_shard: 1,
        ..plan()
    };
    let stage = configure_first_stage(&store, &small, now).await;
    if let Some(newest) = store.newest_day(stage).await.unwrap() {
        now = now.max(newest.cutoff_at);
    }
    let file = tempfile::NamedTempFile::new().unwrap();
    // larger than one write, so that a kill can interrupt it
    std::fs::write(file.path(), vec![b'x'; 300_000]).unwrap();
    let report = |text: String| {
        let mut out = std::io::stdout().lock();
        writeln!(out, "\n{text}")
            .and_then(|()| out.flush())
            .unwrap();
    };
    let run = uuid::Uuid::now_v7();
    for round in 0.. {
        sign_off(&store, &format!("s {} {round}", run.simple()), now, &report).await;
        let mut token_hash = [0; 32];
        token_hash[..16].copy_from_slice(uuid::Uuid::now_v7().as_bytes());
        let name: TeamName = format!("t {} {round}", run.simple()).parse().unwrap();
        let team = store
            .create_team(Actor::Organiser, &name, token_hash, now)
            .await
            .unwrap();
        report(format!("team {}", team.id));
        // A user joins, and in every second round leaves: each is atomic.
        let code = *blake3::hash(&token_hash).as_bytes();
        let invitation = NewInvitation {
            code_hash: code,
            role: InvitationRole::Member(team.id),
            note: "a test".into(),
            expires_at: now + jiff::SignedDuration::from_hours(1),
        };
        store
            .invite(Actor::Organiser, invitation, now)
            .await
            .unwrap();
        let joined = store
            .join(join_request(code, name.as_str()), now)
            .await
            .unwrap();
        report(format!("joined {}", joined.user.id));
        if round % 2 == 1 {
            let person = joined.user.id;
            store
                .remove_user(Actor::Organiser, person, now)
                .await
                .unwrap();
            report(format!("left {person}"));
        }
        store
            .create_submission(
                Actor::Organiser,
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
                    let outcome = ValidationOutcome::Valid {
                        runtime: "native".into(),
                        agent_name: "a".into(),
                        timing: Vec::new(),
                        log: String::new(),
                    };
                    store.commit_validation(&claim, outcome, now).await.unwrap();
                    report(format!("valid {}", submission.id));
                    match store.start_day(Actor::Organiser, stage, now).await {
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
                    let mut commit = commit(&shard, 0);
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
                    if clears {
                        continue;
                    }
                    // The organiser's operations, each of which is atomic.
                    let Ok(played) = store.evaluation(evaluation).await else {
                        // It belongs to a trial or a proposal.
                        apply_played(&store, now, &report).await;
                        continue;
                    };
                    if played.extra_for.is_some() {
                        continue;
                    }
                    if played.rerun_of.is_some() {
                        let scope = Reevaluation::Evaluation(evaluation);
                        let proposed =
                            store.propose_reevaluation(Actor::Organiser, scope, "why", now);
                        match proposed.await {
                            Ok(proposal) => report(format!("proposal {}", proposal.id)),
                            // Its day is not released.
                            Err(StoreError::Conflict(_)) => {}
                            Err(error) => panic!("{error}"),
                        }
                        continue;
                    }
                    let team = played.team;
                    let disqualified = store.disqualify_team(Actor::Organiser, team, "a test", now);
                    disqualified.await.unwrap();
                    report(format!("disqualified {team}"));
                    let reinstated = store.reinstate_team(Actor::Organiser, team, "done", now);
                    reinstated.await.unwrap();
                    let voided = store.void_evaluation(Actor::Organiser, evaluation, "why", now);
                    voided.await.unwrap();
                    report(format!("voided {evaluation}"));
                    let rerun = store.rerun_evaluation(Actor::Organiser, evaluation, now);
                    report(format!("evaluation {}", rerun.await.unwrap().id));
                    organise(&store, stage, played.stage_day, now, &report).await;
                }
            }
        }
        if clears {
            remove_files(&store, stage, team.id, now, &report).await;
        }
    }
}

/// The organiser's operations on boards and days.
async fn organise(
    store: &Store,
    stage: StageId,
    of: StageDay,
    now: jiff::Timestamp,
    report: &impl Fn(String),
) {
    // A killed process may have left them frozen.
    if store.board_freeze(stage).await.unwrap().is_none() {
        let frozen = store.freeze_boards(Actor::Organiser, stage, "why", now);
        frozen.await.unwrap();
    }
    let unfrozen = store.unfreeze_boards(Actor::Organiser, stage, now);
    unfrozen.await.unwrap();
    let trial = store.propose_trial(Actor::Organiser, stage, None, "why", now);
    let trial = trial.await.unwrap().id;
    report(format!("proposal {trial}"));
    store
        .drop_proposal(Actor::Organiser, trial, now)
        .await
        .unwrap();
    report(format!("dropped {trial}"));
    // The day before, if it was missed. Not repeated for a missed day.
    if !store.missed_days().await.unwrap().is_empty() {
        return;
    }
    let date = of.date.checked_sub(jiff::Span::new().days(1)).unwrap();
    let missed = StageDay { date, ..of };
    match store
        .start_missed_day(Actor::Organiser, missed, "why", now)
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
    let changed = store.change_stage(Actor::Organiser, stage, change, now);
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
    let mut uploaded = Vec::new();
    for _ in 0..2 {
        let upload = store.create_submission(Actor::Organiser, team, bundle(), &quota, now);
        uploaded.push(upload.await.unwrap().id);
    }
    while let Some(ClaimedJob { claim, job }) = store.claim("child", LEASE_S, now).await.unwrap() {
        let Job::Validation { .. } = job else {
            panic!("expected a validation run, claimed {job:?}")
        };
        let outcome = ValidationOutcome::Valid {
            runtime: "native".into(),
            agent_name: "b".into(),
            timing: Vec::new(),
            log: String::new(),
        };
        store.commit_validation(&claim, outcome, now).await.unwrap();
    }
    let first = uploaded[0];
    match store
        .delete_submission(Actor::Organiser, first, "by an organiser: why", now)
        .await
    {
        Ok(_) => report(format!("deleted {first}")),
        // A killed process has left an undecided proposal.
        Err(StoreError::Conflict(_)) => {}
        Err(error) => panic!("{error}"),
    }
    let later = now + FILES_KEPT_FOR;
    store.remove_files_of_removed(later).await.unwrap();
}

/// Applies finished proposals, and then replaces a counting evaluation by an extra one.
async fn apply_played(store: &Store, now: jiff::Timestamp, report: &impl Fn(String)) {
    for (proposal, evaluations) in open_proposals(store).await {
        if !evaluations
            .iter()
            .all(|evaluation| evaluation.state.is_over())
        {
            continue;
        }
        match store.apply_proposal(Actor::Organiser, proposal, now).await {
            Ok(_) => report(format!("applied {proposal}")),
            // A trial of a killed process.
            Err(StoreError::Conflict(_)) => {
                let dropped = store.drop_proposal(Actor::Organiser, proposal, now);
                dropped.await.unwrap();
                continue;
            }
            Err(error) => panic!("{error}"),
        }
        let applied = store.evaluation(evaluations[0].id).await.unwrap();
        let (of, team) = (applied.stage_day, applied.team);
        let extra = store.add_extra_evaluation(Actor::Organiser, of, team, "why", true, now);
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
    let (rules, settings) = rules_and_settings(&small());
    let hour = jiff::SignedDuration::from_hours(1);
    let new = NewStage {
        name: name.parse().unwrap(),
        opens_at: now,
        closes_at: Some(now + hour),
        zone: Zone::UTC,
        rules,
        settings,
    };
    let made = store
        .create_stage(Actor::Organiser, new, now)
        .await
        .unwrap();
    let signed = store.sign_off_stage(Actor::Organiser, made.id, now + hour);
    report(format!("finalised {}", signed.await.unwrap().id));
}

#[tokio::test]
async fn store_survives_kill_9() {
    survive(&[1, 3, 5, 8, 2, 13, 4, 21, 7, 17, 6, 30], false).await;
}

#[tokio::test]
async fn organiser_operations_survive_kill_9() {
    let acknowledged = survive(&[60, 31, 47, 80], false).await;
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
    for first in [13, 14, 37, 38, 67] {
        acknowledged.extend(survive(&[first, 25], true).await);
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
async fn survive(kill_after_lines: &[usize], clears: bool) -> HashSet<String> {
    let folder = tempfile::tempdir().unwrap();
    let mut acknowledged = HashSet::new();
    // the child continues to write when it is killed, each time at another point
    for line_count in kill_after_lines.iter().copied() {
        let mut command = Command::new(std::env::current_exe().unwrap());
        if clears {
            command.env(CLEARS, "1");
        }
        let mut child = command
            .args([
                "--exact",
                "kill::child_process_writes_until_killed",
                "--ignored",
                "--nocapture",
            ])
            .env(FOLDER, folder.path())
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
        let seen: Vec<String> = reports.take(line_count).collect();
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(
            seen.len(),
            line_count,
            "the child ended before it was killed"
        );
        acknowledged.extend(seen);

        let store = Store::open(folder.path()).await.unwrap();
        check_consistency(folder.path(), &store).await;
        let stored = stored(folder.path()).await;
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
async fn stored(folder: &Path) -> HashSet<String> {
    let mut connection = connect(folder).await;
    let rows: Vec<String> = sqlx::query_scalar(
        "SELECT 'team ' || id FROM teams
         UNION SELECT 'valid ' || id FROM submissions WHERE state = 'valid'
         UNION SELECT 'evaluation ' || id FROM evaluations
         UNION SELECT 'shard ' || id FROM shards WHERE committed_at IS NOT NULL
         UNION SELECT 'finished ' || id FROM evaluations WHERE state = 'finished'
         UNION SELECT 'proposal ' || id FROM proposals
         UNION SELECT outcome || ' ' || id FROM proposals WHERE outcome IS NOT NULL
         UNION SELECT 'finished ' || id FROM proposed_evaluations WHERE state = 'finished'
         UNION SELECT 'finalised ' || id FROM stages WHERE finalised_at IS NOT NULL
         UNION SELECT 'voided ' || id FROM evaluations WHERE voided_at IS NOT NULL
         UNION SELECT 'joined ' || id FROM people
         UNION SELECT 'keeps ' || stage_id FROM stage_retentions
         UNION SELECT 'removed ' || id FROM evaluations WHERE dataset_removed_at IS NOT NULL
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
    let rules = [
        ("a submission without its validation run",
         "SELECT COUNT(*) FROM submissions s WHERE NOT EXISTS
              (SELECT 1 FROM validation_runs r JOIN jobs j ON j.id = r.job_id WHERE r.submission_id = s.id)"),
        ("an evaluation without its contestant or all of its shards",
         "SELECT COUNT(*) FROM evaluations e
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
              AND NOT EXISTS (SELECT 1 FROM evaluations e WHERE e.stage_id = d.stage_id AND e.day = d.day
                              AND e.state = 'open')"),
        ("a released day with open evaluations other than reruns",
         "SELECT COUNT(*) FROM days d WHERE d.released_at IS NOT NULL
              AND EXISTS (SELECT 1 FROM evaluations e WHERE e.stage_id = d.stage_id AND e.day = d.day
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
              WHERE NOT EXISTS (SELECT 1 FROM proposed_evaluations d WHERE d.proposal_id = p.id)
                 OR (p.outcome IS NOT NULL AND EXISTS
                     (SELECT 1 FROM proposed_evaluations d WHERE d.proposal_id = p.id AND d.state = 'open'))
                 OR (p.outcome IS 'applied') <> EXISTS
                     (SELECT 1 FROM proposed_evaluations d JOIN evaluations e ON e.id = d.id WHERE d.proposal_id = p.id)"),
        ("an operation without its event",
         "SELECT (SELECT COUNT(*) FROM evaluations WHERE extra_for IS NOT NULL AND rerun_of IS NULL)
               + (SELECT COUNT(*) FROM days WHERE missed_for IS NOT NULL)
               + (SELECT COUNT(*) FROM proposals) + (SELECT COUNT(*) FROM proposals WHERE outcome IS NOT NULL)
               + (SELECT COUNT(*) FROM frozen_boards)
               - (SELECT COUNT(*) FROM events WHERE kind IN ('extra_turn_given', 'missed_day_started', 'proposal_made',
                                                             'proposal_applied', 'proposal_dropped', 'boards_frozen'))
               + (SELECT COUNT(*) FROM events WHERE kind = 'boards_unfrozen')"),
        ("a removal without its event",
         "SELECT (SELECT COUNT(*) FROM submissions WHERE bundle_removed_for IS NOT NULL)
               + (SELECT COUNT(*) FROM evaluations WHERE dataset_removed_at IS NOT NULL)
               + (SELECT COUNT(*) FROM stage_retentions)
               - (SELECT COUNT(*) FROM events WHERE kind IN ('submission_deleted', 'archive_removed', 'dataset_removed',
                                                             'stage_retention_changed'))"),
        ("a sign-off without its event",
         "SELECT (SELECT COUNT(*) FROM stages WHERE finalised_at IS NOT NULL)
               - (SELECT COUNT(*) FROM events WHERE kind = 'stage_finalised')"),
        ("a change without its event",
         "SELECT (SELECT COUNT(*) FROM submissions) + (SELECT COUNT(*) FROM evaluations)
               + (SELECT COUNT(*) FROM shards WHERE committed_at IS NOT NULL)
               + (SELECT COUNT(*) FROM evaluations WHERE state = 'finished')
               - (SELECT COUNT(*) FROM events WHERE kind IN ('submission_uploaded', 'evaluation_queued', 'evaluation_applied',
                                                             'shard_committed', 'evaluation_finished'))"),
    ];
    for (breach, sql) in rules {
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
        assert_eq!(bytes, 300_000, "a committed shard's recording is complete");
    }
}
