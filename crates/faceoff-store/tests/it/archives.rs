//! Export of the database to an archive, and its import. An archive has two editions: the organisers' edition with all data of
//! the season, and the public edition without private data.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use sqlx::{AssertSqlSafe, Connection, SqliteConnection};
use std::{collections::BTreeMap, path::Path, time::Duration};

/// Columns of the tables in the public archive. A new column must be reviewed in `scrub_archive.rs` (is it public?) and then
/// listed here. A table that is not listed is emptied there.
const PUBLIC_COLUMNS: &[(&str, &str)] = &[
    ("ablation_runs", "ablation_id run_id"),
    (
        "ablations",
        "created_at finished_at id reason submission_id",
    ),
    ("announcements", "at id text title"),
    (
        "archived",
        "commitment edition id imported_at made_at program",
    ),
    ("archived_seeds", "day seed stage_id"),
    ("contestants", "run_id side submission_id"),
    (
        "days",
        "cutoff_at day deadline_at is_final missed_for released_at stage_id",
    ),
    ("divisions", "name position"),
    (
        "entrants",
        "entered_at from_round left_as left_at left_for team_id tournament_id",
    ),
    ("episode_summaries", "run_id summary version"),
    (
        "evaluations",
        "created_at dataset dataset_blake3 dataset_bytes dataset_gone dataset_removed_at dataset_removed_for day extra_for finished_at id proposal_id published_at purpose reason rerun_of result revision \
         run_id slot_ms stage_id state submission_id team_id unplayed voided_at voided_for",
    ),
    ("events", "actor at id kind payload subject_id subject_kind"),
    ("frozen_boards", "frozen_at reason stage_id"),
    (
        "game_attempts",
        "away_blake3 away_log begun_at ended_at game_blake3 game_id home_blake3 home_log number outcome reason recording score worker",
    ),
    (
        "games",
        "asked_by attempt away_submission_id away_team_id created_at ended_at game_no home_submission_id home_team_id id job_id matchday \
         pairing purpose reason replay round second_half seed state tournament_id",
    ),
    ("lanes", "lane rank served_ms urgency"),
    ("programs", "id schema version"),
    (
        "questions",
        "answer answered_at asked_at id public team_id text",
    ),
    (
        "round_submissions",
        "round submission_id team_id tournament_id",
    ),
    (
        "rounds",
        "byes groups number over_at started_at tournament_id",
    ),
    (
        "runs",
        "cleared_at episodes_per_shard episodes_per_task id keeps_recordings limits max_faults profile recordings_removed_at ruleset \
         seed state tasks variation",
    ),
    (
        "season",
        "closed_at competition_hash competition_id created_at id name paused_at paused_for secret takes_registrations",
    ),
    ("stage_retentions", "retention stage_id"),
    ("stage_revisions", "revision rules since stage_id"),
    (
        "stages",
        "closes_at configured created_at finalised_at finalised_by finalised_without id name names_seeds opens_at \
         settings zone",
    ),
    (
        "submissions",
        "agent_name bundle_blake3 bundle_bytes bundle_file_name bundle_gone bundle_key bundle_removed_at \
         bundle_removed_for created_at deleted_at deleted_by id idempotency_key label log note reason runtime state team_id timing withdrawn_at",
    ),
    (
        "teams",
        "affiliation created_at disqualified_at disqualified_for division id is_baseline link name retired_at retired_by_organiser",
    ),
    ("terms", "since text version"),
    (
        "tournaments",
        "baseline_id closed_at created_at id name number paused_at paused_for rules settings stage_id",
    ),
];

/// Hash of the secret code in the invitation link of a user, Ada.
const CODE_HASH: [u8; 32] = [7; 32];

async fn open(file: &Path) -> SqliteConnection {
    let url = format!("sqlite://{}", file.display());
    SqliteConnection::connect(&url).await.unwrap()
}

async fn exec(file: &Path, sql: &str) {
    let mut connection = open(file).await;
    sqlx::raw_sql(AssertSqlSafe(sql.to_owned()))
        .execute(&mut connection)
        .await
        .unwrap_or_else(|error| panic!("{sql}: {error}"));
    connection.close().await.unwrap();
}

async fn count(file: &Path, table: &str) -> i64 {
    let sql = format!("SELECT COUNT(*) FROM {table}");
    let rows = sqlx::query_scalar(AssertSqlSafe(sql));
    rows.fetch_one(&mut open(file).await).await.unwrap()
}

/// A folder with the database of an archive of this edition, with an empty episode summary of each run.
async fn export(f: &TestStore, edition: Edition) -> tempfile::TempDir {
    let runs = f.store.unsummarised_runs(1).await.unwrap();
    let summaries = MissingSummaries {
        version: 1,
        json_by_run: runs.iter().map(|run| (*run, "{}".to_owned())).collect(),
    };
    let folder = tempfile::tempdir().unwrap();
    let snapshot = f
        .store
        .snapshot(folder.path(), edition, "a test", &summaries, f.now)
        .await
        .unwrap();
    let file = folder.path().join("faceoff.sqlite3");
    snapshot.finish(&file).await.unwrap();
    let files = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files, 1, "the intermediate copy is deleted");
    folder
}

fn database(folder: &tempfile::TempDir) -> std::path::PathBuf {
    folder.path().join("faceoff.sqlite3")
}

/// A season with a finished day, a user, a webhook and queued jobs. Returns the finished evaluation.
async fn season_with_queued_day() -> (TestStore, EvaluationId) {
    let mut f = TestStore::new().await;
    let alpha = f.valid_submission_of("Alpha").await;
    let finished = f.evaluate(alpha.id, &one_shard_plan()).await.id;
    f.run_all_with_score(1.0).await;
    let invitation = NewInvitation {
        code_hash: CODE_HASH,
        role: InvitationRole::Member(alpha.team),
        note: "Ada".into(),
        requester: Requester::default(),
        expires_at: f.now + jiff::SignedDuration::from_hours(1),
    };
    f.store
        .invite(Actor::Operator, invitation, f.now)
        .await
        .unwrap();
    f.store
        .join(join_request(CODE_HASH, "Ada"), f.now)
        .await
        .unwrap();
    let webhook = NewWebhook {
        team: Some(alpha.team),
        name: "hook".into(),
        url: "https://example.org/".into(),
        topics: Vec::new(),
        secret: [9; 32],
        requester: Requester::default(),
    };
    let webhook = f.store.create_webhook(Actor::Operator, webhook, f.now);
    let webhook = webhook.await.unwrap().id;
    let delivery = f.store.test_webhook(webhook, "test", "{}", f.now);
    delivery.await.unwrap();
    f.advance_clock_s(24 * 3600);
    f.valid_submission_of("Beta").await;
    f.evaluate(alpha.id, &one_shard_plan()).await;
    (f, finished)
}

#[tokio::test]
async fn public_archive_has_only_listed_columns() {
    let (f, _) = season_with_queued_day().await;
    let folder = export(&f, Edition::Public).await;
    let mut connection = open(&database(&folder)).await;
    let tables: Vec<String> = sqlx::query_scalar(
        "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite%' ORDER BY name",
    )
    .fetch_all(&mut connection)
    .await
    .unwrap();
    let public_columns: BTreeMap<&str, &str> = PUBLIC_COLUMNS.iter().copied().collect();
    for table in tables {
        if table == "_sqlx_migrations" {
            continue;
        }
        let Some(expected) = public_columns.get(table.as_str()) else {
            assert_eq!(count(&database(&folder), &table).await, 0, "{table}");
            continue;
        };
        let sql = format!("SELECT name FROM pragma_table_info('{table}') ORDER BY name");
        let columns: Vec<String> = sqlx::query_scalar(AssertSqlSafe(sql))
            .fetch_all(&mut connection)
            .await
            .unwrap();
        assert_eq!(columns.join(" "), *expected, "{table}");
    }
}

#[tokio::test]
async fn archive_omits_open_evaluations_and_credentials() {
    let (f, finished) = season_with_queued_day().await;
    assert_eq!(
        count(&f.folder.path().join("faceoff.sqlite3"), "evaluations").await,
        3
    );
    for edition in [Edition::Organiser, Edition::Public] {
        let folder = export(&f, edition).await;
        let file = database(&folder);
        for (table, rows) in [
            ("evaluations", 1),
            ("tokens", 0),
            ("invitations", 0),
            ("webhooks", 0),
            ("webhook_deliveries", 0),
            ("days", 2),
        ] {
            assert_eq!(count(&file, table).await, rows, "{edition}: {table}");
        }
        let mut connection = open(&file).await;
        let waiting: i64 =
            sqlx::query_scalar("SELECT COUNT(*) FROM jobs WHERE state IN ('queued', 'leased')")
                .fetch_one(&mut connection)
                .await
                .unwrap();
        assert_eq!(waiting, 0);
        let secret: Vec<u8> = sqlx::query_scalar("SELECT secret FROM season")
            .fetch_one(&mut connection)
            .await
            .unwrap();
        assert_eq!(secret, [0; 32]);
        connection.close().await.unwrap();

        Store::import(folder.path(), f.now).await.unwrap();
        let imported = Store::open(folder.path()).await.unwrap();
        let (season, imported_season) = (
            f.store.season().await.unwrap(),
            imported.season().await.unwrap(),
        );
        // The commitment is the published hash of the season's secret.
        assert_eq!(
            imported_season.commitment, season.commitment,
            "the commitment stays"
        );
        let (stages, days) = (
            imported.stages().await.unwrap(),
            imported.days().await.unwrap(),
        );
        let days: Vec<StageDay> = days.into_iter().map(|(day, _)| day.stage_day).collect();
        let seeds = imported
            .day_seeds(&imported_season, &stages, days.iter().copied())
            .await
            .unwrap();
        // The newest day comes first; only the older one is released.
        let released = days[1];
        let expected = BTreeMap::from([(
            released,
            stages[0].seed_label(released.date).seed(&season.secret),
        )]);
        assert_eq!(seeds, expected, "seeds of released days only");
        assert_eq!(
            imported.evaluation(finished).await.unwrap(),
            f.store.evaluation(finished).await.unwrap()
        );
    }
}

#[tokio::test]
async fn public_archive_has_results_without_episodes() {
    let f = TestStore::new().await;
    let alpha = f.valid_submission_of("Alpha").await;
    let evaluation = f.evaluate(alpha.id, &one_shard_plan()).await;
    f.run_all_with_score(1.0).await;
    // Without an episode summary a public archive could not show the board.
    let no_summaries = MissingSummaries::default();
    let public = f.store.snapshot(
        f.folder.path(),
        Edition::Public,
        "a test",
        &no_summaries,
        f.now,
    );
    let error = public.await.unwrap_err();
    assert!(
        matches!(&error, StoreError::Conflict(reason) if reason.contains("1 results came in")),
        "{error}"
    );

    let folder = export(&f, Edition::Public).await;
    for table in ["shards", "jobs"] {
        assert_eq!(count(&database(&folder), table).await, 0, "{table}");
    }
    Store::import(folder.path(), f.now).await.unwrap();
    let imported = Store::open(folder.path()).await.unwrap();
    let summaries = imported
        .episode_summaries(&[evaluation.run], 1)
        .await
        .unwrap();
    assert_eq!(summaries.len(), 1);
    let unsummarised = f.store.unsummarised_runs(1).await.unwrap();
    assert_eq!(
        unsummarised,
        [evaluation.run],
        "only the copy has the summary"
    );
    let outcomes = imported.outcomes(evaluation.run).await;
    assert!(
        matches!(outcomes, Err(StoreError::OutcomesRemoved { at }) if at == f.now),
        "{outcomes:?}"
    );
    let submission = imported.submission(alpha.id).await.unwrap();
    assert_eq!(submission.runtime, None, "the runtime is private");
}

#[tokio::test]
async fn public_archive_omits_reinstatements_and_private_answers() {
    let f = TestStore::new().await;
    let [alpha, beta] = f.two_valid_submissions().await;
    f.evaluate(alpha.id, &one_shard_plan()).await;
    f.run_all_with_score(1.0).await;
    for (team, reason) in [(alpha.team, "it copied"), (beta.team, "it attacked")] {
        let disqualified = f
            .store
            .disqualify_team(Actor::Operator, team, reason, f.now);
        disqualified.await.unwrap();
    }
    let reinstated = f
        .store
        .reinstate_team(Actor::Operator, alpha.team, "it did not copy", f.now);
    reinstated.await.unwrap();
    for public in [true, false] {
        let question = f
            .store
            .ask(Actor::Team(beta.team), beta.team, "how?", f.now)
            .await
            .unwrap();
        let answer = f
            .store
            .answer(Actor::Operator, question.id, "so", public, f.now);
        answer.await.unwrap();
    }
    let folder = export(&f, Edition::Public).await;
    Store::import(folder.path(), f.now).await.unwrap();
    let imported = Store::open(folder.path()).await.unwrap();
    let mut connection = open(&database(&folder)).await;
    let disqualifications: Vec<(String, String)> = sqlx::query_as(
        "SELECT subject_id, payload FROM events WHERE kind LIKE 'team_%' AND kind <> 'team_created'",
    )
    .fetch_all(&mut connection)
    .await
    .unwrap();
    assert_eq!(disqualifications.len(), 1, "{disqualifications:?}");
    assert_eq!(disqualifications[0].0, beta.team.to_string());
    assert!(disqualifications[0].1.contains("it attacked"));
    let questions = imported.questions().await.unwrap();
    assert_eq!(questions.len(), 1);
    assert_eq!((&*questions[0].text, questions[0].team), ("how?", None));
}

#[tokio::test]
async fn snapshot_is_unaffected_by_later_changes() {
    let (f, finished) = season_with_queued_day().await;
    let folder = tempfile::tempdir().unwrap();
    let snapshot = f
        .store
        .snapshot(
            folder.path(),
            Edition::Organiser,
            "a test",
            &MissingSummaries::default(),
            f.now,
        )
        .await
        .unwrap();
    assert_eq!(snapshot.open_evaluations, 2);
    let before = snapshot.store().evaluation(finished).await.unwrap();
    f.store
        .void_evaluation(Actor::Operator, finished, "a mistake", f.now)
        .await
        .unwrap();
    assert_eq!(snapshot.store().evaluation(finished).await.unwrap(), before);
    assert_eq!(before.voided, None);
    let renamed = snapshot
        .store()
        .name_season(Actor::Server, "x", f.now)
        .await;
    assert!(
        matches!(renamed, Err(StoreError::Archived { .. })),
        "{renamed:?}"
    );
    let artifacts = snapshot.artifacts_to_archive().await.unwrap();
    assert_eq!(artifacts.len(), 2, "two bundles: {artifacts:?}");
}

#[tokio::test]
async fn public_archive_cannot_become_organiser_edition() {
    let (f, _) = season_with_queued_day().await;
    let folder = export(&f, Edition::Public).await;
    Store::import(folder.path(), f.now).await.unwrap();
    let imported = Store::open(folder.path()).await.unwrap();
    let other = tempfile::tempdir().unwrap();
    let none = MissingSummaries::default();
    let snapshot = imported.snapshot(other.path(), Edition::Organiser, "a test", &none, f.now);
    let error = snapshot.await.unwrap_err();
    assert!(error.to_string().contains("public archive"), "{error}");
    assert!(
        imported
            .snapshot(
                other.path(),
                Edition::Public,
                "a test",
                &MissingSummaries::default(),
                f.now
            )
            .await
            .is_ok()
    );
    assert!(imported.users().await.unwrap().is_empty());
}

#[tokio::test]
async fn archive_detection_leaves_folder_unchanged() {
    let empty = tempfile::tempdir().unwrap();
    assert_eq!(Store::archived_in(empty.path()).await.unwrap(), None);
    assert_eq!(std::fs::read_dir(empty.path()).unwrap().count(), 0);
    let (f, _) = season_with_queued_day().await;
    assert_eq!(Store::archived_in(f.folder.path()).await.unwrap(), None);
    let folder = export(&f, Edition::Public).await;
    let found = Store::archived_in(folder.path()).await.unwrap().unwrap();
    assert_eq!(
        (found.edition, found.made_at, found.imported_at),
        (Edition::Public, f.now, None)
    );
    // A database of a version without archives.
    exec(&database(&folder), "DROP TABLE archived").await;
    assert_eq!(Store::archived_in(folder.path()).await.unwrap(), None);
}

#[tokio::test]
async fn import_refuses_manipulated_database() {
    let (f, _) = season_with_queued_day().await;
    // Would create a token of the operator, during the import.
    let planted_trigger = "CREATE TRIGGER help AFTER UPDATE ON archived BEGIN
        INSERT INTO tokens (id, hash, kind, owner, name, created_at)
        VALUES ('0', zeroblob(32), 'key', 'host', 'mine', 0); END";
    for (sql, phrase) in [
        (planted_trigger, "its trigger \"help\" is not as this program makes it"),
        ("CREATE VIEW notes AS SELECT 1", "its view \"notes\""),
        ("CREATE TABLE more (a)", "its table \"more\""),
        ("DROP TRIGGER a_closed_season_stays_closed", "its trigger \"a_closed_season_stays_closed\""),
        ("DROP TABLE archived", "not that of an archived season"),
        ("DELETE FROM archived", "its description of the archive is missing"),
        ("PRAGMA foreign_keys = OFF; DELETE FROM teams", "refer to missing rows"),
        (
            "INSERT INTO _sqlx_migrations SELECT 9999, 'later', installed_on, success, checksum, execution_time
             FROM _sqlx_migrations LIMIT 1",
            "a later version of Faceoff made it (its migration 9999",
        ),
        ("UPDATE _sqlx_migrations SET checksum = zeroblob(48) WHERE version = 1", "migration 1"),
    ] {
        let folder = export(&f, Edition::Organiser).await;
        exec(&database(&folder), sql).await;
        let error = Store::import(folder.path(), f.now).await.unwrap_err();
        let StoreError::Conflict(reason) = error else {
            panic!("{sql}: {error}");
        };
        assert!(reason.contains(phrase), "{phrase:?} is not in {reason:?}");
    }
    for content in [&b"no database at all"[..], b""] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(database(&folder), content).unwrap();
        let error = Store::import(folder.path(), f.now).await.unwrap_err();
        assert!(error.to_string().contains("database is refused"), "{error}");
    }
    // A database with overwritten pages (its page size is 4096 bytes).
    let folder = export(&f, Edition::Organiser).await;
    let mut bytes = std::fs::read(database(&folder)).unwrap();
    let length = bytes.len();
    bytes[4096..length.min(40_960)].fill(0xff);
    std::fs::write(database(&folder), bytes).unwrap();
    let error = Store::import(folder.path(), f.now).await.unwrap_err();
    assert!(error.to_string().contains("refused"), "{error}");
}

#[tokio::test]
async fn import_reads_no_view_in_place_of_a_table() {
    let (f, _) = season_with_queued_day().await;
    let endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)";
    let migrations = format!(
        "PRAGMA foreign_keys = OFF; DROP TABLE _sqlx_migrations; CREATE VIEW _sqlx_migrations AS {endless}
         SELECT i AS version, 'more' AS description, 0 AS installed_on, 1 AS success, zeroblob(48) AS checksum,
         0 AS execution_time FROM n"
    );
    let archived = format!(
        "DROP TABLE archived; CREATE VIEW archived AS {endless} SELECT i AS id, 'public' AS edition FROM n"
    );
    let teams = format!(
        "PRAGMA foreign_keys = OFF; PRAGMA legacy_alter_table = ON; ALTER TABLE teams RENAME TO other_teams;
         CREATE VIEW teams AS {endless} SELECT i AS id FROM n"
    );
    for (sql, phrase) in [
        (&migrations, "its table of migrations is not as"),
        (&archived, "not that of an archived season"),
        (&teams, "is not as this program makes it"),
    ] {
        let folder = export(&f, Edition::Organiser).await;
        exec(&database(&folder), sql).await;
        let before = std::fs::read(database(&folder)).unwrap();
        let error = Store::import(folder.path(), f.now).await.unwrap_err();
        assert!(error.to_string().contains(phrase), "{sql}: {error}");
        assert_eq!(
            std::fs::read(database(&folder)).unwrap(),
            before,
            "a refused database is not written to"
        );
    }
}

#[tokio::test]
async fn import_ends_at_its_deadline() {
    let (f, _) = season_with_queued_day().await;
    let folder = export(&f, Edition::Organiser).await;
    let rows = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 100000)
        INSERT INTO events (at, actor, subject_kind, subject_id, kind, payload)
        SELECT 0, 'server', 'season', '', 'season_opened', '{}' FROM n";
    exec(&database(&folder), rows).await;
    let imported = Store::import_within(folder.path(), f.now, Duration::ZERO).await;
    let error = imported.unwrap_err().to_string();
    assert!(error.contains("takes longer than"), "{error}");
}

#[tokio::test]
async fn import_of_an_earlier_schema_migrates_it() {
    let (f, _) = season_with_queued_day().await;
    let folder = export(&f, Edition::Organiser).await;
    let newest = "SELECT MAX(version) FROM _sqlx_migrations";
    let mut connection = open(&database(&folder)).await;
    let newest: i64 = sqlx::query_scalar(newest)
        .fetch_one(&mut connection)
        .await
        .unwrap();
    // A database that claims to be older than its schema is.
    let sql = format!("DELETE FROM _sqlx_migrations WHERE version = {newest}");
    exec(&database(&folder), &sql).await;
    let error = Store::import(folder.path(), f.now).await.unwrap_err();
    assert!(
        error
            .to_string()
            .contains("is not as this program makes it"),
        "{error}"
    );
    let undo = "DROP INDEX submissions_by_idempotency_key; ALTER TABLE submissions DROP COLUMN idempotency_key";
    exec(&database(&folder), undo).await;
    Store::import(folder.path(), f.now).await.unwrap();
}

#[tokio::test]
async fn import_removes_planted_credentials() {
    let (f, _) = season_with_queued_day().await;
    let folder = export(&f, Edition::Organiser).await;
    let planted = "INSERT INTO tokens (id, hash, kind, owner, name, created_at)
               VALUES ('00000000-0000-7000-8000-000000000000', zeroblob(32), 'key', 'host', 'mine', 0);
               UPDATE people SET password = '$argon2id$v=19$m=19456,t=2,p=1$AAAA$AAAA'";
    exec(&database(&folder), planted).await;
    Store::import(folder.path(), f.now).await.unwrap();
    let imported = Store::open(folder.path()).await.unwrap();
    let tokens = imported.tokens_after(TokenFilter::Everyone, None, 10).await;
    assert!(tokens.unwrap().unwrap().is_empty());
    let verified = imported
        .verify_token([0; 32], TokenKind::ApiToken, f.now)
        .await
        .unwrap();
    assert!(verified.is_err(), "{verified:?}");
    let passwords = "SELECT COUNT(*) FROM people WHERE password IS NOT NULL";
    let count: i64 = sqlx::query_scalar(passwords)
        .fetch_one(&mut open(&database(&folder)).await)
        .await
        .unwrap();
    assert_eq!(count, 0);
    // The new server's own token works.
    assert!(imported.set_operator_token([9; 32], f.now).await.unwrap());
    let verified = imported
        .verify_token([9; 32], TokenKind::ApiToken, f.now)
        .await
        .unwrap();
    assert!(matches!(verified.unwrap().principal, Principal::Operator));
}

#[tokio::test]
async fn public_archive_has_only_games_that_count() {
    let f = TestStore::new().await;
    let teams = [
        f.valid_submission_of("Alpha").await.team,
        f.valid_submission_of("Beta").await.team,
    ];
    let tournament = NewTournament {
        name: "Cup".parse().unwrap(),
        stage: None,
        rules: faceoff_airhockey::competition().tournament_rules(),
        settings: TournamentSettings::default(),
        entrants: teams.to_vec(),
    };
    let cup = f
        .store
        .open_tournament(Actor::Operator, &tournament, f.now)
        .await
        .unwrap();
    let friendly =
        f.store
            .request_friendly_game(Actor::Team(teams[0]), cup.id, teams[0], teams[1], f.now);
    friendly.await.unwrap();
    run_game(&f).await;
    for number in 1..=2 {
        let round = DrawnRound {
            number: RoundNumber::try_from(number).unwrap(),
            groups: Vec::new(),
            matchdays: vec![DrawnMatchday {
                games: vec![teams],
                byes: Vec::new(),
            }],
        };
        f.store
            .start_round(Actor::Operator, cup.id, &round, f.now)
            .await
            .unwrap();
        if number == 1 {
            run_game(&f).await;
        }
    }
    for edition in [Edition::Organiser, Edition::Public] {
        let folder = tempfile::tempdir().unwrap();
        let snapshot = f
            .store
            .snapshot(
                folder.path(),
                edition,
                "a test",
                &MissingSummaries::default(),
                f.now,
            )
            .await
            .unwrap();
        let artifacts = snapshot.artifacts_to_archive().await.unwrap();
        let store = snapshot.store();
        let record = store.tournament_record(cup.id).await.unwrap();
        assert_eq!(record.entrants.len(), 2);
        assert_eq!(record.games.len(), 1, "open games are left out");
        assert!(matches!(record.games[0].state, GameState::Played(_)));
        let game_artifacts = artifacts
            .iter()
            .filter(|artifact| matches!(artifact.owner, ArtifactOwner::Game(_)))
            .count();
        let friendly_games = store
            .games(cup.id, GameFilter::TestAndFriendly(None))
            .await
            .unwrap();
        let log = store
            .game_log(record.games[0].id, Side::First)
            .await
            .unwrap();
        match edition {
            Edition::Organiser => {
                // Three artifacts of each game: the recording of the game and those of its sides.
                assert_eq!((game_artifacts, friendly_games.len()), (6, 1));
                assert_eq!(log.as_deref(), Some("home\n"));
            }
            Edition::Public => {
                assert_eq!(friendly_games.len(), 0);
                assert_eq!(log.as_deref(), Some(""));
                let attempts = store.game_attempts(record.games[0].id).await.unwrap();
                assert_eq!(attempts[0].worker, "");
            }
        }
    }
}

/// Runs the next job, which must be a game with a recording.
async fn run_game(f: &TestStore) {
    let Some(ClaimedJob {
        claim,
        job: Job::Game { .. },
    }) = f.claim().await
    else {
        panic!("a game is queued")
    };
    let hash = || "0".repeat(64);
    let commit = GameCommit {
        results: serde_json::json!({}),
        recording: Some(GameRecording {
            key: format!("games/{}", claim.nonce),
            game_blake3: hash(),
            side_blake3: [hash(), hash()],
        }),
        logs: ["home\n".into(), "away\n".into()],
    };
    f.store.commit_game(&claim, &commit, f.now).await.unwrap();
}
