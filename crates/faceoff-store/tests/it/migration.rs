//! A data folder of the version before runs and events: rows in every state are migrated, read through
//! the store, and processed to the end.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use jiff::civil::date;
use sqlx::{
    Connection, SqliteConnection,
    migrate::Migrator,
    sqlite::{SqliteConnectOptions, SqliteJournalMode},
};
use std::{path::Path, str::FromStr};
use uuid::Uuid;

/// Migrations of the old program.
const OLD: [&str; 4] = [
    "0001_competition.sql",
    "0002_summaries.sql",
    "0003_season_close.sql",
    "0004_ablations.sql",
];
/// 2026-03-01 08:00 UTC.
const MORNING: i64 = 1_772_352_000_000;
const SECRET: [u8; 32] = [5; 32];

fn id<Id: From<Uuid>>(number: u32) -> Id {
    Uuid::from_str(&format!("01890000-0000-7000-8000-{number:012}"))
        .unwrap()
        .into()
}

fn text(number: u32) -> String {
    id::<Uuid>(number).to_string()
}

/// Writes an old database, row by row.
struct Old {
    connection: SqliteConnection,
}

/// A job in one of its states; the old program called it a work unit.
#[derive(Clone, Copy)]
enum Unit {
    Queued,
    /// With this many attempts, failures and episodes.
    Leased(u32, u32, u32),
    Done(u32),
    Dropped,
}

impl Old {
    async fn new(folder: &Path) -> Self {
        let all = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../migrations");
        let old = tempfile::tempdir().unwrap();
        for name in OLD {
            std::fs::copy(all.join(name), old.path().join(name)).unwrap();
        }
        let options = SqliteConnectOptions::new()
            .filename(folder.join("faceoff.sqlite3"))
            .create_if_missing(true)
            .foreign_keys(true)
            .journal_mode(SqliteJournalMode::Wal);
        let mut connection = SqliteConnection::connect_with(&options).await.unwrap();
        let migrations = Migrator::new(old.path()).await.unwrap();
        migrations.run(&mut connection).await.unwrap();
        sqlx::query("INSERT INTO season VALUES (1, 'Old season', ?, ?, '2026-03-01', NULL)")
            .bind(&SECRET[..])
            .bind(MORNING)
            .execute(&mut connection)
            .await
            .unwrap();
        Self { connection }
    }

    async fn run(&mut self, sql: String) {
        let executed = sqlx::raw_sql(sqlx::AssertSqlSafe(sql.clone()))
            .execute(&mut self.connection)
            .await;
        if let Err(error) = executed {
            panic!("{error} in {sql}");
        }
    }

    /// A team with a submission of the same number.
    async fn team(&mut self, number: u32, state: &str, validation: Unit) {
        let hash = blake3::hash(&number.to_le_bytes()).to_hex();
        let (id, now) = (text(number), MORNING);
        self.run(format!(
            "INSERT INTO teams VALUES ('{id}', 'Team {number:02}', x'{hash}', {now})"
        ))
        .await;
        let (name, reason, log) = match state {
            "validating" => ("NULL", "NULL", "NULL"),
            "valid" => ("'striker'", "NULL", "'hello'"),
            "invalid" => ("'striker'", "'no answer'", "'oops'"),
            _ => ("NULL", "'no cgroup'", "NULL"),
        };
        self.run(format!(
            "INSERT INTO submissions VALUES ('{id}', '{id}', 'bundles/abc', 3, '{}', 'agent.tar.gz',
                                             {now}, {name}, '{state}', {reason}, {log})",
            bundle().blake3
        ))
        .await;
        self.unit(
            "smoke",
            validation,
            number,
            "submission_id",
            &id,
            number + 900,
        )
        .await;
    }

    async fn unit(
        &mut self,
        kind: &str,
        unit: Unit,
        submission: u32,
        column: &str,
        value: &str,
        number: u32,
    ) {
        let nonce = text(number + 50_000);
        let (state, attempts, failures, worker, nonce, episodes) = match unit {
            Unit::Queued => ("queued", 0, 0, "NULL".into(), "NULL".into(), 0),
            Unit::Leased(attempts, failures, episodes) => (
                "leased",
                attempts,
                failures,
                "'old/slot-0'".to_owned(),
                format!("'{nonce}'"),
                episodes,
            ),
            Unit::Done(episodes) => (
                "done",
                1,
                0,
                "'old/slot-0'".to_owned(),
                format!("'{nonce}'"),
                episodes,
            ),
            Unit::Dropped => ("dropped", 1, 0, "NULL".into(), "NULL".into(), 0),
        };
        let claimable_at = MORNING + 3_600_000;
        let columns = match column {
            "submission_id" => String::new(),
            column => format!(", {column}"),
        };
        let values = match column {
            "submission_id" => String::new(),
            _ => format!(", {value}"),
        };
        self.run(format!(
            "INSERT INTO work_units (id, kind, submission_id, state, claimable_at, attempts, failures,
                                     worker, nonce, episodes_done{columns})
             VALUES ('{}', '{kind}', '{}', '{state}', {claimable_at}, {attempts}, {failures}, {worker},
                     {nonce}, {episodes}{values})",
            text(number),
            text(submission),
        ))
        .await;
    }

    /// Evaluation `number` (a multiple of 100, followed by its shards) with the plan of six shards, of team
    /// `number / 100`. The first shards are committed, with the numbers of faults in `committed`.
    async fn evaluation(
        &mut self,
        number: u32,
        day: &str,
        state: &str,
        ends: &str,
        committed: &[u32],
        open: Unit,
    ) {
        let team = number / 100;
        self.run(format!(
            r#"INSERT INTO evaluations (id, submission_id, team_id, day, profile, tasks, episodes_per_task,
                                       episodes_per_shard, max_faults, created_at, state, finished_at,
                                       result, dataset, faults, log, reason)
               VALUES ('{}', '{}', '{}', '{day}', 'evaluation', '["prepare","hit","defend"]', 4, 2, 3,
                       {MORNING}, '{state}', {ends})"#,
            text(number),
            text(team),
            text(team),
        ))
        .await;
        let ranges = Task::ALL
            .into_iter()
            .flat_map(|task| [(task, 0), (task, 2)]);
        for (position, (task, first)) in (0_u32..).zip(ranges) {
            let shard = Shard {
                id: id(number + 1 + position),
                task,
                first_episode: first,
                end_episode: first + 2,
                recording: None,
            };
            let (columns, unit) = match committed.get(position as usize) {
                Some(faults) => {
                    let played = commit(&shard, *faults);
                    let columns = format!(
                        "{MORNING}, '{}', '{}', {faults}, '{}'",
                        old_recording(number, position),
                        serde_json::to_string(&played.outcomes).unwrap(),
                        played.log
                    );
                    (columns, Unit::Done(2))
                }
                None => ("NULL, NULL, NULL, NULL, NULL".to_owned(), open),
            };
            self.run(format!(
                "INSERT INTO shards VALUES ('{0}', '{1}', {position}, '{task}', {first}, {first} + 2,
                                            {columns})",
                shard.id,
                text(number)
            ))
            .await;
            let (id, value) = (number + 1 + position, format!("'{}'", shard.id));
            let with_shard = format!("'{}', {value}", text(number));
            self.unit(
                "shard",
                unit,
                team,
                "evaluation_id, shard_id",
                &with_shard,
                id,
            )
            .await;
        }
    }

    async fn scoring(&mut self, evaluation: u32, unit: Unit) {
        let value = format!("'{}'", text(evaluation));
        let team = evaluation / 100;
        self.unit(
            "finalise",
            unit,
            team,
            "evaluation_id",
            &value,
            evaluation + 50,
        )
        .await;
    }

    /// Ablation `number` (a multiple of 1000, followed by its runs) of team `number / 1000`. The first runs
    /// have the jobs `first`, the others `rest`. Jobs that are done have outcomes, unless `stopped`.
    async fn ablation(
        &mut self,
        number: u32,
        ends: &str,
        first: &[Unit],
        rest: Unit,
        stopped: bool,
    ) {
        let team = number / 1000;
        let created_at = MORNING + i64::from(number);
        self.run(format!(
            "INSERT INTO ablations VALUES ('{}', '{}', 2, 1, {created_at}, {ends})",
            text(number),
            text(team)
        ))
        .await;
        let runs = Profile::ABLATION
            .into_iter()
            .flat_map(|profile| Task::ALL.map(|task| (profile, task)));
        for (index, (profile, task)) in (0_u32..).zip(runs) {
            let unit = first.get(index as usize).copied().unwrap_or(rest);
            let outcomes = match unit {
                Unit::Done(_) if !stopped => {
                    let outcomes = [outcome(task, 0, true), outcome(task, 1, false)];
                    format!("'{}'", serde_json::to_string(&outcomes).unwrap())
                }
                _ => "NULL".to_owned(),
            };
            let run = number + 1 + index;
            self.run(format!(
                "INSERT INTO ablation_runs VALUES ('{}', '{}', '{profile}', '{task}', {outcomes})",
                text(run),
                text(number)
            ))
            .await;
            let value = format!("'{}'", text(run));
            self.unit("ablation", unit, team, "ablation_run_id", &value, run + 100)
                .await;
        }
    }
}

fn old_recording(evaluation: u32, position: u32) -> String {
    format!("recordings/{}/x/{position}", text(evaluation))
}

const OPEN_ENDS: &str = "NULL, NULL, NULL, NULL, NULL, NULL";

/// A folder of the old program with teams, submissions, evaluations and ablations in all states.
async fn old_folder(folder: &Path) {
    let mut old = Old::new(folder).await;
    let done = Unit::Done(0);
    old.team(1, "validating", Unit::Queued).await;
    old.team(2, "validating", Unit::Leased(2, 1, 0)).await;
    old.team(3, "invalid", done).await;
    old.team(4, "validation_error", Unit::Dropped).await;
    for team in 11..=18 {
        old.team(team, "valid", done).await;
    }
    old.evaluation(1100, "2026-03-01", "queued", OPEN_ENDS, &[], Unit::Queued)
        .await;
    old.evaluation(
        1200,
        "2026-03-01",
        "running",
        OPEN_ENDS,
        &[1],
        Unit::Leased(3, 2, 1),
    )
    .await;
    old.evaluation(
        1300,
        "2026-03-01",
        "finalising",
        OPEN_ENDS,
        &[0; 6],
        Unit::Queued,
    )
    .await;
    old.scoring(1300, Unit::Leased(1, 0, 0)).await;
    let scored = serde_json::to_string(&result(42.0)).unwrap();
    let ends = format!("{MORNING}, '{scored}', 'datasets/old.zip', NULL, NULL, NULL");
    old.evaluation(1400, "2026-02-28", "finished", &ends, &[0; 6], Unit::Queued)
        .await;
    old.scoring(1400, done).await;
    old.run(format!(
        "INSERT INTO episode_summaries VALUES ('{}', 7, '{{\"old\":1}}')",
        text(1400)
    ))
    .await;
    let ends = format!("{MORNING}, NULL, NULL, '[]', 'as stored', NULL");
    old.evaluation(
        1500,
        "2026-03-01",
        "agent_failed",
        &ends,
        &[2, 2],
        Unit::Dropped,
    )
    .await;
    let ends = format!("{MORNING}, NULL, NULL, NULL, NULL, 'disk full'");
    old.evaluation(
        1600,
        "2026-03-01",
        "platform_failed",
        &ends,
        &[0],
        Unit::Dropped,
    )
    .await;
    let ends = format!("{MORNING}, NULL, NULL, NULL, NULL, 'rain'");
    old.evaluation(
        1700,
        "2026-03-01",
        "cancelled",
        &ends,
        &[0; 6],
        Unit::Queued,
    )
    .await;
    old.scoring(1700, Unit::Dropped).await;
    // ablations: open, finished, ended by an agent fault, ended by a platform fault
    let first = [Unit::Done(2), Unit::Leased(1, 0, 1)];
    old.ablation(11_000, "NULL, NULL", &first, Unit::Queued, false)
        .await;
    let ended = format!("{MORNING} + 9000, NULL");
    old.ablation(12_000, &ended, &[], Unit::Done(2), false)
        .await;
    let ended = format!("{MORNING} + 9000, 'too many faults'");
    old.ablation(13_000, &ended, &[Unit::Done(2)], Unit::Dropped, true)
        .await;
    let ended = format!("{MORNING} + 9000, 'disk full'");
    old.ablation(14_000, &ended, &[], Unit::Dropped, false)
        .await;
    old.run(format!(
        "INSERT INTO released_days VALUES ('2026-02-28', {MORNING})"
    ))
    .await;
    let counts: i64 = sqlx::query_scalar("SELECT COUNT(*) FROM work_units")
        .fetch_one(&mut old.connection)
        .await
        .unwrap();
    assert_eq!(counts, 12 + 7 * 6 + 3 + 4 * 18);
    old.connection.close().await.unwrap();
}

async fn migrated() -> TestStore {
    let folder = tempfile::tempdir().unwrap();
    old_folder(folder.path()).await;
    let store = Store::open(folder.path()).await.unwrap();
    TestStore {
        store,
        folder,
        // leases of the old program last for another hour
        now: "2026-03-01T08:30:00Z".parse().unwrap(),
    }
}

#[tokio::test]
async fn migration_keeps_all_old_rows() {
    let f = migrated().await;
    let submission = async |number| f.store.submission(id(number)).await.unwrap();
    assert_eq!(submission(1).await.state, SubmissionState::Validating);
    // The teams' tokens are valid.
    let token = *blake3::hash(&11_u32.to_le_bytes()).as_bytes();
    let holder = f
        .store
        .verify_token(token, TokenKind::ApiToken, f.now)
        .await
        .unwrap();
    let team = f.store.team(id(11)).await.unwrap();
    assert_eq!(
        holder.map(|holder| holder.principal),
        Ok(Principal::Team(team))
    );
    let reason = "no answer".to_owned();
    assert_eq!(
        submission(3).await.state,
        SubmissionState::Invalid { reason }
    );
    let log = f.store.submission_log(id(3)).await.unwrap();
    assert_eq!(log.as_deref(), Some("oops"));
    let reason = "no cgroup".to_owned();
    let error = SubmissionState::ValidationError { reason };
    assert_eq!(submission(4).await.state, error);
    assert_eq!(submission(11).await.state, SubmissionState::Valid);

    let finished_at = jiff::Timestamp::from_millisecond(MORNING).unwrap();
    let expected = [
        (1100, EvaluationState::Queued),
        (
            1200,
            EvaluationState::Running {
                episodes_done: 2 + 5,
                episodes_total: 12,
            },
        ),
        (1300, EvaluationState::Finalising),
        (
            1400,
            EvaluationState::Finished {
                finished_at,
                result: Box::new(result(42.0)),
                dataset: "datasets/old.zip".into(),
                dataset_blake3: None,
            },
        ),
        (1500, EvaluationState::AgentFailed { finished_at }),
        (
            1600,
            EvaluationState::PlatformFailed {
                finished_at,
                reason: "disk full".into(),
            },
        ),
        (
            1700,
            EvaluationState::Cancelled {
                finished_at,
                reason: "rain".into(),
            },
        ),
    ];
    for (number, state) in expected {
        let evaluation = f.store.evaluation(id(number)).await.unwrap();
        assert_eq!(evaluation.state, state, "{number}");
        assert_eq!(evaluation.plan, plan());
        let day = if number == 1400 { (2, 28) } else { (3, 1) };
        assert_eq!(evaluation.stage_day.date, date(2026, day.0, day.1));
        assert_eq!(f.store.shards(evaluation.run).await.unwrap().len(), 6);
    }
    let run = f.store.evaluation(id(1400)).await.unwrap().run;
    let shards = f.store.shards(run).await.unwrap();
    assert_eq!(shards[5].recording, Some(old_recording(1400, 5)));
    assert_eq!(f.store.outcomes(run).await.unwrap().len(), 12);
    let summaries = f.store.episode_summaries(&[run], 7).await.unwrap();
    assert_eq!(summaries[&run], "{\"old\":1}");
    let board = f.board().await;
    assert_eq!((board.len(), board[0].evaluation), (1, id(1400)));
    // faults and log are those of the shards, which are kept
    let failed = f.store.evaluation(id(1500)).await.unwrap();
    let RunFaults { faults, log } = f.store.run_faults(failed.run).await.unwrap();
    assert_eq!(faults.len(), 4);
    assert!(
        log.contains("log of hit 0\n") && log.contains("log of hit 2\n"),
        "{log}"
    );

    let days = [date(2026, 2, 28), date(2026, 3, 1)];
    // each day starts with its first evaluation; one is released, the other has three open evaluations
    let stage = f.store.stages().await.unwrap().remove(0).id;
    let day = |date, released_at| Day {
        stage_day: StageDay { stage, date },
        cutoff_at: finished_at,
        deadline_at: None,
        released_at,
    };
    assert_eq!(
        f.store.days().await.unwrap(),
        [
            (day(days[1], None), 0),
            (day(days[0], Some(finished_at)), 1)
        ]
    );
    assert_eq!(f.store.season().await.unwrap().name, "Old season");
    for number in [11, 18] {
        assert!(submission(number).await.active, "the newest valid one");
    }
    assert!(!submission(3).await.active);
}

#[tokio::test]
async fn migration_creates_first_stage_with_revisions() {
    let folder = tempfile::tempdir().unwrap();
    old_folder(folder.path()).await;
    let file = folder.path().join("faceoff.sqlite3");
    let url = format!("sqlite://{}", file.display());
    let mut connection = SqliteConnection::connect(&url).await.unwrap();
    sqlx::query("UPDATE evaluations SET profile = 'ideal' WHERE id = ?")
        .bind(text(1400))
        .execute(&mut connection)
        .await
        .unwrap();
    connection.close().await.unwrap();

    let store = Store::open(folder.path()).await.unwrap();
    let stage = store.stages().await.unwrap().remove(0);
    assert_eq!(stage.name.as_str(), "Qualifying");
    assert_eq!((stage.names_seeds, stage.configured), (false, true));
    let revisions = store.stage_revisions(stage.id).await.unwrap();
    let found: Vec<_> = revisions
        .iter()
        .map(|one| (one.number, one.rules.profile, one.rules.ruleset))
        .collect();
    assert_eq!(
        found,
        [
            (1, Profile::Ideal, Ruleset::First),
            (2, Profile::Evaluation, Ruleset::First)
        ]
    );
    let revision = async |number| store.evaluation(id(number)).await.unwrap().revision;
    assert_eq!((revision(1400).await, revision(1100).await), (1, 2));
    assert_eq!(store.board(stage.id, 1).await.unwrap().len(), 1);

    // The same configuration as before, but with the ruleset of the new program.
    let (rules, settings) = rules_and_settings(&plan());
    let now = "2026-03-01T08:30:00Z".parse().unwrap();
    let configured = store.configure_stage(rules.clone(), settings, Zone::UTC, now);
    configured.await.unwrap();
    let stage = store.stages().await.unwrap().remove(0);
    assert_eq!((stage.rules.number, stage.rules.rules), (3, rules));
}

#[tokio::test]
async fn migration_splits_old_ablations_into_runs() {
    let f = migrated().await;
    let newest = async |team| f.store.newest_ablation(id(team)).await.unwrap().unwrap();
    let finished_at = jiff::Timestamp::from_millisecond(MORNING + 9000).unwrap();
    let expected = [
        (
            11,
            AblationState::Open {
                episodes_done: 3,
                episodes_total: 36,
            },
        ),
        (12, AblationState::Finished { finished_at }),
        (
            13,
            AblationState::Failed {
                finished_at,
                reason: "too many faults".into(),
            },
        ),
        (
            14,
            AblationState::Failed {
                finished_at,
                reason: "disk full".into(),
            },
        ),
    ];
    for (team, state) in expected {
        let ablation = newest(team).await;
        assert_eq!(ablation.id, id(1000 * team));
        assert_eq!(ablation.state, state);
        assert_eq!(ablation.episodes_per_task, 2);
        assert!(ablation.runs.keys().copied().eq(Profile::ABLATION));
    }
    for run in newest(12).await.runs.into_values() {
        let outcomes = f.store.outcomes(run).await.unwrap();
        let played: Vec<_> = outcomes.iter().map(|o| (o.task, o.episode)).collect();
        let all: Vec<_> = Task::ALL
            .into_iter()
            .flat_map(|t| [(t, 0), (t, 1)])
            .collect();
        assert_eq!(played, all);
        assert_eq!(f.store.run_faults(run).await.unwrap().faults.len(), 3);
    }
}

#[tokio::test]
async fn migration_keeps_leases_and_failure_counts() {
    let mut f = migrated().await;
    // the shard of the hit task from episode 2 on is leased, with two failures
    let claim = JobClaim {
        job: id(1202),
        nonce: id(51_202),
        worker: "old/slot-0".into(),
        lease_until: f.now,
    };
    assert!(f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap());
    let run = f.store.evaluation(id(1200)).await.unwrap().run;
    assert_eq!(
        claim.recording_key(run),
        format!("recordings/{}/{}/{}", text(1200), text(1202), text(51_202)),
        "the key of the old program"
    );
    let shard = f.store.shards(run).await.unwrap().remove(1);
    assert_eq!(
        f.commit_shard(&claim, &shard, 0).await,
        CommitOutcome::Stored
    );

    let claim = JobClaim {
        job: id(1203),
        nonce: id(51_203),
        ..claim
    };
    let failures = MAX_ATTEMPTS - 2;
    for failure in 1..=failures {
        let repeated = if failure == 1 {
            claim.clone()
        } else {
            loop {
                let (claim, ..) = f.claim_shard().await;
                if claim.job == id::<Uuid>(1203) {
                    break claim;
                }
            }
        };
        f.store
            .release_failed(&repeated, "no disk", f.now)
            .await
            .unwrap();
        f.later(60);
    }
    assert!(matches!(
        f.state(id(1200)).await,
        EvaluationState::PlatformFailed { .. }
    ));
}

#[tokio::test]
async fn migrated_queue_continues() {
    let mut f = migrated().await;
    assert!(f.store.end_leases_of("old", f.now).await.unwrap() > 0);
    f.later(3600);
    let secret = Seed::from_bytes(SECRET);
    let (mut validations, mut shards, mut of_ablations) = (0, 0, 0);
    while let Some(ClaimedJob { claim, job }) = f.claim().await {
        match job {
            Job::Validation { submission, .. } => {
                validations += 1;
                assert!([id(1), id(2)].contains(&submission.id));
                let outcome = ValidationOutcome::Valid {
                    runtime: "native".into(),
                    agent_name: "a".into(),
                    timing: Vec::new(),
                    log: String::new(),
                };
                let committed = f.store.commit_validation(&claim, outcome, f.now).await;
                assert_eq!(committed.unwrap(), CommitOutcome::Stored);
            }
            Job::Shard {
                owner,
                run,
                shard,
                seeds,
                ..
            } => {
                let mut played = commit(&shard, 0);
                match owner {
                    RunOwner::Evaluation(_) => {
                        shards += 1;
                        assert_eq!(of_ablations, 0, "ablations wait");
                        assert_eq!(seeds.episodes, secret.day(date(2026, 3, 1)));
                    }
                    RunOwner::ProposedEvaluation { .. } => panic!("there were no proposals"),
                    RunOwner::Ablation(ablation) => {
                        of_ablations += 1;
                        assert_eq!(ablation, id(11_000));
                        assert_eq!(seeds.episodes, secret.ablation());
                        assert_eq!(shard.end_episode, 2);
                        played.recording = None;
                    }
                }
                assert_eq!(seeds.mismatch, secret.model_mismatch());
                assert_eq!(run.keeps_recordings, played.recording.is_some());
                let committed = f.store.commit_shard(&claim, played, f.now).await;
                assert_eq!(committed.unwrap(), CommitOutcome::Stored);
            }
            Job::Game { .. } => panic!("no game is queued"),
            Job::Scoring { recordings, .. } => {
                assert_eq!(recordings.len(), 6);
                f.finish(&claim, 1.0, "datasets/new.zip").await;
            }
        }
    }
    assert_eq!((validations, shards, of_ablations), (2, 6 + 5, 17));
    for number in [1100, 1200, 1300] {
        assert!(matches!(
            f.state(id(number)).await,
            EvaluationState::Finished { .. }
        ));
    }
    let ablation = f.store.newest_ablation(id(11)).await.unwrap().unwrap();
    assert!(matches!(ablation.state, AblationState::Finished { .. }));
    assert_eq!(f.board().await.len(), 4);
    // the last evaluation released the day, whose cutoff has passed
    assert_eq!(
        f.store
            .newest_day(f.stage(&plan()).await)
            .await
            .unwrap()
            .unwrap()
            .released_at,
        Some(f.now)
    );
    let repeated = f
        .store
        .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
        .await;
    assert!(
        matches!(repeated, Err(StoreError::CutoffPassed { .. })),
        "{repeated:?}"
    );
    let rerun = f.store.rerun_evaluation(Actor::Organiser, id(1600), f.now);
    assert_eq!(rerun.await.unwrap().submission, id(16));
    // old recordings are deleted a day after the end of their evaluation, like new ones
    f.later(86_400);
    assert_eq!(f.store.remove_old_recordings(f.now).await.unwrap(), 7);
    let started = f
        .store
        .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
        .await;
    let teams: Vec<_> = started.unwrap().iter().map(|e| e.team).collect();
    let valid: Vec<TeamId> = [1, 2, 11, 12, 13, 14, 15, 16, 17, 18].map(id).to_vec();
    assert_eq!(teams, valid);
}
