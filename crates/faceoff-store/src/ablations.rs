//! Ablations: the same episodes of a submission under each perturbation alone. They take no turn and
//! reach no board; an organiser or the schedule orders them.

use crate::{
    Claim, Committed, Event, Store, StoreError, SubmissionState,
    column::{Instant, Json},
    leases::{self, Hold},
    submissions,
};
use faceoff_types::{AblationId, AblationRunId, EpisodeOutcome, Profile, SubmissionId, Task};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use std::collections::BTreeMap;
use uuid::Uuid;

/// All profiles of one submission, on the same episodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Ablation {
    /// Its id.
    pub id: AblationId,
    /// What is played.
    pub submission: SubmissionId,
    /// Episodes of each task and profile.
    pub episodes_per_task: u32,
    /// When it was ordered.
    pub created_at: Timestamp,
    /// How far it is.
    pub state: AblationState,
}

/// An ablation's way.
#[derive(Debug, Clone, PartialEq)]
pub enum AblationState {
    /// It waits, or is being played.
    Open {
        /// Episodes of the runs that are over, and of those under way as far as told.
        episodes_done: u32,
        /// Episodes over all profiles and tasks.
        episodes_total: u32,
    },
    /// All profiles are played.
    Finished {
        /// When.
        finished_at: Timestamp,
    },
    /// It ended without a result.
    Failed {
        /// When.
        finished_at: Timestamp,
        /// Why.
        reason: String,
    },
}

/// One task under one profile; the unit of work.
#[derive(Debug, Clone, PartialEq)]
pub struct AblationRun {
    /// Its id.
    pub id: AblationRunId,
    /// The ablation it belongs to.
    pub ablation: AblationId,
    /// The perturbations.
    pub profile: Profile,
    /// The task.
    pub task: Task,
    /// Episodes, from 0 on.
    pub episodes: u32,
    /// More agent faults than this end the ablation.
    pub max_faults: u32,
}

/// Reads the run behind a unit of work.
pub(crate) async fn find_run(
    connection: &mut SqliteConnection,
    id: AblationRunId,
) -> Result<AblationRun, StoreError> {
    let id_text = Text(id);
    let row = sqlx::query!(
        r#"SELECT a.id AS "ablation: Text<AblationId>", r.profile AS "profile: Text<Profile>",
                  r.task AS "task: Text<Task>", a.episodes_per_task AS "episodes: u32",
                  a.max_faults AS "max_faults: u32"
           FROM ablation_runs r JOIN ablations a ON a.id = r.ablation_id WHERE r.id = ?"#,
        id_text,
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("ablation run"))?;
    Ok(AblationRun {
        id,
        ablation: row.ablation.0,
        profile: row.profile.0,
        task: row.task.0,
        episodes: row.episodes,
        max_faults: row.max_faults,
    })
}

/// Ends the ablation of a run without a result; its other runs are dropped.
pub(crate) async fn fail(
    connection: &mut SqliteConnection,
    run: AblationRunId,
    reason: &str,
    now: Timestamp,
) -> Result<(), StoreError> {
    let (run, now) = (Text(run), Instant(now));
    sqlx::query!(
        "UPDATE work_units SET state = 'dropped', nonce = NULL
         WHERE state IN ('queued', 'leased') AND ablation_run_id IN
               (SELECT o.id FROM ablation_runs o JOIN ablation_runs r ON r.ablation_id = o.ablation_id
                WHERE r.id = ?)",
        run,
    )
    .execute(&mut *connection)
    .await?;
    sqlx::query!(
        "UPDATE ablations SET finished_at = ?, reason = ?
         WHERE finished_at IS NULL AND id = (SELECT ablation_id FROM ablation_runs WHERE id = ?)",
        now,
        reason,
        run,
    )
    .execute(connection)
    .await?;
    Ok(())
}

impl Store {
    /// Orders an ablation of a valid submission: every profile, every task.
    /// [`StoreError::Conflict`] if the submission is not valid, or one of it is under way.
    pub async fn create_ablation(
        &self,
        submission: SubmissionId,
        episodes_per_task: u32,
        max_faults: u32,
        now: Timestamp,
    ) -> Result<Ablation, StoreError> {
        if episodes_per_task == 0 {
            return Err(StoreError::Conflict(
                "an ablation plays at least one episode".into(),
            ));
        }
        let mut tx = self.database.begin().await?;
        let found = submissions::find(&mut tx, submission).await?;
        if !matches!(found.state, SubmissionState::Valid { .. }) {
            return Err(StoreError::Conflict(
                "only a valid submission can be taken apart: wait for its smoke run, or upload a \
                 corrected one"
                    .into(),
            ));
        }
        let id = AblationId::new();
        let (id_text, submission_text, at) = (Text(id), Text(submission), Instant(now));
        sqlx::query!(
            "INSERT INTO ablations (id, submission_id, episodes_per_task, max_faults, created_at)
             VALUES (?, ?, ?, ?, ?)",
            id_text,
            submission_text,
            episodes_per_task,
            max_faults,
            at,
        )
        .execute(&mut *tx)
        .await
        .map_err(|error| {
            if StoreError::is_duplicate(&error, "ablations.submission_id") {
                StoreError::Conflict(
                    "an ablation of this submission is under way: wait for its end".into(),
                )
            } else {
                error.into()
            }
        })?;
        for profile in Profile::ABLATION {
            for task in Task::ALL {
                let run = Text(AblationRunId::new());
                let (unit, profile, task) = (Text(Uuid::now_v7()), Text(profile), Text(task));
                sqlx::query!(
                    "INSERT INTO ablation_runs (id, ablation_id, profile, task) VALUES (?, ?, ?, ?)",
                    run,
                    id_text,
                    profile,
                    task,
                )
                .execute(&mut *tx)
                .await?;
                sqlx::query!(
                    "INSERT INTO work_units (id, kind, submission_id, ablation_run_id, state,
                                             claimable_at)
                     VALUES (?, 'ablation', ?, ?, 'queued', ?)",
                    unit,
                    submission_text,
                    run,
                    at,
                )
                .execute(&mut *tx)
                .await?;
            }
        }
        tx.commit().await?;
        self.signals.work_added();
        self.signals.changed(Event::Submission(submission));
        self.newest_ablation(submission)
            .await?
            .ok_or(StoreError::NotFound("ablation"))
    }

    /// The newest ablation of a submission, if there was one.
    pub async fn newest_ablation(
        &self,
        submission: SubmissionId,
    ) -> Result<Option<Ablation>, StoreError> {
        let submission_text = Text(submission);
        let row = sqlx::query!(
            r#"SELECT a.id AS "id: Text<AblationId>", a.episodes_per_task AS "episodes_per_task: u32",
                      a.created_at AS "created_at: Instant", a.finished_at AS "finished_at: Instant",
                      a.reason,
                      (SELECT COALESCE(SUM(u.episodes_done), 0) FROM work_units u
                       JOIN ablation_runs r ON r.id = u.ablation_run_id
                       WHERE r.ablation_id = a.id) AS "episodes_done!: u32",
                      (SELECT COUNT(*) FROM ablation_runs r WHERE r.ablation_id = a.id)
                          AS "runs!: u32"
               FROM ablations a WHERE a.submission_id = ?
               ORDER BY a.created_at DESC, a.id DESC LIMIT 1"#,
            submission_text,
        )
        .fetch_optional(&self.database.read)
        .await?;
        Ok(row.map(|row| Ablation {
            id: row.id.0,
            submission,
            episodes_per_task: row.episodes_per_task,
            created_at: row.created_at.0,
            state: match (row.finished_at, row.reason) {
                (None, _) => AblationState::Open {
                    episodes_done: row.episodes_done,
                    episodes_total: row.runs.saturating_mul(row.episodes_per_task),
                },
                (Some(at), None) => AblationState::Finished { finished_at: at.0 },
                (Some(at), Some(reason)) => AblationState::Failed {
                    finished_at: at.0,
                    reason,
                },
            },
        }))
    }

    /// The outcomes of an ablation's runs by profile, in (task, episode) order.
    pub async fn ablation_outcomes(
        &self,
        ablation: AblationId,
    ) -> Result<BTreeMap<Profile, Vec<EpisodeOutcome>>, StoreError> {
        let ablation = Text(ablation);
        let rows = sqlx::query!(
            r#"SELECT profile AS "profile: Text<Profile>",
                      outcomes AS "outcomes!: Json<Vec<EpisodeOutcome>>"
               FROM ablation_runs WHERE ablation_id = ? AND outcomes IS NOT NULL"#,
            ablation,
        )
        .fetch_all(&self.database.read)
        .await?;
        let mut runs: BTreeMap<Profile, Vec<EpisodeOutcome>> = BTreeMap::new();
        for row in rows {
            runs.entry(row.profile.0)
                .or_default()
                .extend(row.outcomes.0);
        }
        for outcomes in runs.values_mut() {
            outcomes.sort_by_key(|outcome| (outcome.task, outcome.episode));
        }
        Ok(runs)
    }

    /// Stores a played run; the last one ends the ablation. `outcomes` is `None` when the agent's
    /// faults stopped the run: then the ablation ends without a result. Idempotent, as
    /// [`Store::commit_shard`] is.
    pub async fn commit_ablation_run(
        &self,
        claim: &Claim,
        outcomes: Option<&[EpisodeOutcome]>,
        now: Timestamp,
    ) -> Result<Committed, StoreError> {
        let mut tx = self.database.begin().await?;
        let unit = match leases::hold(&mut tx, claim).await? {
            Hold::Held(unit) => unit,
            Hold::DoneBefore => return Ok(Committed::Before),
            Hold::Lost => return Ok(Committed::LeaseLost),
        };
        let id = unit.ablation_run()?;
        let run = find_run(&mut tx, id).await?;
        leases::mark_done(&mut tx, claim, run.episodes).await?;
        if let Some(outcomes) = outcomes {
            let played = outcomes
                .iter()
                .map(|outcome| (outcome.task, outcome.episode));
            if !played.eq((0..run.episodes).map(|episode| (run.task, episode))) {
                return Err(StoreError::Conflict(format!(
                    "the outcomes do not cover {} episodes of {}",
                    run.episodes, run.task
                )));
            }
            let (id, ablation, outcomes) = (Text(id), Text(run.ablation), Json(outcomes));
            let at = Instant(now);
            sqlx::query!(
                "UPDATE ablation_runs SET outcomes = ? WHERE id = ?",
                outcomes,
                id
            )
            .execute(&mut *tx)
            .await?;
            sqlx::query!(
                "UPDATE ablations SET finished_at = ?1
                 WHERE id = ?2 AND finished_at IS NULL AND NOT EXISTS
                       (SELECT 1 FROM ablation_runs WHERE ablation_id = ?2 AND outcomes IS NULL)",
                at,
                ablation,
            )
            .execute(&mut *tx)
            .await?;
        } else {
            let reason = format!(
                "the agent broke the protocol or a limit more than {} times in {} with {}",
                run.max_faults, run.task, run.profile
            );
            fail(&mut tx, id, &reason, now).await?;
        }
        tx.commit().await?;
        self.signals.changed(Event::Submission(unit.submission));
        Ok(Committed::Now)
    }
}
