//! The context of an event's subject: the ids that decide who may see the event.

use crate::{boxed_future, error::Result, event::Subject, readers::ReadConnection, store::Store};
use faceoff_types::{
    AblationId, EvaluationId, GameId, QuestionId, StageId, SubmissionId, TeamId, TournamentId,
    UserId,
};
use jiff::{Timestamp, civil::Date};
use sqlx::SqliteConnection;

/// An event's subject, with the entities that it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SubjectContext {
    /// The season, or an announcement.
    Season,
    /// A stage, or a day of it.
    Stage {
        stage: StageId,
        /// `None`: the whole stage.
        day: Option<Date>,
    },
    Tournament(TournamentId),
    Team(TeamId),
    /// A user with an account.
    User {
        /// The team of a member; `None` for an organiser.
        team: Option<TeamId>,
    },
    Submission {
        submission: SubmissionId,
        team: TeamId,
    },
    Ablation {
        submission: SubmissionId,
        team: TeamId,
    },
    /// An evaluation of a day, also a voided one; not one of a trial or a proposed re-evaluation.
    Evaluation {
        stage: StageId,
        day: Date,
        submission: SubmissionId,
        team: TeamId,
        /// `None` while the evaluation is open.
        finished_at: Option<Timestamp>,
        /// Are the day's results released?
        is_released: bool,
    },
    Game {
        tournament: TournamentId,
        teams: [TeamId; 2],
        /// True for games of rounds and their replays; test games and friendly games are private to their teams.
        is_public: bool,
    },
    /// A team's question to the organisers.
    Question {
        /// `None` in a public archive, which leaves the team out.
        team: Option<TeamId>,
    },
    /// Visible to organisers only: registrations, proposals, and deleted entities.
    Organisers,
}

async fn evaluation_context(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<SubjectContext> {
    let row = sqlx::query!(
        r#"SELECT e.team_id AS team, e.submission_id AS submission, e.stage_id AS stage, e.day AS "day!", e.finished_at,
                  d.released_at IS NOT NULL AS "is_released!: bool"
           FROM counting_evaluations e LEFT JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day WHERE e.id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map_or(SubjectContext::Organisers, |row| {
        SubjectContext::Evaluation {
            stage: row.stage,
            day: row.day.0,
            submission: row.submission,
            team: row.team,
            finished_at: row.finished_at.map(|at| at.0),
            is_released: row.is_released,
        }
    }))
}

async fn submission_context(
    connection: &mut SqliteConnection,
    id: SubmissionId,
) -> Result<SubjectContext> {
    let team = sqlx::query_scalar!("SELECT team_id AS team FROM submissions WHERE id = ?", id);
    let team = team.fetch_optional(connection).await?;
    Ok(team.map_or(SubjectContext::Organisers, |team| {
        SubjectContext::Submission {
            submission: id,
            team,
        }
    }))
}

async fn ablation_context(
    connection: &mut SqliteConnection,
    id: AblationId,
) -> Result<SubjectContext> {
    let row = sqlx::query!(
        "SELECT s.id AS submission, s.team_id AS team
         FROM ablations a JOIN submissions s ON s.id = a.submission_id WHERE a.id = ?",
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(
        row.map_or(SubjectContext::Organisers, |row| SubjectContext::Ablation {
            submission: row.submission,
            team: row.team,
        }),
    )
}

async fn game_context(connection: &mut SqliteConnection, id: GameId) -> Result<SubjectContext> {
    let row = sqlx::query!(
        r#"SELECT tournament_id AS tournament, home_team_id AS home, away_team_id AS away,
                  purpose IN ('round', 'replay') AS "is_public!: bool"
           FROM games WHERE id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(
        row.map_or(SubjectContext::Organisers, |row| SubjectContext::Game {
            tournament: row.tournament,
            teams: [row.home, row.away],
            is_public: row.is_public,
        }),
    )
}

async fn user_context(connection: &mut SqliteConnection, id: UserId) -> Result<SubjectContext> {
    let team = sqlx::query_scalar!("SELECT team_id AS team FROM people WHERE id = ?", id);
    let team = team.fetch_optional(connection).await?;
    Ok(SubjectContext::User {
        team: team.flatten(),
    })
}

async fn question_context(
    connection: &mut SqliteConnection,
    id: QuestionId,
) -> Result<SubjectContext> {
    let team = sqlx::query_scalar!("SELECT team_id AS team FROM questions WHERE id = ?", id);
    let team = team.fetch_optional(connection).await?;
    Ok(SubjectContext::Question {
        team: team.flatten(),
    })
}

impl Store {
    /// The context of an event's subject, in its current state.
    #[boxed_future]
    pub async fn subject_context(&self, subject: Subject) -> Result<SubjectContext> {
        Ok(match subject {
            Subject::Season | Subject::Announcement(_) => SubjectContext::Season,
            Subject::Stage(stage) => SubjectContext::Stage { stage, day: None },
            Subject::Day(stage_day) => SubjectContext::Stage {
                stage: stage_day.stage,
                day: Some(stage_day.date),
            },
            Subject::Tournament(id) => SubjectContext::Tournament(id),
            Subject::Team(id) => SubjectContext::Team(id),
            Subject::DayWithoutStage(_) | Subject::Registration(_) | Subject::Proposal(_) => {
                SubjectContext::Organisers
            }
            Subject::Evaluation(id) => {
                evaluation_context(&mut *self.connection().await?, id).await?
            }
            Subject::Submission(id) => {
                submission_context(&mut *self.connection().await?, id).await?
            }
            Subject::Ablation(id) => ablation_context(&mut *self.connection().await?, id).await?,
            Subject::Game(id) => game_context(&mut *self.connection().await?, id).await?,
            Subject::User(id) => user_context(&mut *self.connection().await?, id).await?,
            Subject::Question(id) => question_context(&mut *self.connection().await?, id).await?,
        })
    }

    async fn connection(&self) -> Result<ReadConnection> {
        Ok(self.database.read.acquire().await?)
    }
}
