//! Public announcements, and questions of teams with their answers.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{
        announcements::{self, Announcement},
        questions::{self, Question, QuestionAnswer},
    },
};
use faceoff_types::{AnnouncementId, QuestionId, TeamId};
use jiff::Timestamp;

/// Unanswered questions that a team may have at a time.
pub const MAX_OPEN_QUESTIONS: i64 = 10;

impl Store {
    #[boxed_future]
    pub async fn announce(
        &self,
        actor: Actor,
        title: &str,
        text: &str,
        now: Timestamp,
    ) -> Result<Announcement> {
        self.write(actor, now, async |tx| {
            let announcement = Announcement {
                id: AnnouncementId::new(),
                at: now,
                title: title.to_owned(),
                text: text.to_owned(),
            };
            announcements::insert(tx, &announcement).await?;
            let title = announcement.title.clone();
            let subject = Subject::Announcement(announcement.id);
            tx.record(subject, Event::Announced { title });
            Ok(announcement)
        })
        .await
    }

    /// At most `limit` announcements, the newest first.
    #[boxed_future]
    pub async fn announcements(&self, limit: u32) -> Result<Vec<Announcement>> {
        announcements::newest(&mut *self.database.read.acquire().await?, limit).await
    }

    /// Adds a question of a team. [`StoreError::Conflict`] if it has [`MAX_OPEN_QUESTIONS`] unanswered ones.
    #[boxed_future]
    pub async fn ask(
        &self,
        actor: Actor,
        team: TeamId,
        text: &str,
        now: Timestamp,
    ) -> Result<Question> {
        self.write(actor, now, async |tx| {
            if questions::count_open(tx, team).await? >= MAX_OPEN_QUESTIONS {
                return StoreError::conflict(format!(
                    "the team has {MAX_OPEN_QUESTIONS} unanswered questions, which is the limit: wait for an answer"
                ));
            }
            let question = Question {
                id: QuestionId::new(),
                team: Some(team),
                at: now,
                text: text.to_owned(),
                answer: None,
            };
            questions::insert(tx, &question).await?;
            tx.record(Subject::Question(question.id), Event::Asked { team });
            questions::find(tx, question.id).await
        })
        .await
    }

    /// Answers a question, or replaces its answer. A public answer is shown to everyone, together with the question.
    #[boxed_future]
    pub async fn answer(
        &self,
        actor: Actor,
        id: QuestionId,
        text: &str,
        is_public: bool,
        now: Timestamp,
    ) -> Result<Question> {
        self.write(actor, now, async |tx| {
            questions::find(tx, id).await?;
            let answer = QuestionAnswer {
                at: now,
                text: text.to_owned(),
                is_public,
            };
            questions::set_answer(tx, id, &answer).await?;
            let public = is_public;
            tx.record(Subject::Question(id), Event::Answered { public });
            questions::find(tx, id).await
        })
        .await
    }

    /// All questions, the newest first.
    #[boxed_future]
    pub async fn questions(&self) -> Result<Vec<Question>> {
        questions::all(&mut *self.database.read.acquire().await?).await
    }
}
