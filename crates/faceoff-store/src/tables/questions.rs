//! The table of questions: teams ask the organisers, who answer.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{QuestionId, TeamId};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// The organisers' answer to a question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QuestionAnswer {
    /// When it was given.
    pub at: Timestamp,
    pub text: String,
    /// Are question and answer public? The team that asked is never shown.
    pub is_public: bool,
}

/// A team's question to the organisers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Question {
    pub id: QuestionId,
    /// The team that asked; `None` in a public archive.
    pub team: Option<TeamId>,
    /// When it was asked.
    pub at: Timestamp,
    pub text: String,
    pub answer: Option<QuestionAnswer>,
}

struct QuestionRow {
    id: QuestionId,
    team_id: Option<TeamId>,
    asked_at: Instant,
    text: String,
    answer: Option<String>,
    answered_at: Option<Instant>,
    public: bool,
}

impl From<QuestionRow> for Question {
    fn from(row: QuestionRow) -> Self {
        let is_public = row.public;
        let answer = row.answer.zip(row.answered_at);
        Self {
            id: row.id,
            team: row.team_id,
            at: row.asked_at.0,
            text: row.text,
            answer: answer.map(|(text, at)| QuestionAnswer {
                at: at.0,
                text,
                is_public,
            }),
        }
    }
}

/// All questions, the newest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Question>> {
    let rows = sqlx::query_as!(
        QuestionRow,
        "SELECT id, team_id, asked_at, text, answer, answered_at, public
         FROM questions ORDER BY asked_at DESC, id DESC"
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(Question::from).collect())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: QuestionId) -> Result<Question> {
    let questions = all(connection).await?;
    let found = questions.into_iter().find(|question| question.id == id);
    found.ok_or(StoreError::NotFound("question"))
}

/// Number of a team's unanswered questions.
pub(crate) async fn count_open(connection: &mut SqliteConnection, team: TeamId) -> Result<i64> {
    Ok(sqlx::query_scalar!(
        "SELECT COUNT(*) FROM questions WHERE team_id = ? AND answer IS NULL",
        team
    )
    .fetch_one(connection)
    .await?)
}

pub(crate) async fn insert(connection: &mut SqliteConnection, question: &Question) -> Result<()> {
    sqlx::query!(
        "INSERT INTO questions (id, team_id, asked_at, text) VALUES (?, ?, ?, ?)",
        question.id,
        question.team,
        Instant(question.at),
        question.text
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_answer(
    connection: &mut SqliteConnection,
    id: QuestionId,
    answer: &QuestionAnswer,
) -> Result<()> {
    sqlx::query!(
        "UPDATE questions SET answer = ?, answered_at = ?, public = ? WHERE id = ?",
        answer.text,
        Instant(answer.at),
        answer.is_public,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
