//! Announcements, questions and the terms.

use faceoff_types::{AnnouncementId, QuestionId, TeamId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An announcement of the organisers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AnnouncementView {
    /// Id of the announcement.
    pub id: AnnouncementId,
    /// When it was published.
    pub at: Timestamp,
    /// One line of plain text.
    pub title: String,
    /// Plain text of one or more lines.
    pub text: String,
}

/// A team's question to the organisers, with their answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct QuestionView {
    /// Id of the question.
    pub id: QuestionId,
    /// The asking team; visible only to the team and to organisers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// When it was asked.
    pub at: Timestamp,
    /// Plain text of one or more lines.
    pub text: String,
    /// Plain text; null until answered.
    pub answer: Option<String>,
    /// When it was answered; null until then.
    pub answered_at: Option<Timestamp>,
    /// Whether question and answer are public.
    pub public: bool,
}

/// A version of the terms of participation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TermsView {
    /// From 1. The newest version applies.
    pub version: u32,
    /// When this version was published.
    pub since: Timestamp,
    /// Plain text of one or more lines.
    pub text: String,
}
