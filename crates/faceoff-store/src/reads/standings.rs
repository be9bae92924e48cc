use crate::{
    column::{Instant, Json},
    error::Result,
    reads::board::{BoardRecord, BoardScope},
    store::Store,
    tables::teams::{Team, TeamProfile},
};
use faceoff_types::{
    DivisionName, EvaluationId, EvaluationResult, RunId, StageId, SubmissionId, TeamId, TeamName,
};
use jiff::{Timestamp, civil::Date};
use sqlx::types::Text;

/// Of which days of a stage rows of its board are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoardDays {
    /// All of them.
    All,
    /// The last so many on which a team has a result.
    Last(u32),
    /// The final one.
    Final,
}

impl Store {
    /// When a stage's final day had its cut; `None` before.
    pub async fn final_cut(&self, stage: StageId) -> Result<Option<Timestamp>> {
        crate::tables::finalised::final_cut(&mut *self.database.read.acquire().await?, stage).await
    }

    /// As [`Store::board_within`], with several days of a team: in the teams' order of names, the earlier day first.
    pub async fn board_of_days(
        &self,
        stage: StageId,
        revision: u32,
        days: BoardDays,
        scope: &BoardScope,
    ) -> Result<Vec<BoardRecord>> {
        let (stage, until) = (Text(stage), scope.until.map(Instant));
        let without = Json(&scope.without);
        let (last, only_final) = match days {
            BoardDays::All => (u32::MAX, false),
            BoardDays::Last(days) => (days, false),
            BoardDays::Final => (u32::MAX, true),
        };
        let rows = sqlx::query!(
            r#"/* board of days */ SELECT t.id AS "team: Text<TeamId>", t.name AS "name: Text<TeamName>",
                      t.created_at AS "invited_at: Instant", t.affiliation, t.link,
                      t.division AS "division: Text<DivisionName>", t.retired_at AS "retired_at: Instant",
                      s.id AS "submission: Text<SubmissionId>",
                      s.created_at AS "submitted_at: Instant", s.agent_name,
                      e.id AS "evaluation: Text<EvaluationId>", e.run_id AS "run: Text<RunId>",
                      e.day AS "day: Text<Date>", d.released_at AS "released_at: Instant",
                      e.extra_for, e.finished_at AS "finished_at!: Instant",
                      e.result AS "result!: Json<EvaluationResult>"
               FROM (SELECT n.rowid AS row, ROW_NUMBER() OVER (PARTITION BY n.team_id ORDER BY n.day DESC) AS age
                     FROM evaluations n
                     WHERE n.stage_id = ?1 AND n.revision = ?2 AND n.state = 'finished'
                       AND n.voided_at IS NULL AND (?5 IS NULL OR n.finished_at <= ?5)
                       AND n.id NOT IN (SELECT value FROM json_each(?6))) a
               JOIN evaluations e ON e.rowid = a.row
               JOIN teams t ON t.id = e.team_id
               JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day
               JOIN submissions s ON s.id = e.submission_id
               JOIN stages g ON g.id = e.stage_id
               WHERE a.age <= ?3 AND (NOT ?4 OR d.is_final = 1)
                 AND CASE WHEN g.finalised_at IS NULL THEN t.disqualified_at IS NULL
                          ELSE t.id NOT IN (SELECT value FROM json_each(g.finalised_without)) END
               ORDER BY t.name, e.day"#,
            stage,
            revision,
            last,
            only_final,
            until,
            without,
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
                    profile: TeamProfile {
                        affiliation: row.affiliation,
                        link: row.link,
                        division: row.division.map(|name| name.0),
                    },
                    retired_at: row.retired_at.map(|at| at.0),
                },
                submission: row.submission.0,
                submitted_at: row.submitted_at.0,
                agent_name: row.agent_name,
                evaluation: row.evaluation.0,
                run: row.run.0,
                day: row.day.0,
                released_at: row.released_at.map(|at| at.0),
                extra_for: row.extra_for,
                finished_at: row.finished_at.0,
                result: row.result.0,
            })
            .collect())
    }
}
