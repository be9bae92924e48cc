//! Queries of boards that are computed from several evaluation days of each team.

use crate::{
    boxed_future,
    column::{Instant, Json},
    error::Result,
    queries::board::{BoardRecord, BoardScope, select_board},
    store::Store,
};
use faceoff_types::{StageId, Task, TeamId};
use jiff::{Timestamp, civil::Date};
use sqlx::types::Text;

/// The days of a stage from which its board is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoardDays {
    All,
    /// For each team, this number of the last days on which it has a result.
    Last(u32),
    /// The final day, which a stage can have after its end.
    Final,
}

/// A team's score of an evaluation day.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DayScore {
    pub team: TeamId,
    pub day: Date,
    /// In percent: the overall score, or the task's success rate.
    pub score: f64,
}

impl Store {
    /// The scores of the teams on a board from `first_day` on, or their success rates in a task, by day. Baselines are left out.
    #[boxed_future]
    pub async fn day_scores(
        &self,
        stage: StageId,
        revision: u32,
        scope: &BoardScope,
        (task, first_day): (Option<Task>, Date),
    ) -> Result<Vec<DayScore>> {
        let (path, scale) = match task {
            Some(task) => (format!("$.tasks.\"{task}\".success_rate"), 100.0),
            None => ("$.score".to_owned(), 1.0),
        };
        let rows = sqlx::query!(
            r#"SELECT e.team_id AS "team!: TeamId", e.day AS "day!: Text<Date>", json_extract(e.result, ?6) AS "score: f64"
               FROM counting_evaluations e
               JOIN teams t ON t.id = e.team_id
               JOIN stages g ON g.id = e.stage_id
               WHERE e.stage_id = ?1 AND e.revision = ?2 AND e.state = 'finished' AND e.voided_at IS NULL
                 AND (?3 IS NULL OR e.finished_at <= ?3) AND (?4 IS NULL OR e.day <= ?4) AND e.day >= ?5
                 AND NOT t.is_baseline
                 AND CASE WHEN g.finalised_at IS NULL THEN t.disqualified_at IS NULL
                          ELSE t.id NOT IN (SELECT value FROM json_each(g.finalised_without)) END
               ORDER BY e.day, t.name"#,
            stage,
            revision,
            scope.finished_until.map(Instant),
            scope.last_day.map(Text),
            Text(first_day),
            path,
        );
        let rows = rows
            .fetch_all(&mut *self.database.read.acquire().await?)
            .await?;
        // Not every evaluation has each task.
        let scores = rows.into_iter().filter_map(|row| {
            Some(DayScore {
                team: row.team,
                day: row.day.0,
                score: scale * row.score?,
            })
        });
        Ok(scores.collect())
    }

    /// The cutoff (the start of the evaluations) of a stage's final day; `None` before it.
    #[boxed_future]
    pub async fn final_cutoff(&self, stage: StageId) -> Result<Option<Timestamp>> {
        crate::tables::sign_offs::final_cutoff(&mut *self.database.read.acquire().await?, stage)
            .await
    }

    /// As [`Store::board_within`], with several days of each team: by team name, then by day.
    #[boxed_future]
    pub async fn board_of_days(
        &self,
        stage: StageId,
        revision: u32,
        days: BoardDays,
        scope: &BoardScope,
    ) -> Result<Vec<BoardRecord>> {
        let (max_days, only_final_day) = match days {
            BoardDays::All => (u32::MAX, false),
            BoardDays::Last(days) => (days, false),
            BoardDays::Final => (u32::MAX, true),
        };
        let rows = select_board!(
            "/* board of days */ ",
            "FROM (SELECT n.row_no AS row, ROW_NUMBER() OVER (PARTITION BY n.team_id ORDER BY n.day DESC) AS age
                   FROM counting_evaluations n
                   WHERE n.stage_id = ?1 AND n.revision = ?2 AND n.state = 'finished'
                     AND n.voided_at IS NULL AND (?5 IS NULL OR n.finished_at <= ?5)
                     AND (?7 IS NULL OR n.day <= ?7)
                     AND n.id NOT IN (SELECT value FROM json_each(?6))) a
             JOIN counting_evaluations e ON e.row_no = a.row
             JOIN teams t ON t.id = e.team_id
             JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day
             JOIN submissions s ON s.id = e.submission_id
             JOIN stages g ON g.id = e.stage_id
             WHERE a.age <= ?3 AND (NOT ?4 OR d.is_final = 1)
               AND CASE WHEN g.finalised_at IS NULL THEN t.disqualified_at IS NULL
                        ELSE t.id NOT IN (SELECT value FROM json_each(g.finalised_without)) END
             ORDER BY t.name, e.day",
            stage,
            revision,
            max_days,
            only_final_day,
            scope.finished_until.map(Instant),
            Json(&scope.excluded),
            scope.last_day.map(Text),
        );
        let rows = rows
            .fetch_all(&mut *self.database.read.acquire().await?)
            .await?;
        Ok(rows.into_iter().map(BoardRecord::from).collect())
    }
}
