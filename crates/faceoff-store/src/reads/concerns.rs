//! Whom an event concerns: its subject, as far as it says who may be told of it.

use crate::{boxed, column::Instant, error::Result, event::Subject, store::Store};
use faceoff_types::{
    AblationId, EvaluationId, GameId, PersonId, QuestionId, StageId, SubmissionId, TeamId,
    TournamentId,
};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};

/// What an event is about, with what belongs to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Concern {
    /// The season, or what everybody is told.
    Season,
    /// A stage, or a day of it.
    Stage {
        stage: StageId,
        /// Of it all, if there is none.
        day: Option<Date>,
    },
    Tournament(TournamentId),
    Team(TeamId),
    /// Somebody with an account.
    Person {
        /// Whose member; none: an organiser.
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
    /// An evaluation that counts, or may.
    Evaluation {
        /// Whose day; none from before there were stages.
        stage: StageId,
        day: Date,
        submission: SubmissionId,
        team: TeamId,
        /// When it ended, if it has.
        finished_at: Option<Timestamp>,
        /// Is all of the day out?
        is_released: bool,
    },
    Game {
        tournament: TournamentId,
        teams: [TeamId; 2],
        /// Is it of a round, or of the schedule played again? Others are their teams' own.
        is_public: bool,
    },
    /// What a team asks.
    Question {
        /// Who; a public archive does not tell.
        team: Option<TeamId>,
    },
    /// What organisers alone know of: registrations, proposals, and what is not there any more.
    Organisers,
}

async fn of_evaluation(connection: &mut SqliteConnection, id: EvaluationId) -> Result<Concern> {
    let id = Text(id);
    let row = sqlx::query!(
        r#"SELECT e.team_id AS "team: Text<TeamId>", e.submission_id AS "submission: Text<SubmissionId>",
                  e.stage_id AS "stage: Text<StageId>", e.day AS "day: Text<Date>",
                  e.finished_at AS "finished_at: Instant", d.released_at IS NOT NULL AS "is_released!: bool"
           FROM evaluations e LEFT JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day WHERE e.id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map_or(Concern::Organisers, |row| Concern::Evaluation {
        stage: row.stage.0,
        day: row.day.0,
        submission: row.submission.0,
        team: row.team.0,
        finished_at: row.finished_at.map(|at| at.0),
        is_released: row.is_released,
    }))
}

async fn of_submission(connection: &mut SqliteConnection, id: SubmissionId) -> Result<Concern> {
    let key = Text(id);
    let team = sqlx::query_scalar!(
        r#"SELECT team_id AS "team: Text<TeamId>" FROM submissions WHERE id = ?"#,
        key
    );
    let team = team.fetch_optional(connection).await?;
    Ok(
        team.map_or(Concern::Organisers, |team| Concern::Submission {
            submission: id,
            team: team.0,
        }),
    )
}

async fn of_ablation(connection: &mut SqliteConnection, id: AblationId) -> Result<Concern> {
    let id = Text(id);
    let row = sqlx::query!(
        r#"SELECT s.id AS "submission: Text<SubmissionId>", s.team_id AS "team: Text<TeamId>"
           FROM ablations a JOIN submissions s ON s.id = a.submission_id WHERE a.id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map_or(Concern::Organisers, |row| Concern::Ablation {
        submission: row.submission.0,
        team: row.team.0,
    }))
}

async fn of_game(connection: &mut SqliteConnection, id: GameId) -> Result<Concern> {
    let id = Text(id);
    let row = sqlx::query!(
        r#"SELECT tournament_id AS "tournament: Text<TournamentId>", home_team_id AS "home: Text<TeamId>",
                  away_team_id AS "away: Text<TeamId>", purpose IN ('round', 'replay') AS "is_public!: bool"
           FROM games WHERE id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map_or(Concern::Organisers, |row| Concern::Game {
        tournament: row.tournament.0,
        teams: [row.home.0, row.away.0],
        is_public: row.is_public,
    }))
}

async fn of_person(connection: &mut SqliteConnection, id: PersonId) -> Result<Concern> {
    let id = Text(id);
    let team = sqlx::query_scalar!(
        r#"SELECT team_id AS "team: Text<TeamId>" FROM people WHERE id = ?"#,
        id
    );
    let team = team.fetch_optional(connection).await?;
    Ok(Concern::Person {
        team: team.flatten().map(|team| team.0),
    })
}

async fn of_question(connection: &mut SqliteConnection, id: QuestionId) -> Result<Concern> {
    let id = Text(id);
    let team = sqlx::query_scalar!(
        r#"SELECT team_id AS "team: Text<TeamId>" FROM questions WHERE id = ?"#,
        id
    );
    let team = team.fetch_optional(connection).await?;
    Ok(Concern::Question {
        team: team.flatten().map(|team| team.0),
    })
}

impl Store {
    /// Whom an event about this concerns, as things are now.
    #[boxed]
    pub async fn concern(&self, subject: Subject) -> Result<Concern> {
        Ok(match subject {
            Subject::Season | Subject::Announcement(_) => Concern::Season,
            Subject::Stage(stage) => Concern::Stage { stage, day: None },
            Subject::Day(of) => Concern::Stage {
                stage: of.stage,
                day: Some(of.date),
            },
            Subject::Tournament(id) => Concern::Tournament(id),
            Subject::Team(id) => Concern::Team(id),
            Subject::DayOfNone(_) | Subject::Registration(_) | Subject::Proposal(_) => {
                Concern::Organisers
            }
            Subject::Evaluation(id) => of_evaluation(&mut *self.read().await?, id).await?,
            Subject::Submission(id) => of_submission(&mut *self.read().await?, id).await?,
            Subject::Ablation(id) => of_ablation(&mut *self.read().await?, id).await?,
            Subject::Game(id) => of_game(&mut *self.read().await?, id).await?,
            Subject::Person(id) => of_person(&mut *self.read().await?, id).await?,
            Subject::Question(id) => of_question(&mut *self.read().await?, id).await?,
        })
    }

    async fn read(&self) -> Result<sqlx::pool::PoolConnection<sqlx::Sqlite>> {
        Ok(self.database.read.acquire().await?)
    }
}
