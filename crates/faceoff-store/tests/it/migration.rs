//! A data folder of the version before runs and events: rows in every state are migrated, read through
//! the store, and processed to the end.
//!
//! All ids are made from numbers, by [`id`]: a team and its submission have the same number, from 1. An evaluation has the
//! number of its team × 100, its six shards and their jobs have the next numbers, and its scoring job has its number + 50. An
//! ablation has the number of its team × 1000. A validation run's job has the number of its team + 900, and the nonce (unique
//! number) of a job's lease has the job's number + 50000.

use crate::fixture::*;
use faceoff_airhockey::{ABLATION_PROFILES, EVALUATION, IDEAL, TASKS};
use faceoff_store::*;
use faceoff_types::*;
use jiff::civil::date;
use sqlx::{
    Connection, SqliteConnection,
    migrate::Migrator,
    sqlite::{SqliteConnectOptions, SqliteJournalMode},
};
use std::{collections::HashSet, path::Path, str::FromStr};
use uuid::Uuid;

/// Migrations of the old program.
const OLD_MIGRATIONS: [&str; 4] = [
    "0001_competition.sql",
    "0002_summaries.sql",
    "0003_season_close.sql",
    "0004_ablations.sql",
];
/// Time of all changes by the old program: 2026-03-01 08:00 UTC, in milliseconds.
const MORNING_MS: i64 = 1_772_352_000_000;
/// Secret of the old season.
const SECRET: [u8; 32] = [5; 32];

fn id<Id: From<Uuid>>(number: u32) -> Id {
    Uuid::from_str(&format!("01890000-0000-7000-8000-{number:012}"))
        .unwrap()
        .into()
}

fn id_text(number: u32) -> String {
    id::<Uuid>(number).to_string()
}

/// Writes a database of the old program, row by row.
struct OldDatabase {
    connection: SqliteConnection,
}

/// State of a job, which the old program called a work unit.
#[derive(Clone, Copy)]
enum OldJob {
    Queued,
    Leased {
        attempts: u32,
        failures: u32,
        episodes_done: u32,
    },
    Done {
        episodes_done: u32,
    },
    Dropped,
}

impl OldJob {
    /// A leased job of a worker's first attempt.
    const fn leased(episodes_done: u32) -> Self {
        Self::Leased {
            attempts: 1,
            failures: 0,
            episodes_done,
        }
    }
}

impl OldDatabase {
    async fn new(folder: &Path) -> Self {
        let migrations = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../migrations");
        let old_migrations = tempfile::tempdir().unwrap();
        for name in OLD_MIGRATIONS {
            std::fs::copy(migrations.join(name), old_migrations.path().join(name)).unwrap();
        }
        let options = SqliteConnectOptions::new()
            .filename(folder.join("faceoff.sqlite3"))
            .create_if_missing(true)
            .foreign_keys(true)
            .journal_mode(SqliteJournalMode::Wal);
        let mut connection = SqliteConnection::connect_with(&options).await.unwrap();
        let migrator = Migrator::new(old_migrations.path()).await.unwrap();
        migrator.run(&mut connection).await.unwrap();
        sqlx::query("INSERT INTO season VALUES (1, 'Old season', ?, ?, '2026-03-01', NULL)")
            .bind(&SECRET[..])
            .bind(MORNING_MS)
            .execute(&mut connection)
            .await
            .unwrap();
        Self { connection }
    }

    async fn execute(&mut self, sql: String) {
        let executed = sqlx::raw_sql(sqlx::AssertSqlSafe(sql.clone()))
            .execute(&mut self.connection)
            .await;
        if let Err(error) = executed {
            panic!("{error} in {sql}");
        }
    }

    /// Inserts a team and its submission in this state, with the job of its validation run.
    async fn insert_team(&mut self, number: u32, state: &str, validation: OldJob) {
        let hash = blake3::hash(&number.to_le_bytes()).to_hex();
        let (id, now) = (id_text(number), MORNING_MS);
        self.execute(format!(
            "INSERT INTO teams VALUES ('{id}', 'Team {number:02}', x'{hash}', {now})"
        ))
        .await;
        let (name, reason, log) = match state {
            "validating" => ("NULL", "NULL", "NULL"),
            "valid" => ("'striker'", "NULL", "'hello'"),
            "invalid" => ("'striker'", "'no answer'", "'oops'"),
            _ => ("NULL", "'no cgroup'", "NULL"),
        };
        self.execute(format!(
            "INSERT INTO submissions VALUES ('{id}', '{id}', 'bundles/abc', 3, '{}', 'agent.tar.gz',
                                             {now}, {name}, '{state}', {reason}, {log})",
            bundle().blake3
        ))
        .await;
        self.insert_job(
            "smoke",
            validation,
            number,
            "submission_id",
            &id,
            number + 900,
        )
        .await;
    }

    /// Inserts a job. `column` is the column that refers to its subject, and `value` is the reference.
    async fn insert_job(
        &mut self,
        kind: &str,
        job: OldJob,
        submission: u32,
        column: &str,
        value: &str,
        number: u32,
    ) {
        let nonce = id_text(number + 50_000);
        let (state, attempts, failures, worker, nonce, episodes_done) = match job {
            OldJob::Queued => ("queued", 0, 0, "NULL".into(), "NULL".into(), 0),
            OldJob::Leased {
                attempts,
                failures,
                episodes_done,
            } => (
                "leased",
                attempts,
                failures,
                "'old/slot-0'".to_owned(),
                format!("'{nonce}'"),
                episodes_done,
            ),
            OldJob::Done { episodes_done } => (
                "done",
                1,
                0,
                "'old/slot-0'".to_owned(),
                format!("'{nonce}'"),
                episodes_done,
            ),
            OldJob::Dropped => ("dropped", 1, 0, "NULL".into(), "NULL".into(), 0),
        };
        let claimable_at = MORNING_MS + 3_600_000;
        let columns = match column {
            "submission_id" => String::new(),
            column => format!(", {column}"),
        };
        let values = match column {
            "submission_id" => String::new(),
            _ => format!(", {value}"),
        };
        self.execute(format!(
            "INSERT INTO work_units (id, kind, submission_id, state, claimable_at, attempts, failures,
                                     worker, nonce, episodes_done{columns})
             VALUES ('{}', '{kind}', '{}', '{state}', {claimable_at}, {attempts}, {failures}, {worker},
                     {nonce}, {episodes_done}{values})",
            id_text(number),
            id_text(submission),
        ))
        .await;
    }

    /// Inserts an evaluation with six shards. `end_values` are the values of the columns that describe its end. The first shards
    /// are committed, with the numbers of faults in `committed_faults`; the jobs of the others are in the state `open`.
    async fn insert_evaluation(
        &mut self,
        number: u32,
        day: &str,
        state: &str,
        end_values: &str,
        committed_faults: &[u32],
        open: OldJob,
    ) {
        let team = number / 100;
        self.execute(format!(
            r#"INSERT INTO evaluations (id, submission_id, team_id, day, profile, tasks, episodes_per_task,
                                       episodes_per_shard, max_faults, created_at, state, finished_at,
                                       result, dataset, faults, log, reason)
               VALUES ('{}', '{}', '{}', '{day}', 'evaluation', '["prepare","hit","defend"]', 4, 2, 3,
                       {MORNING_MS}, '{state}', {end_values})"#,
            id_text(number),
            id_text(team),
            id_text(team),
        ))
        .await;
        let ranges = TASKS.into_iter().flat_map(|task| [(task, 0), (task, 2)]);
        for (position, (task, first)) in (0_u32..).zip(ranges) {
            let shard = Shard {
                id: id(number + 1 + position),
                task,
                first_episode: first,
                end_episode: first + 2,
                recording: None,
            };
            let (values, job) = match committed_faults.get(position as usize) {
                Some(faults) => {
                    let played = shard_commit(&shard, *faults);
                    let values = format!(
                        "{MORNING_MS}, '{}', '{}', {faults}, '{}'",
                        old_recording(number, position),
                        serde_json::to_string(&played.outcomes).unwrap(),
                        played.log
                    );
                    (values, OldJob::Done { episodes_done: 2 })
                }
                None => ("NULL, NULL, NULL, NULL, NULL".to_owned(), open),
            };
            self.execute(format!(
                "INSERT INTO shards VALUES ('{0}', '{1}', {position}, '{task}', {first}, {first} + 2,
                                            {values})",
                shard.id,
                id_text(number)
            ))
            .await;
            let references = format!("'{}', '{}'", id_text(number), shard.id);
            self.insert_job(
                "shard",
                job,
                team,
                "evaluation_id, shard_id",
                &references,
                number + 1 + position,
            )
            .await;
        }
    }

    /// Inserts the scoring job of an evaluation.
    async fn insert_scoring(&mut self, evaluation: u32, job: OldJob) {
        let value = format!("'{}'", id_text(evaluation));
        let team = evaluation / 100;
        self.insert_job(
            "finalise",
            job,
            team,
            "evaluation_id",
            &value,
            evaluation + 50,
        )
        .await;
    }

    /// Inserts an ablation: a run for each profile and task. Its first runs have the jobs `first`, the others `rest`. Jobs that
    /// are done have outcomes, unless the ablation was stopped (`is_stopped`) by an agent fault.
    async fn insert_ablation(
        &mut self,
        number: u32,
        end_values: &str,
        first: &[OldJob],
        rest: OldJob,
        is_stopped: bool,
    ) {
        let team = number / 1000;
        let created_at = MORNING_MS + i64::from(number);
        self.execute(format!(
            "INSERT INTO ablations VALUES ('{}', '{}', 2, 1, {created_at}, {end_values})",
            id_text(number),
            id_text(team)
        ))
        .await;
        let runs = ABLATION_PROFILES
            .into_iter()
            .flat_map(|profile| TASKS.map(|task| (profile, task)));
        for (index, (profile, task)) in (0_u32..).zip(runs) {
            let job = first.get(index as usize).copied().unwrap_or(rest);
            let outcomes = match job {
                OldJob::Done { .. } if !is_stopped => {
                    let outcomes = [outcome(task, 0, true), outcome(task, 1, false)];
                    format!("'{}'", serde_json::to_string(&outcomes).unwrap())
                }
                _ => "NULL".to_owned(),
            };
            let run = number + 1 + index;
            self.execute(format!(
                "INSERT INTO ablation_runs VALUES ('{}', '{}', '{profile}', '{task}', {outcomes})",
                id_text(run),
                id_text(number)
            ))
            .await;
            let value = format!("'{}'", id_text(run));
            self.insert_job("ablation", job, team, "ablation_run_id", &value, run + 100)
                .await;
        }
    }
}

fn old_recording(evaluation: u32, position: u32) -> String {
    format!("recordings/{}/x/{position}", id_text(evaluation))
}

/// Values of the columns that describe an evaluation's end (finished_at to reason), while it is open.
const OPEN_END_VALUES: &str = "NULL, NULL, NULL, NULL, NULL, NULL";

/// A folder of the old program with teams, submissions, evaluations and ablations in all states.
async fn old_folder(folder: &Path) {
    let mut old = OldDatabase::new(folder).await;
    let done = OldJob::Done { episodes_done: 0 };
    old.insert_team(1, "validating", OldJob::Queued).await;
    old.insert_team(
        2,
        "validating",
        OldJob::Leased {
            attempts: 2,
            failures: 1,
            episodes_done: 0,
        },
    )
    .await;
    old.insert_team(3, "invalid", done).await;
    old.insert_team(4, "validation_error", OldJob::Dropped)
        .await;
    for team in 11..=18 {
        old.insert_team(team, "valid", done).await;
    }
    old.insert_evaluation(
        1100,
        "2026-03-01",
        "queued",
        OPEN_END_VALUES,
        &[],
        OldJob::Queued,
    )
    .await;
    old.insert_evaluation(
        1200,
        "2026-03-01",
        "running",
        OPEN_END_VALUES,
        &[1],
        OldJob::Leased {
            attempts: 3,
            failures: 2,
            episodes_done: 1,
        },
    )
    .await;
    old.insert_evaluation(
        1300,
        "2026-03-01",
        "finalising",
        OPEN_END_VALUES,
        &[0; 6],
        OldJob::Queued,
    )
    .await;
    old.insert_scoring(1300, OldJob::leased(0)).await;
    let scored = serde_json::to_string(&result(42.0)).unwrap();
    let end_values = format!("{MORNING_MS}, '{scored}', 'datasets/old.zip', NULL, NULL, NULL");
    old.insert_evaluation(
        1400,
        "2026-02-28",
        "finished",
        &end_values,
        &[0; 6],
        OldJob::Queued,
    )
    .await;
    old.insert_scoring(1400, done).await;
    old.execute(format!(
        "INSERT INTO episode_summaries VALUES ('{}', 7, '{{\"old\":1}}')",
        id_text(1400)
    ))
    .await;
    let end_values = format!("{MORNING_MS}, NULL, NULL, '[]', 'as stored', NULL");
    old.insert_evaluation(
        1500,
        "2026-03-01",
        "agent_failed",
        &end_values,
        &[2, 2],
        OldJob::Dropped,
    )
    .await;
    let end_values = format!("{MORNING_MS}, NULL, NULL, NULL, NULL, 'disk full'");
    old.insert_evaluation(
        1600,
        "2026-03-01",
        "platform_failed",
        &end_values,
        &[0],
        OldJob::Dropped,
    )
    .await;
    let end_values = format!("{MORNING_MS}, NULL, NULL, NULL, NULL, 'rain'");
    old.insert_evaluation(
        1700,
        "2026-03-01",
        "cancelled",
        &end_values,
        &[0; 6],
        OldJob::Queued,
    )
    .await;
    old.insert_scoring(1700, OldJob::Dropped).await;
    // Ablations: open, finished, ended by an agent fault, and ended by a platform fault.
    let first = [OldJob::Done { episodes_done: 2 }, OldJob::leased(1)];
    old.insert_ablation(11_000, "NULL, NULL", &first, OldJob::Queued, false)
        .await;
    let end_values = format!("{MORNING_MS} + 9000, NULL");
    old.insert_ablation(
        12_000,
        &end_values,
        &[],
        OldJob::Done { episodes_done: 2 },
        false,
    )
    .await;
    let end_values = format!("{MORNING_MS} + 9000, 'too many faults'");
    old.insert_ablation(
        13_000,
        &end_values,
        &[OldJob::Done { episodes_done: 2 }],
        OldJob::Dropped,
        true,
    )
    .await;
    let end_values = format!("{MORNING_MS} + 9000, 'disk full'");
    old.insert_ablation(14_000, &end_values, &[], OldJob::Dropped, false)
        .await;
    old.execute(format!(
        "INSERT INTO released_days VALUES ('2026-02-28', {MORNING_MS})"
    ))
    .await;
    let job_count: i64 = sqlx::query_scalar("SELECT COUNT(*) FROM work_units")
        .fetch_one(&mut old.connection)
        .await
        .unwrap();
    // Jobs of 12 validation runs, of the shards of 7 evaluations, of 3 scorings, and of the runs of 4 ablations.
    assert_eq!(job_count, 12 + 7 * 6 + 3 + 4 * 18);
    old.connection.close().await.unwrap();
}

/// The migrated store, half an hour after the old program's last change.
async fn migrated_store() -> TestStore {
    let folder = tempfile::tempdir().unwrap();
    old_folder(folder.path()).await;
    let store = Store::open(folder.path()).await.unwrap();
    TestStore {
        store,
        folder,
        // Leases of the old program are valid for another half hour.
        now: "2026-03-01T08:30:00Z".parse().unwrap(),
    }
}

#[tokio::test]
async fn migration_keeps_all_old_rows() {
    let f = migrated_store().await;
    let submission = async |number| f.store.submission(id(number)).await.unwrap();
    assert_eq!(submission(1).await.state, SubmissionState::Validating);
    // The teams' tokens are valid.
    let token = *blake3::hash(&11_u32.to_le_bytes()).as_bytes();
    let verified = f
        .store
        .verify_token(token, TokenKind::ApiToken, f.now)
        .await
        .unwrap();
    let team = f.store.team(id(11)).await.unwrap();
    assert_eq!(
        verified.map(|token| token.principal),
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
    let error = SubmissionState::PlatformFailed { reason };
    assert_eq!(submission(4).await.state, error);
    assert_eq!(submission(11).await.state, SubmissionState::Valid);

    let finished_at = jiff::Timestamp::from_millisecond(MORNING_MS).unwrap();
    let expected = [
        (1100, EvaluationState::Queued),
        (
            1200,
            EvaluationState::Running {
                progress: RunProgress {
                    // Two of the committed shard, and one of each of the five leased shards.
                    episodes_done: 2 + 5,
                    commits: vec![ShardProgress {
                        committed_at: finished_at,
                        episodes: 2,
                    }],
                },
                episodes_total: 12,
            },
        ),
        (1300, EvaluationState::Scoring),
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
        assert_eq!(evaluation.plan, six_shard_plan());
        let expected_date = if number == 1400 {
            date(2026, 2, 28)
        } else {
            date(2026, 3, 1)
        };
        assert_eq!(evaluation.stage_day.date, expected_date);
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
    // The evaluation's faults and log are those of its shards, which are kept.
    let failed = f.store.evaluation(id(1500)).await.unwrap();
    let RunFaults { faults, log } = f.store.run_faults(failed.run).await.unwrap();
    assert_eq!(faults.len(), 4);
    assert!(
        log.contains("log of hit 0\n") && log.contains("log of hit 2\n"),
        "{log}"
    );

    let dates = [date(2026, 2, 28), date(2026, 3, 1)];
    // A day's cutoff is the time of its first evaluation. The first day is released; the second has three open evaluations.
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
            (day(dates[1], None), 0),
            (day(dates[0], Some(finished_at)), 1)
        ]
    );
    assert_eq!(f.store.season().await.unwrap().name, "Old season");
    for number in [11, 18] {
        assert!(
            submission(number).await.active,
            "the newest valid submission is active"
        );
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
        .bind(id_text(1400))
        .execute(&mut connection)
        .await
        .unwrap();
    connection.close().await.unwrap();

    let store = Store::open(folder.path()).await.unwrap();
    let stage = store.stages().await.unwrap().remove(0);
    assert_eq!(stage.name.as_str(), "Qualifying");
    assert!(
        !stage.seeds_derive_from_id,
        "the seeds of its days derive from the dates alone, as before there were stages"
    );
    assert!(
        stage.configured,
        "its rules are those of the configuration file"
    );
    let revisions = store.stage_revisions(stage.id).await.unwrap();
    let revisions: Vec<_> = revisions
        .iter()
        .map(|revision| {
            let rules = &revision.rules;
            (revision.number, rules.profile, rules.ruleset)
        })
        .collect();
    assert_eq!(
        revisions,
        [
            (1, IDEAL, faceoff_airhockey::RULESETS[0]),
            (2, EVALUATION, faceoff_airhockey::RULESETS[0])
        ]
    );
    let revision = async |number| store.evaluation(id(number)).await.unwrap().revision;
    assert_eq!((revision(1400).await, revision(1100).await), (1, 2));
    assert_eq!(store.board(stage.id, 1).await.unwrap().len(), 1);

    // The configuration of before, but with the ruleset of the new program, which is a new revision.
    let (rules, settings) = rules_and_settings(&six_shard_plan());
    let now = "2026-03-01T08:30:00Z".parse().unwrap();
    let change = store.configure_stage(rules.clone(), settings, IanaTimeZone::UTC, now);
    change.await.unwrap();
    let stage = store.stages().await.unwrap().remove(0);
    assert_eq!((stage.revision.number, stage.revision.rules), (3, rules));
}

#[tokio::test]
async fn migration_splits_old_ablations_into_runs() {
    let f = migrated_store().await;
    let newest_ablation = async |team| f.store.newest_ablation(id(team)).await.unwrap().unwrap();
    let finished_at = jiff::Timestamp::from_millisecond(MORNING_MS + 9000).unwrap();
    let expected = [
        (
            11,
            AblationState::Unfinished {
                progress: RunProgress {
                    episodes_done: 3,
                    commits: vec![ShardProgress {
                        committed_at: finished_at + jiff::SignedDuration::from_secs(2),
                        episodes: 2,
                    }],
                },
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
        let ablation = newest_ablation(team).await;
        assert_eq!(ablation.id, id(1000 * team));
        assert_eq!(ablation.state, state);
        assert_eq!(ablation.episodes_per_task, 2);
        let profiles: HashSet<_> = ablation.runs.keys().copied().collect();
        assert_eq!(profiles, HashSet::from(ABLATION_PROFILES));
    }
    for run in newest_ablation(12).await.runs.into_values() {
        let outcomes = f.store.outcomes(run).await.unwrap();
        let played: Vec<_> = outcomes
            .iter()
            .map(|outcome| (outcome.task, outcome.episode))
            .collect();
        let expected: Vec<_> = TASKS
            .into_iter()
            .flat_map(|task| [(task, 0), (task, 1)])
            .collect();
        assert_eq!(played, expected);
        assert_eq!(f.store.run_faults(run).await.unwrap().faults.len(), 3);
    }
}

#[tokio::test]
async fn migration_keeps_leases_and_failure_counts() {
    let mut f = migrated_store().await;
    // The second shard of evaluation 1200 is leased, with two failures.
    let claim = JobClaim {
        job: id(1202),
        nonce: id(51_202),
        holder: "old/slot-0".into(),
        lease_until: f.now,
    };
    assert!(f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap());
    let run = f.store.evaluation(id(1200)).await.unwrap().run;
    assert_eq!(
        claim.recording_key(run),
        format!(
            "recordings/{}/{}/{}",
            id_text(1200),
            id_text(1202),
            id_text(51_202)
        ),
        "the key of the old program"
    );
    let shard = f.store.shards(run).await.unwrap().remove(1);
    assert_eq!(f.commit_shard(&claim, &shard).await, CommitOutcome::Stored);

    let claim = JobClaim {
        job: id(1203),
        nonce: id(51_203),
        ..claim
    };
    // The third shard has two failures, too.
    let failures_left = MAX_PLATFORM_FAULTS - 2;
    for failure in 1..=failures_left {
        let shard_claim = if failure == 1 {
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
            .release_after_platform_fault(&shard_claim, "no disk", f.now)
            .await
            .unwrap();
        f.advance_clock_s(60);
    }
    assert!(matches!(
        f.state(id(1200)).await,
        EvaluationState::PlatformFailed { .. }
    ));
}

#[tokio::test]
async fn migrated_queue_continues() {
    let mut f = migrated_store().await;
    assert!(f.store.end_leases_of("old", f.now).await.unwrap() > 0);
    f.advance_clock_s(3600);
    let secret = Seed::from_bytes(SECRET);
    let (mut validations, mut shards, mut ablation_shards) = (0, 0, 0);
    while let Some(ClaimedJob { claim, job }) = f.claim().await {
        match job {
            Job::Validation { submission, .. } => {
                validations += 1;
                assert!([id(1), id(2)].contains(&submission.id));
                let outcome = valid_outcome("native", "a", "");
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
                let mut played = shard_commit(&shard, 0);
                match owner {
                    RunOwner::Evaluation { .. } => {
                        shards += 1;
                        assert_eq!(ablation_shards, 0, "ablations run last");
                        assert_eq!(seeds.episodes, secret.day(date(2026, 3, 1)));
                    }
                    RunOwner::Ablation(ablation) => {
                        ablation_shards += 1;
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
                f.finish_scoring(&claim, 1.0, "datasets/new.zip").await;
            }
        }
    }
    assert_eq!((validations, shards, ablation_shards), (2, 6 + 5, 17));
    for number in [1100, 1200, 1300] {
        assert!(matches!(
            f.state(id(number)).await,
            EvaluationState::Finished { .. }
        ));
    }
    let ablation = f.store.newest_ablation(id(11)).await.unwrap().unwrap();
    assert!(matches!(ablation.state, AblationState::Finished { .. }));
    assert_eq!(f.board().await.len(), 4);
    // The last evaluation released the day, whose cutoff has passed.
    assert_eq!(
        f.store
            .newest_day(f.configure_stage(&six_shard_plan()).await)
            .await
            .unwrap()
            .unwrap()
            .released_at,
        Some(f.now)
    );
    let repeated = f.start_day(&six_shard_plan()).await;
    assert!(
        matches!(repeated, Err(StoreError::CutoffPassed { .. })),
        "{repeated:?}"
    );
    let rerun = f.store.rerun_evaluation(Actor::Operator, id(1600), f.now);
    assert_eq!(rerun.await.unwrap().submission, id(16));
    // Old recordings are deleted a day after the end of their evaluation, like new ones.
    f.advance_clock_s(86_400);
    assert_eq!(f.store.remove_old_recordings(f.now).await.unwrap(), 7);
    let started = f.start_day(&six_shard_plan()).await;
    let teams: Vec<_> = started
        .unwrap()
        .iter()
        .map(|evaluation| evaluation.team)
        .collect();
    let valid_teams: Vec<TeamId> = [1, 2, 11, 12, 13, 14, 15, 16, 17, 18].map(id).to_vec();
    assert_eq!(teams, valid_teams);
}
