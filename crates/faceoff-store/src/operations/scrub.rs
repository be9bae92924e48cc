//! What of a database goes into an archive. It works on a copy, whose triggers are off and whose references are
//! checked at the end.

use crate::{
    error::{Result, StoreError},
    event::Event,
    tables::archived::Edition,
};
use serde_json::Value;
use sqlx::{AssertSqlSafe, SqliteConnection};

/// Tables of which the public archive holds anything. All others are emptied for it: a new one is, until somebody has
/// decided what of it is public.
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

/// For whom a step is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum For {
    Both,
    Public,
}

/// In this order: first what counts, then what belongs to it.
const STEPS: &[(For, &str)] = &[
    // What is open is no result; and of a day that is not released nothing may be known.
    (For::Both, "DELETE FROM evaluations WHERE state = 'open' OR NOT EXISTS
        (SELECT 1 FROM days d WHERE d.stage_id = evaluations.stage_id AND d.day = evaluations.day
           AND d.released_at IS NOT NULL)"),
    // Scores that nobody may know.
    (For::Public, "DELETE FROM evaluations WHERE stage_id IN
        (SELECT id FROM stages WHERE json_extract(settings, '$.blind'))"),
    (For::Public, "DELETE FROM archived_seeds WHERE stage_id IN
        (SELECT id FROM stages WHERE json_extract(settings, '$.blind'))"),
    (For::Public, "DELETE FROM evaluations WHERE EXISTS
        (SELECT 1 FROM frozen_boards f WHERE f.stage_id = evaluations.stage_id
           AND f.frozen_at < evaluations.finished_at)"),
    (For::Both, "UPDATE evaluations SET rerun_of = NULL WHERE rerun_of NOT IN (SELECT id FROM evaluations)"),
    (For::Both, "DELETE FROM finalisations WHERE evaluation_id NOT IN (SELECT id FROM evaluations)"),
    (For::Both, "DELETE FROM proposals WHERE id IN (SELECT proposal_id FROM drafts WHERE state = 'open')"),
    (For::Public, "DELETE FROM proposals"),
    (For::Both, "DELETE FROM drafts WHERE proposal_id NOT IN (SELECT id FROM proposals)"),
    (For::Both, "UPDATE drafts SET replaces = NULL WHERE replaces NOT IN (SELECT id FROM evaluations)"),
    (For::Both, "DELETE FROM draft_finalisations WHERE draft_id NOT IN (SELECT id FROM drafts)"),
    (For::Both, "DELETE FROM ablations WHERE finished_at IS NULL"),
    (For::Both, "DELETE FROM ablation_runs WHERE ablation_id NOT IN (SELECT id FROM ablations)"),
    // A game that is open or was called off has no result, and what does not count is its teams' own.
    (For::Both, "DELETE FROM games WHERE state IN ('queued', 'running')"),
    (For::Public, "DELETE FROM games WHERE purpose IN ('test', 'friendly')"),
    (For::Both, "DELETE FROM game_attempts WHERE game_id NOT IN (SELECT id FROM games)"),
    // Of attempts everybody gets the ones that count, and what went wrong of no other.
    (For::Public, "DELETE FROM game_attempts WHERE NOT EXISTS
        (SELECT 1 FROM games g WHERE g.id = game_attempts.game_id AND g.attempt = game_attempts.number)"),
    (For::Public, "UPDATE game_attempts SET worker = '', home_log = '', away_log = ''"),
    // With its seed a side's view of a game is everybody's: where that is not published it is zeros.
    (For::Public, "UPDATE game_attempts SET score = json_set(score, '$.seed', lower(hex(zeroblob(32))))
        WHERE score ->> '$.seed' IS NOT NULL AND NOT EXISTS
        (SELECT 1 FROM games g JOIN tournaments t ON t.id = g.tournament_id
         LEFT JOIN rounds r ON r.tournament_id = g.tournament_id AND r.number = g.round
         WHERE g.id = game_attempts.game_id AND g.purpose = 'round'
           AND CASE t.settings ->> '$.publishes' WHEN 'at_release' THEN r.over_at IS NOT NULL
                    WHEN 'at_close' THEN t.closed_at IS NOT NULL ELSE 0 END)"),
    (For::Public, "UPDATE tournaments SET baseline_id = NULL"),
    (For::Both, "DELETE FROM runs WHERE id NOT IN (SELECT run_id FROM evaluations)
        AND id NOT IN (SELECT run_id FROM drafts) AND id NOT IN (SELECT run_id FROM ablation_runs)"),
    (For::Both, "DELETE FROM contestants WHERE run_id NOT IN (SELECT id FROM runs)"),
    (For::Both, "DELETE FROM episode_summaries WHERE run_id NOT IN (SELECT id FROM runs)"),
    (For::Both, "DELETE FROM shards WHERE run_id NOT IN (SELECT id FROM runs)"),
    // Single episodes are the datasets' to tell, to those who may have them: everybody gets what they come to.
    (For::Public, "DELETE FROM shards"),
    (For::Public, "UPDATE runs SET cleared_at = COALESCE(cleared_at, (SELECT made_at FROM archived))"),
    // Recordings of shards are not taken along.
    (For::Both, "UPDATE shards SET recording = NULL"),
    (For::Both, "UPDATE runs SET recordings_removed_at = COALESCE(recordings_removed_at,
        (SELECT made_at FROM archived)) WHERE keeps_recordings = 1"),
    (For::Both, "DELETE FROM active_submissions WHERE submission_id IN
        (SELECT id FROM submissions WHERE state = 'validating')"),
    (For::Both, "DELETE FROM submissions WHERE state = 'validating'"),
    (For::Public, "DELETE FROM submissions WHERE id NOT IN (SELECT submission_id FROM evaluations)
        AND id NOT IN (SELECT submission_id FROM ablations) AND id NOT IN (SELECT submission_id FROM contestants)
        AND id NOT IN (SELECT submission_id FROM round_submissions)"),
    (For::Public, "UPDATE submissions SET bundle_key = '', bundle_bytes = 0, bundle_blake3 = '', bundle_file_name = '',
        label = NULL, note = NULL, timing = NULL, runtime = NULL, withdrawn_at = NULL, deleted_at = NULL, deleted_by = NULL,
        bundle_removed_at = NULL, bundle_removed_for = NULL, bundle_gone = 0, log = CASE WHEN log IS NOT NULL THEN '' END,
        reason = CASE WHEN reason IS NOT NULL THEN '' END"),
    (For::Both, "DELETE FROM smoke_runs WHERE submission_id NOT IN (SELECT id FROM submissions)"),
    (For::Public, "DELETE FROM smoke_runs"),
    (For::Public, "DELETE FROM finalisations"),
    (For::Public, "UPDATE games SET unit_id = NULL"),
    (For::Public, "DELETE FROM questions WHERE public = 0"),
    (For::Public, "UPDATE questions SET team_id = NULL"),
    // Who has played or stands on a board; who only wanted to is nobody's business.
    (For::Public, "DELETE FROM teams WHERE disqualified_at IS NULL AND id NOT IN (SELECT team_id FROM evaluations)
        AND id NOT IN (SELECT team_id FROM submissions) AND id NOT IN (SELECT team_id FROM entrants)
        AND id NOT IN (SELECT e.value FROM stages s JOIN json_each(s.finalised_without) e)"),
    (For::Public, "UPDATE teams SET retired_by_organiser = 0"),
    // Nothing of it is to be done any more, and who did it is nobody's business.
    (For::Both, "DELETE FROM units WHERE id NOT IN (SELECT unit_id FROM shards)
        AND id NOT IN (SELECT unit_id FROM smoke_runs) AND id NOT IN (SELECT unit_id FROM finalisations)
        AND id NOT IN (SELECT unit_id FROM draft_finalisations) AND id NOT IN (SELECT unit_id FROM games WHERE unit_id IS NOT NULL)"),
    (For::Both, "UPDATE units SET state = 'dropped', nonce = NULL WHERE state IN ('queued', 'leased')"),
    (For::Both, "UPDATE units SET nonce = '' WHERE nonce IS NOT NULL"),
    // The log for everybody: what is public (its kinds are sorted out before), by whom as far as that is.
    (For::Public, "DELETE FROM events WHERE subject_kind = 'evaluation'
        AND subject_id NOT IN (SELECT id FROM evaluations)"),
    (For::Public, "DELETE FROM events WHERE subject_kind = 'team' AND subject_id NOT IN (SELECT id FROM teams)"),
    (For::Public, "UPDATE events SET actor = COALESCE((SELECT 'team:' || p.team_id FROM people p
        WHERE p.team_id IS NOT NULL AND events.actor = 'person:' || p.id), 'organiser')
        WHERE actor LIKE 'person:%'"),
    // Who has taken a team out of the season is between it and the organisers.
    (For::Public, "UPDATE events SET actor = 'team:' || subject_id WHERE kind IN ('team_retired', 'team_returned')"),
    (For::Public, "UPDATE events SET actor = 'server' WHERE actor LIKE 'worker:%'"),
    (For::Public, "UPDATE stages SET finalised_by = 'organiser' WHERE finalised_by IS NOT NULL"),
    // Keys of every kind.
    (For::Both, "DELETE FROM tokens"),
    (For::Both, "DELETE FROM webhook_deliveries"),
    (For::Both, "DELETE FROM webhooks"),
    (For::Both, "DELETE FROM invitations"),
    (For::Both, "UPDATE people SET password = NULL"),
    (For::Both, "UPDATE registrations SET code_hash = randomblob(32)"),
    (For::Both, "UPDATE season SET secret = zeroblob(32) WHERE closed_at IS NULL"),
];

/// Takes out of a copy what its edition of the archive does not hold. What is left of it in unused pages stays there:
/// the file is to be copied once more.
pub(crate) async fn scrub(connection: &mut SqliteConnection, edition: Edition) -> Result<()> {
    let triggers: Vec<(String, String)> =
        sqlx::query_as("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'")
            .fetch_all(&mut *connection)
            .await?;
    for (name, _) in &triggers {
        run(connection, format!("DROP TRIGGER {name}")).await?;
    }
    if edition == Edition::Public {
        check_summed_up(connection).await?;
        forget_lifted_rulings(connection).await?;
        keep_public_events(connection).await?;
    }
    for (whose, sql) in STEPS {
        if *whose == For::Both || edition == Edition::Public {
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

/// The names of all tables but SQLite's own.
async fn tables(connection: &mut SqliteConnection) -> Result<Vec<String>> {
    Ok(sqlx::query_scalar(
        "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite\\_%' ESCAPE '\\'",
    )
    .fetch_all(connection)
    .await?)
}

/// Runs what names of our own schema were put into.
async fn run(connection: &mut SqliteConnection, sql: String) -> Result<()> {
    sqlx::query(AssertSqlSafe(sql)).execute(connection).await?;
    Ok(())
}

/// Removes the events whose kind is not for everybody: one of each kind is read to know.
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

/// Refuses to take out the episodes of a result whose boards could not be shown without.
async fn check_summed_up(connection: &mut SqliteConnection) -> Result<()> {
    let unsummed: u32 = sqlx::query_scalar(
        "SELECT COUNT(*) FROM runs r
           WHERE r.state = 'played' AND r.cleared_at IS NULL
             AND NOT EXISTS (SELECT 1 FROM episode_summaries s WHERE s.run_id = r.id)
             AND (EXISTS (SELECT 1 FROM evaluations e WHERE e.run_id = r.id AND e.state = 'finished')
                  OR EXISTS (SELECT 1 FROM ablation_runs p JOIN ablations a ON a.id = p.ablation_id
                             WHERE p.run_id = r.id AND a.finished_at IS NOT NULL))",
    )
    .fetch_one(connection)
    .await?;
    if unsummed > 0 {
        return Err(StoreError::Conflict(format!(
            "{unsummed} results came in while the season was copied, and their episodes are not summed up yet: try again"
        )));
    }
    Ok(())
}

/// Removes the disqualifications that were lifted: everybody knew of them while they held, and that they do no more is no
/// event for everybody.
async fn forget_lifted_rulings(connection: &mut SqliteConnection) -> Result<()> {
    sqlx::query(
        "DELETE FROM events WHERE kind = 'team_disqualified' AND EXISTS
           (SELECT 1 FROM events r WHERE r.kind = 'team_reinstated' AND r.subject_kind = events.subject_kind
              AND r.subject_id = events.subject_id AND r.id > events.id)"
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Refuses rows that refer to rows which are not there.
pub(crate) async fn check_references(connection: &mut SqliteConnection) -> Result<()> {
    let hanging: Vec<(String, Option<i64>, String, i64)> =
        sqlx::query_as("PRAGMA foreign_key_check")
            .fetch_all(connection)
            .await?;
    match hanging.first() {
        None => Ok(()),
        Some((table, _, parent, _)) => Err(StoreError::Damaged(format!(
            "{} rows refer to what is not there: one of {table} to {parent}",
            hanging.len()
        ))),
    }
}
