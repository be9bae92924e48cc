//! Queries of boards: the ranked results of a stage's teams. A row shows the team's newest evaluation that counts.

use crate::{
    boxed_future,
    column::{Instant, Json},
    error::Result,
    store::Store,
    tables::{
        stages::Stage,
        teams::{Team, TeamProfile},
    },
};
use faceoff_types::{
    DivisionName, EvaluationId, EvaluationResult, RunId, StageId, SubmissionId, TeamId, TeamName,
};
use jiff::{Timestamp, civil::Date};
use sqlx::types::Text;

/// The data of one board row.
#[derive(Debug, Clone)]
pub struct BoardRecord {
    pub team: Team,
    pub submission: SubmissionId,
    /// When the submission was uploaded.
    pub submitted_at: Timestamp,
    /// The name in the agent's manifest.
    pub agent_name: Option<String>,
    /// The team's newest finished evaluation.
    pub evaluation: EvaluationId,
    pub run: RunId,
    /// The date of the evaluation day.
    pub day: Date,
    /// When the day was released; `None` if it is not.
    pub released_at: Option<Timestamp>,
    /// The reason of an extra evaluation; `None` for the team's regular one of the day.
    pub extra_reason: Option<String>,
    /// Does it repeat an evaluation of the day, and was requested after the release, when the day's seed was public?
    pub rerun_after_release: bool,
    /// When the evaluation was scored.
    pub finished_at: Timestamp,
    pub result: EvaluationResult,
}

/// A row of the statements that read boards.
pub(super) struct BoardRow {
    pub(super) team: TeamId,
    pub(super) name: TeamName,
    pub(super) invited_at: Instant,
    pub(super) affiliation: Option<String>,
    pub(super) link: Option<String>,
    pub(super) division: Option<DivisionName>,
    pub(super) retired_at: Option<Instant>,
    pub(super) is_baseline: bool,
    pub(super) submission: SubmissionId,
    pub(super) submitted_at: Instant,
    pub(super) agent_name: Option<String>,
    pub(super) evaluation: EvaluationId,
    pub(super) run: RunId,
    pub(super) day: Text<Date>,
    pub(super) released_at: Option<Instant>,
    pub(super) extra_for: Option<String>,
    pub(super) rerun_after_release: bool,
    pub(super) finished_at: Instant,
    pub(super) result: Json<EvaluationResult>,
}

impl From<BoardRow> for BoardRecord {
    fn from(row: BoardRow) -> Self {
        Self {
            team: Team {
                id: row.team,
                name: row.name,
                created_at: row.invited_at.0,
                disqualified: None,
                profile: TeamProfile {
                    affiliation: row.affiliation,
                    link: row.link,
                    division: row.division,
                },
                retired_at: row.retired_at.map(|at| at.0),
                is_baseline: row.is_baseline,
            },
            submission: row.submission,
            submitted_at: row.submitted_at.0,
            agent_name: row.agent_name,
            evaluation: row.evaluation,
            run: row.run,
            day: row.day.0,
            released_at: row.released_at.map(|at| at.0),
            extra_reason: row.extra_for,
            rerun_after_release: row.rerun_after_release,
            finished_at: row.finished_at.0,
            result: row.result.0,
        }
    }
}

/// `SELECT` of board records: takes the statement's name as a comment, the SQL after the columns, and its arguments.
macro_rules! select_board {
    ($name:literal, $tail:literal, $($argument:expr),* $(,)?) => {
        sqlx::query_as!(
            crate::queries::board::BoardRow,
            $name + r#"SELECT t.id AS team, t.name, t.created_at AS invited_at, t.affiliation, t.link, t.division,
                      t.retired_at, t.is_baseline, s.id AS submission, s.created_at AS submitted_at, s.agent_name,
                      e.id AS evaluation, e.run_id AS run, d.day, d.released_at, e.extra_for,
                      e.rerun_of IS NOT NULL AND e.extra_for IS NULL AND d.released_at IS NOT NULL
                          AND e.created_at >= d.released_at
                          AS "rerun_after_release!: bool",
                      e.finished_at AS "finished_at!", e.result AS "result!" "# + $tail,
            $($argument),*
        )
    };
}
pub(super) use select_board;

/// Limits of the results on a board.
#[derive(Debug, Clone, Default)]
pub struct BoardScope {
    /// Evaluations that finished later are left out; `None`: no limit.
    pub finished_until: Option<Timestamp>,
    /// Evaluations of later days are left out; `None`: no limit.
    pub last_day: Option<Date>,
    /// These evaluations are left out, for a preview of the board without them.
    pub excluded: Vec<EvaluationId>,
}

impl Store {
    /// The newest revision of a stage's rules under which an evaluation has finished; the current revision if none has.
    #[boxed_future]
    pub async fn board_revision(&self, stage: &Stage) -> Result<u32> {
        self.board_revision_within(stage, &BoardScope::default())
            .await
    }

    /// As [`board_revision`](Self::board_revision), of the evaluations within the time limits of `scope`.
    #[boxed_future]
    pub async fn board_revision_within(&self, stage: &Stage, scope: &BoardScope) -> Result<u32> {
        let newest = sqlx::query_scalar!(
            r#"SELECT MAX(revision) AS "revision: u32" FROM counting_evaluations
               WHERE stage_id = ?1 AND state = 'finished' AND voided_at IS NULL
                 AND (?2 IS NULL OR finished_at <= ?2) AND (?3 IS NULL OR day <= ?3)"#,
            stage.id,
            scope.finished_until.map(Instant),
            scope.last_day.map(Text),
        );
        let newest = newest
            .fetch_one(&mut *self.database.read.acquire().await?)
            .await?;
        Ok(newest.unwrap_or(stage.revision.number))
    }

    /// The days of a stage that have results under one revision of its rules within the time limits of `scope`, the
    /// earliest first.
    #[boxed_future]
    pub async fn board_days(
        &self,
        stage: StageId,
        revision: u32,
        scope: &BoardScope,
    ) -> Result<Vec<Date>> {
        let days = sqlx::query_scalar!(
            r#"SELECT DISTINCT day AS "day!" FROM counting_evaluations
             WHERE stage_id = ?1 AND revision = ?2 AND state = 'finished' AND voided_at IS NULL
               AND (?3 IS NULL OR finished_at <= ?3) AND (?4 IS NULL OR day <= ?4)
             ORDER BY day"#,
            stage,
            revision,
            scope.finished_until.map(Instant),
            scope.last_day.map(Text),
        );
        let days = days
            .fetch_all(&mut *self.database.read.acquire().await?)
            .await?;
        Ok(days.into_iter().map(|day| day.0).collect())
    }

    /// The board of a stage under one revision of its rules, with all results.
    #[boxed_future]
    pub async fn board(&self, stage: StageId, revision: u32) -> Result<Vec<BoardRecord>> {
        let scope = BoardScope::default();
        self.board_within(stage, revision, &scope).await
    }

    /// The board of a stage under one revision of its rules, by team name. It has each team's newest finished evaluation
    /// within `scope` that was not voided. Disqualified teams are left out; after the sign-off, those that were
    /// disqualified at that time. Ranks and tiers are computed by the scoring.
    #[boxed_future]
    pub async fn board_within(
        &self,
        stage: StageId,
        revision: u32,
        scope: &BoardScope,
    ) -> Result<Vec<BoardRecord>> {
        let rows = select_board!(
            "/* board */ ",
            "FROM teams t
             JOIN counting_evaluations e ON e.row_no = (SELECT n.row_no FROM counting_evaluations n
                                              WHERE n.team_id = t.id AND n.stage_id = ?1
                                                AND n.revision = ?2 AND n.state = 'finished'
                                                AND n.voided_at IS NULL
                                                AND (?3 IS NULL OR n.finished_at <= ?3)
                                                AND (?5 IS NULL OR n.day <= ?5)
                                                AND n.id NOT IN (SELECT value FROM json_each(?4))
                                              ORDER BY n.day DESC LIMIT 1)
             JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day
             JOIN submissions s ON s.id = e.submission_id
             JOIN stages g ON g.id = e.stage_id
             WHERE CASE WHEN g.finalised_at IS NULL THEN t.disqualified_at IS NULL
                        ELSE t.id NOT IN (SELECT value FROM json_each(g.finalised_without)) END
             ORDER BY t.name",
            stage,
            revision,
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
