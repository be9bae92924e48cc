use crate::{
    column::{Instant, Json},
    error::Result,
    store::Store,
    tables::{stages::Stage, teams::Team},
};
use faceoff_types::{
    EvaluationId, EvaluationResult, RunId, StageId, SubmissionId, TeamId, TeamName,
};
use jiff::{Timestamp, civil::Date};
use sqlx::types::Text;

/// What a board row is made of.
#[derive(Debug, Clone)]
pub struct BoardRecord {
    /// Whose row it is.
    pub team: Team,
    /// What was evaluated.
    pub submission: SubmissionId,
    /// When it was uploaded.
    pub submitted_at: Timestamp,
    /// The agent's own name.
    pub agent_name: Option<String>,
    /// The team's newest finished evaluation.
    pub evaluation: EvaluationId,
    /// The evaluation's episodes.
    pub run: RunId,
    /// The date of the evaluation's day.
    pub day: Date,
    /// When the day was released; `None` before.
    pub released_at: Option<Timestamp>,
    /// When it was scored.
    pub finished_at: Timestamp,
    /// The score.
    pub result: EvaluationResult,
}

impl Store {
    /// The newest of a stage's rules that an evaluation is finished under; those of now before there is any.
    pub async fn board_revision(&self, stage: &Stage) -> Result<u32> {
        let id = Text(stage.id);
        let newest = sqlx::query_scalar!(
            r#"SELECT MAX(revision) AS "revision: u32" FROM evaluations
               WHERE stage_id = ? AND state = 'finished' AND voided_at IS NULL"#,
            id,
        );
        let newest = newest.fetch_one(&self.database.read).await?;
        Ok(newest.unwrap_or(stage.rules.number))
    }

    /// What the board of a stage is made of, by one revision of its rules: each team's newest evaluation that is
    /// finished under it and was not voided, of teams that are not disqualified (once the stage is signed off: were not
    /// then), in the teams' order of names. Ranks and tiers are the scoring's.
    pub async fn board(&self, stage: StageId, revision: u32) -> Result<Vec<BoardRecord>> {
        let stage = Text(stage);
        let rows = sqlx::query!(
            r#"/* board */ SELECT t.id AS "team: Text<TeamId>", t.name AS "name: Text<TeamName>",
                      t.created_at AS "invited_at: Instant",
                      s.id AS "submission: Text<SubmissionId>",
                      s.created_at AS "submitted_at: Instant", s.agent_name,
                      e.id AS "evaluation: Text<EvaluationId>", e.run_id AS "run: Text<RunId>",
                      e.day AS "day: Text<Date>", d.released_at AS "released_at: Instant",
                      e.finished_at AS "finished_at!: Instant",
                      e.result AS "result!: Json<EvaluationResult>"
               FROM teams t
               JOIN evaluations e ON e.rowid = (SELECT n.rowid FROM evaluations n
                                                WHERE n.team_id = t.id AND n.stage_id = ?1
                                                  AND n.revision = ?2 AND n.state = 'finished'
                                                  AND n.voided_at IS NULL
                                                ORDER BY n.day DESC LIMIT 1)
               JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day
               JOIN submissions s ON s.id = e.submission_id
               JOIN stages g ON g.id = e.stage_id
               WHERE CASE WHEN g.finalised_at IS NULL THEN t.disqualified_at IS NULL
                          ELSE t.id NOT IN (SELECT value FROM json_each(g.finalised_without)) END
               ORDER BY t.name"#,
            stage,
            revision,
        )
        .fetch_all(&self.database.read)
        .await?;
        Ok(rows
            .into_iter()
            .map(|row| BoardRecord {
                team: Team {
                    id: row.team.0,
                    name: row.name.0,
                    created_at: row.invited_at.0,
                    disqualified: None,
                },
                submission: row.submission.0,
                submitted_at: row.submitted_at.0,
                agent_name: row.agent_name,
                evaluation: row.evaluation.0,
                run: row.run.0,
                day: row.day.0,
                released_at: row.released_at.map(|at| at.0),
                finished_at: row.finished_at.0,
                result: row.result.0,
            })
            .collect())
    }
}
