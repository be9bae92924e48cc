//! Announcements of the organisers, questions of teams, and the season's terms of participation.

use faceoff_api::views::announcement::{AnnouncementView, QuestionView, TermsView};
use faceoff_store::{Announcement, Question, Terms};

pub fn view(announcement: Announcement) -> AnnouncementView {
    AnnouncementView {
        id: announcement.id,
        at: announcement.at,
        title: announcement.title,
        text: announcement.text,
    }
}

/// A question; `shows_team` if the viewer may know the asking team.
pub fn question(question: Question, shows_team: bool) -> QuestionView {
    QuestionView {
        id: question.id,
        team: question.team.filter(|_| shows_team),
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

pub fn terms(terms: Terms) -> TermsView {
    TermsView {
        version: terms.version,
        since: terms.since,
        text: terms.text,
    }
}
