//! Announcements, questions and the terms.

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
