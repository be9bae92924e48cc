//! [`Subject`]: the entity that an event concerns, and its stored forms.

use super::parse_error::ParseEventError;
use faceoff_types::{
    AblationId, AnnouncementId, EvaluationId, GameId, ProposalId, QuestionId, RegistrationId,
    StageDay, StageId, SubmissionId, TeamId, TournamentId, UserId,
};
use jiff::civil::Date;
use std::{fmt, str::FromStr};

/// The entity that a change concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Subject {
    /// The season; a data folder has one.
    Season,
    Stage(StageId),
    /// A day of a stage.
    Day(StageDay),
    /// A day from before there were stages; stored as `day` without a stage.
    DayWithoutStage(Date),
    Team(TeamId),
    /// A submission with its validation run.
    Submission(SubmissionId),
    /// An evaluation with its run and its scoring.
    Evaluation(EvaluationId),
    /// An ablation with its runs.
    Ablation(AblationId),
    /// A user with an account; stored as `person`.
    User(UserId),
    Registration(RegistrationId),
    Announcement(AnnouncementId),
    /// A team's question to the organisers, with its answer.
    Question(QuestionId),
    /// A trial or a proposed re-evaluation with its runs.
    Proposal(ProposalId),
    Tournament(TournamentId),
    /// One game with its attempts.
    Game(GameId),
}

impl Subject {
    /// Kind and id, as in the columns of the events table.
    pub(crate) fn columns(self) -> (&'static str, String) {
        match self {
            Self::Season => ("season", String::new()),
            Self::Stage(id) => ("stage", id.to_string()),
            Self::Day(stage_day) => ("day", stage_day.to_string()),
            Self::DayWithoutStage(date) => ("day", date.to_string()),
            Self::Team(id) => ("team", id.to_string()),
            Self::Submission(id) => ("submission", id.to_string()),
            Self::Evaluation(id) => ("evaluation", id.to_string()),
            Self::Ablation(id) => ("ablation", id.to_string()),
            Self::User(id) => ("person", id.to_string()),
            Self::Registration(id) => ("registration", id.to_string()),
            Self::Announcement(id) => ("announcement", id.to_string()),
            Self::Question(id) => ("question", id.to_string()),
            Self::Proposal(id) => ("proposal", id.to_string()),
            Self::Tournament(id) => ("tournament", id.to_string()),
            Self::Game(id) => ("game", id.to_string()),
        }
    }

    pub(crate) fn from_columns(kind: &str, id: &str) -> Result<Self, ParseEventError> {
        let unknown = || ParseEventError(format!("{kind} {id}"));
        Ok(match kind {
            "season" => Self::Season,
            "stage" => Self::Stage(id.parse().map_err(|_| unknown())?),
            "day" if id.contains('/') => Self::Day(id.parse().map_err(|_| unknown())?),
            "day" => Self::DayWithoutStage(id.parse().map_err(|_| unknown())?),
            "team" => Self::Team(id.parse().map_err(|_| unknown())?),
            "submission" => Self::Submission(id.parse().map_err(|_| unknown())?),
            "evaluation" => Self::Evaluation(id.parse().map_err(|_| unknown())?),
            "ablation" => Self::Ablation(id.parse().map_err(|_| unknown())?),
            "person" => Self::User(id.parse().map_err(|_| unknown())?),
            "registration" => Self::Registration(id.parse().map_err(|_| unknown())?),
            "announcement" => Self::Announcement(id.parse().map_err(|_| unknown())?),
            "question" => Self::Question(id.parse().map_err(|_| unknown())?),
            "proposal" => Self::Proposal(id.parse().map_err(|_| unknown())?),
            "tournament" => Self::Tournament(id.parse().map_err(|_| unknown())?),
            "game" => Self::Game(id.parse().map_err(|_| unknown())?),
            _ => return Err(unknown()),
        })
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, id) = self.columns();
        match id.as_str() {
            "" => f.write_str(kind),
            id => write!(f, "{kind}:{id}"),
        }
    }
}

impl FromStr for Subject {
    type Err = ParseEventError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let (kind, id) = s.split_once(':').unwrap_or((s, ""));
        Self::from_columns(kind, id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subject_parses_back_from_columns_and_text() {
        let subjects = [
            Subject::Season,
            Subject::Stage(StageId::new()),
            Subject::Day(StageDay {
                stage: StageId::new(),
                date: jiff::civil::date(2026, 3, 1),
            }),
            Subject::DayWithoutStage(jiff::civil::date(2026, 3, 1)),
            Subject::Team(TeamId::new()),
            Subject::Submission(SubmissionId::new()),
            Subject::Evaluation(EvaluationId::new()),
            Subject::Ablation(AblationId::new()),
            Subject::User(UserId::new()),
            Subject::Registration(RegistrationId::new()),
            Subject::Announcement(AnnouncementId::new()),
            Subject::Question(QuestionId::new()),
            Subject::Proposal(ProposalId::new()),
            Subject::Tournament(TournamentId::new()),
            Subject::Game(GameId::new()),
        ];
        for subject in subjects {
            let (kind, id) = subject.columns();
            assert_eq!(Subject::from_columns(kind, &id), Ok(subject));
            assert_eq!(subject.to_string().parse(), Ok(subject));
        }
        assert!(Subject::from_columns("team", "none").is_err());
    }
}
