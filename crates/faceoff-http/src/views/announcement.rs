//! Announcements, questions and the terms.

use faceoff_store::{Announcement, Question, Terms};
use faceoff_types::{AnnouncementId, QuestionId, TeamId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What the organisers tell everybody.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AnnouncementView {
    /// Names it.
    pub id: AnnouncementId,
    /// When.
    pub at: Timestamp,
    /// One line.
    pub title: String,
    /// Plain text.
    pub text: String,
}

impl From<Announcement> for AnnouncementView {
    fn from(announcement: Announcement) -> Self {
        Self {
            id: announcement.id,
            at: announcement.at,
            title: announcement.title,
            text: announcement.text,
        }
    }
}

/// What a team asks the organisers, and what they answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct QuestionView {
    /// Names it.
    pub id: QuestionId,
    /// Who asks; absent for everybody but that team and the organisers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// When.
    pub at: Timestamp,
    /// Plain text.
    pub text: String,
    /// Plain text; null: not yet.
    pub answer: Option<String>,
    /// When.
    pub answered_at: Option<Timestamp>,
    /// May everybody read it?
    pub public: bool,
}

impl QuestionView {
    /// For somebody who may know who asks, or may not.
    pub(crate) fn of(question: Question, tells_team: bool) -> Self {
        Self {
            id: question.id,
            team: question.team.filter(|_| tells_team),
            at: question.at,
            text: question.text,
            answered_at: question.answer.as_ref().map(|answer| answer.at),
            public: question
                .answer
                .as_ref()
                .is_some_and(|answer| answer.is_public),
            answer: question.answer.map(|answer| answer.text),
        }
    }
}

/// What taking part means, as people accept it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TermsView {
    /// From 1; the newest is what counts.
    pub version: u32,
    /// When it was published.
    pub since: Timestamp,
    /// Plain text.
    pub text: String,
}

impl From<Terms> for TermsView {
    fn from(terms: Terms) -> Self {
        Self {
            version: terms.version,
            since: terms.since,
            text: terms.text,
        }
    }
}
