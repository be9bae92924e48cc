//! Scrubbing: removal of everything from a copied database that its archive (the season in one file) must not contain. An archive
//! has two editions: the public one, and one for the organisers. The database's triggers are dropped meanwhile, since they would
//! refuse some of these changes. References between rows are checked at the end.

use crate::{
    error::{Result, StoreError},
    event::Event,
    tables::archive::Edition,
};
use serde_json::Value;
use sqlx::{AssertSqlSafe, SqliteConnection};

/// Tables with rows in the public edition. All others are emptied for it, so a new table is private until it is added
/// here.
const PUBLIC_TABLES: [&str; 29] = [
    "_sqlx_migrations",
    "ablation_runs",
    "ablations",
    "announcements",
    "archived",
    "archived_seeds",
    "contestants",
    "days",
    "divisions",
    "entrants",
    "episode_summaries",
    "evaluations",
    "events",
    "frozen_boards",
    "game_attempts",
    "games",
    "lanes",
    "questions",
    "round_submissions",
    "rounds",
    "runs",
    "season",
    "stage_retentions",
    "stage_revisions",
    "stages",
    "submissions",
    "teams",
    "terms",
    "tournaments",
];

/// Editions of the archive that a step of the scrubbing applies to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Scope {
    Both,
    Public,
}

/// The statements that scrub a copy, in this order: first results are removed, then the rows that belong to removed results.
const STEPS: &[(Scope, &str)] = &[
    // Proposals are for organisers, who get those without an open evaluation.
    (Scope::Both, "DELETE FROM proposals WHERE id IN
        (SELECT proposal_id FROM evaluations WHERE state = 'open' AND purpose <> 'counting')"),
    (Scope::Public, "DELETE FROM proposals"),
    (Scope::Both, "DELETE FROM evaluations WHERE purpose <> 'counting' AND proposal_id NOT IN (SELECT id FROM proposals)"),
    (Scope::Both, "UPDATE evaluations SET proposal_id = NULL WHERE proposal_id NOT IN (SELECT id FROM proposals)"),
    // Open evaluations are no results, and days are secret until their release.
    (Scope::Both, "DELETE FROM evaluations WHERE purpose = 'counting' AND (state = 'open' OR NOT EXISTS
        (SELECT 1 FROM days d WHERE d.stage_id = evaluations.stage_id AND d.day = evaluations.day
           AND d.released_at IS NOT NULL))"),
    // Hidden scores.
    (Scope::Public, "DELETE FROM evaluations WHERE stage_id IN
        (SELECT id FROM stages WHERE json_extract(settings, '$.blind'))"),
    (Scope::Public, "DELETE FROM archived_seeds WHERE stage_id IN
        (SELECT id FROM stages WHERE json_extract(settings, '$.blind'))"),
    (Scope::Public, "DELETE FROM evaluations WHERE EXISTS
        (SELECT 1 FROM frozen_boards f WHERE f.stage_id = evaluations.stage_id
           AND f.frozen_at < evaluations.finished_at)"),
    (Scope::Both, "UPDATE evaluations SET rerun_of = NULL WHERE rerun_of NOT IN (SELECT id FROM evaluations)"),
    (Scope::Both, "DELETE FROM scorings WHERE evaluation_id NOT IN (SELECT id FROM evaluations)"),
    (Scope::Both, "DELETE FROM ablations WHERE finished_at IS NULL"),
    (Scope::Both, "DELETE FROM ablation_runs WHERE ablation_id NOT IN (SELECT id FROM ablations)"),
    // Open games have no result; test and friendly games are visible to their teams only.
    (Scope::Both, "DELETE FROM games WHERE state IN ('queued', 'running')"),
    (Scope::Public, "DELETE FROM games WHERE purpose IN ('test', 'friendly')"),
    (Scope::Both, "DELETE FROM game_attempts WHERE game_id NOT IN (SELECT id FROM games)"),
    // Only the attempts that count are public, without their failed predecessors.
    (Scope::Public, "DELETE FROM game_attempts WHERE NOT EXISTS
        (SELECT 1 FROM games g WHERE g.id = game_attempts.game_id AND g.attempt = game_attempts.number)"),
    (Scope::Public, "UPDATE game_attempts SET worker = '', home_log = '', away_log = ''"),
    // A seed reveals each side's observations in a game: it is zeroed where these are not published.
    (Scope::Public, "UPDATE game_attempts SET score = json_set(score, '$.seed', lower(hex(zeroblob(32))))
        WHERE score ->> '$.seed' IS NOT NULL AND NOT EXISTS
        (SELECT 1 FROM games g JOIN tournaments t ON t.id = g.tournament_id
         LEFT JOIN rounds r ON r.tournament_id = g.tournament_id AND r.number = g.round
         WHERE g.id = game_attempts.game_id AND g.purpose = 'round'
           AND CASE t.settings ->> '$.publishes' WHEN 'at_release' THEN r.over_at IS NOT NULL
                    WHEN 'at_close' THEN t.closed_at IS NOT NULL ELSE 0 END)"),
    (Scope::Public, "UPDATE tournaments SET baseline_id = NULL"),
    (Scope::Both, "DELETE FROM runs WHERE id NOT IN (SELECT run_id FROM evaluations)
        AND id NOT IN (SELECT run_id FROM ablation_runs)"),
    (Scope::Both, "DELETE FROM contestants WHERE run_id NOT IN (SELECT id FROM runs)"),
    (Scope::Both, "DELETE FROM episode_summaries WHERE run_id NOT IN (SELECT id FROM runs)"),
    (Scope::Both, "DELETE FROM shards WHERE run_id NOT IN (SELECT id FROM runs)"),
    // Single episodes are in the datasets, whose access is limited; only their summary is public.
    (Scope::Public, "DELETE FROM shards"),
    (Scope::Public, "UPDATE runs SET cleared_at = COALESCE(cleared_at, (SELECT made_at FROM archived))"),
    // Recordings of shards are not archived.
    (Scope::Both, "UPDATE shards SET recording = NULL"),
    (Scope::Both, "UPDATE runs SET recordings_removed_at = COALESCE(recordings_removed_at,
        (SELECT made_at FROM archived)) WHERE keeps_recordings = 1"),
    (Scope::Both, "DELETE FROM active_submissions WHERE submission_id IN
        (SELECT id FROM submissions WHERE state = 'validating')"),
    (Scope::Both, "DELETE FROM submissions WHERE state = 'validating'"),
    (Scope::Public, "DELETE FROM submissions WHERE id NOT IN (SELECT submission_id FROM evaluations)
        AND id NOT IN (SELECT submission_id FROM ablations) AND id NOT IN (SELECT submission_id FROM contestants)
        AND id NOT IN (SELECT submission_id FROM round_submissions)"),
    (Scope::Public, "UPDATE submissions SET bundle_key = '', bundle_bytes = 0, bundle_blake3 = '', bundle_file_name = '',
        label = NULL, note = NULL, idempotency_key = NULL, timing = NULL, runtime = NULL, withdrawn_at = NULL, deleted_at = NULL, deleted_by = NULL,
        bundle_removed_at = NULL, bundle_removed_for = NULL, bundle_gone = 0, log = CASE WHEN log IS NOT NULL THEN '' END,
        reason = CASE WHEN reason IS NOT NULL THEN '' END"),
    (Scope::Both, "DELETE FROM validation_runs WHERE submission_id NOT IN (SELECT id FROM submissions)"),
    (Scope::Public, "DELETE FROM validation_runs"),
    (Scope::Public, "DELETE FROM scorings"),
    (Scope::Public, "UPDATE games SET job_id = NULL"),
    (Scope::Public, "DELETE FROM questions WHERE public = 0"),
    (Scope::Public, "UPDATE questions SET team_id = NULL"),
    // Only teams that took part are public.
    (Scope::Public, "DELETE FROM teams WHERE disqualified_at IS NULL AND id NOT IN (SELECT team_id FROM evaluations)
        AND id NOT IN (SELECT team_id FROM submissions) AND id NOT IN (SELECT team_id FROM entrants)
        AND id NOT IN (SELECT e.value FROM stages s JOIN json_each(s.finalised_without) e)"),
    (Scope::Public, "UPDATE teams SET retired_by_organiser = 0"),
    // Jobs are never run in an archive, and the workers that ran them are private.
    (Scope::Both, "DELETE FROM jobs WHERE id NOT IN (SELECT job_id FROM shards)
        AND id NOT IN (SELECT job_id FROM validation_runs) AND id NOT IN (SELECT job_id FROM scorings)
        AND id NOT IN (SELECT job_id FROM games WHERE job_id IS NOT NULL)"),
    (Scope::Both, "UPDATE jobs SET state = 'dropped', nonce = NULL WHERE state IN ('queued', 'leased')"),
    (Scope::Both, "UPDATE jobs SET nonce = '' WHERE nonce IS NOT NULL"),
    // The public log: events of removed subjects go (private kinds are removed before), and users are anonymised.
    (Scope::Public, "DELETE FROM events WHERE subject_kind = 'evaluation'
        AND subject_id NOT IN (SELECT id FROM evaluations)"),
    (Scope::Public, "DELETE FROM events WHERE subject_kind = 'team' AND subject_id NOT IN (SELECT id FROM teams)"),
    (Scope::Public, "UPDATE events SET actor = COALESCE((SELECT 'team:' || p.team_id FROM people p
        WHERE p.team_id IS NOT NULL AND events.actor = 'person:' || p.id), 'organiser')
        WHERE actor LIKE 'person:%'"),
    // Whether a team or an organiser withdrew the team is private.
    (Scope::Public, "UPDATE events SET actor = 'team:' || subject_id WHERE kind IN ('team_retired', 'team_returned')"),
    (Scope::Public, "UPDATE events SET actor = 'server' WHERE actor LIKE 'worker:%'"),
    (Scope::Public, "UPDATE stages SET finalised_by = 'organiser' WHERE finalised_by IS NOT NULL"),
    // Credentials of every kind.
    (Scope::Both, "DELETE FROM tokens"),
    (Scope::Both, "DELETE FROM webhook_deliveries"),
    (Scope::Both, "DELETE FROM webhooks"),
    (Scope::Both, "DELETE FROM invitations"),
    (Scope::Both, "UPDATE people SET password = NULL"),
    (Scope::Both, "UPDATE registrations SET code_hash = randomblob(32)"),
    (Scope::Both, "UPDATE season SET secret = zeroblob(32) WHERE closed_at IS NULL"),
];

/// Removes from a copy what its edition of the archive must not contain. Unused pages of the file still hold the
/// removed data, so it must be copied once more.
pub(crate) async fn scrub(
    connection: &mut SqliteConnection,
    edition: Edition,
    summary_version: u32,
) -> Result<()> {
    let triggers: Vec<(String, String)> =
        sqlx::query_as("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'")
            .fetch_all(&mut *connection)
            .await?;
    for (name, _) in &triggers {
        run(connection, format!("DROP TRIGGER {name}")).await?;
    }
    if edition == Edition::Public {
        check_summarised(connection, summary_version).await?;
        remove_lifted_disqualifications(connection).await?;
        keep_public_events(connection).await?;
    }
    for (scope, sql) in STEPS {
        if *scope == Scope::Both || edition == Edition::Public {
            sqlx::query(*sql).execute(&mut *connection).await?;
        }
    }
    if edition == Edition::Public {
        for table in tables(connection).await? {
            if !PUBLIC_TABLES.contains(&table.as_str()) {
                run(connection, format!("DELETE FROM {table}")).await?;
            }
        }
    }
    for (_, sql) in triggers {
        run(connection, sql).await?;
    }
    check_references(connection).await
}

/// Names of all tables except SQLite's own.
async fn tables(connection: &mut SqliteConnection) -> Result<Vec<String>> {
    Ok(sqlx::query_scalar(
        "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite\\_%' ESCAPE '\\'",
    )
    .fetch_all(connection)
    .await?)
}

/// Runs a statement that was built with names from this program's own schema.
async fn run(connection: &mut SqliteConnection, sql: String) -> Result<()> {
    sqlx::query(AssertSqlSafe(sql)).execute(connection).await?;
    Ok(())
}

/// Removes the events whose kind is not public. One event of each kind is parsed to find out whether the kind is public.
async fn keep_public_events(connection: &mut SqliteConnection) -> Result<()> {
    let kinds: Vec<(String, String)> =
        sqlx::query_as("SELECT kind, payload FROM events GROUP BY kind")
            .fetch_all(&mut *connection)
            .await?;
    for (kind, payload) in kinds {
        let event = serde_json::from_str(&payload).map(|mut fields: Value| {
            fields["kind"] = Value::String(kind.clone());
            serde_json::from_value::<Event>(fields)
        });
        let is_public = matches!(event, Ok(Ok(event)) if event.is_public());
        if !is_public {
            sqlx::query("DELETE FROM events WHERE kind = ?")
                .bind(kind)
                .execute(&mut *connection)
                .await?;
        }
    }
    Ok(())
}

/// Refuses to remove the episodes of a result that has no summary yet: with neither, its board could not be
/// shown.
async fn check_summarised(connection: &mut SqliteConnection, version: u32) -> Result<()> {
    let unsummarised: u32 = sqlx::query_scalar(
        "SELECT COUNT(*) FROM runs r
           WHERE r.state = 'played' AND r.cleared_at IS NULL
             AND NOT EXISTS (SELECT 1 FROM episode_summaries s WHERE s.run_id = r.id AND s.version = ?)
             AND (EXISTS (SELECT 1 FROM counting_evaluations e WHERE e.run_id = r.id AND e.state = 'finished')
                  OR EXISTS (SELECT 1 FROM ablation_runs p JOIN ablations a ON a.id = p.ablation_id
                             WHERE p.run_id = r.id AND a.finished_at IS NOT NULL))",
    )
    .bind(version)
    .fetch_one(connection)
    .await?;
    if unsummarised > 0 {
        return StoreError::conflict(format!(
            "{unsummarised} results came in while the season was copied, and their episode summaries are not stored yet: try again"
        ));
    }
    Ok(())
}

/// Removes disqualifications that were lifted. A disqualification is a public event, a reinstatement is not.
async fn remove_lifted_disqualifications(connection: &mut SqliteConnection) -> Result<()> {
    sqlx::query(
        "DELETE FROM events WHERE kind = 'team_disqualified' AND EXISTS
           (SELECT 1 FROM events r WHERE r.kind = 'team_reinstated' AND r.subject_kind = events.subject_kind
              AND r.subject_id = events.subject_id AND r.id > events.id)"
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Refuses dangling references between rows.
pub(crate) async fn check_references(connection: &mut SqliteConnection) -> Result<()> {
    // One is enough: a hostile database may have any number.
    let dangling: Option<(String, String)> =
        sqlx::query_as("SELECT \"table\", parent FROM pragma_foreign_key_check LIMIT 1")
            .fetch_optional(connection)
            .await?;
    match dangling {
        None => Ok(()),
        Some((table, parent)) => Err(StoreError::Damaged(format!(
            "rows refer to missing rows, for example one of {table} to {parent}"
        ))),
    }
}
