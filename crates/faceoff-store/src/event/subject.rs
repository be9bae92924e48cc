use super::parse::ParseEventError;
use faceoff_types::{
    AblationId, AnnouncementId, EvaluationId, GameId, PersonId, ProposalId, QuestionId,
    RegistrationId, StageDay, StageId, SubmissionId, TeamId, TournamentId,
};
use jiff::civil::Date;
use std::{fmt, str::FromStr};

/// What a change is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Subject {
    /// The season, of which a data folder has one.
    Season,
    Stage(StageId),
    /// A day of a stage.
    Day(StageDay),
    /// A day from before there were stages.
    DayOfNone(Date),
    Team(TeamId),
    /// An upload and its smoke run.
    Submission(SubmissionId),
    /// An evaluation with its run and its scoring.
    Evaluation(EvaluationId),
    /// An ablation with its runs.
    Ablation(AblationId),
    /// Somebody with an account.
    Person(PersonId),
    /// A team's wish to take part.
    Registration(RegistrationId),
    /// What is told to everybody.
    Announcement(AnnouncementId),
    /// What a team asks.
    Question(QuestionId),
    /// A trial or a re-evaluation with its runs.
    Proposal(ProposalId),
    Tournament(TournamentId),
    /// One game with its attempts.
    Game(GameId),
}

impl Subject {
    /// As the columns of the events table have it: kind and id.
    pub(crate) fn columns(self) -> (&'static str, String) {
        match self {
            Self::Season => ("season", String::new()),
            Self::Stage(id) => ("stage", id.to_string()),
            Self::Day(of) => ("day", of.to_string()),
            Self::DayOfNone(date) => ("day", date.to_string()),
            Self::Team(id) => ("team", id.to_string()),
            Self::Submission(id) => ("submission", id.to_string()),
            Self::Evaluation(id) => ("evaluation", id.to_string()),
            Self::Ablation(id) => ("ablation", id.to_string()),
            Self::Person(id) => ("person", id.to_string()),
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
            "day" => Self::DayOfNone(id.parse().map_err(|_| unknown())?),
            "team" => Self::Team(id.parse().map_err(|_| unknown())?),
            "submission" => Self::Submission(id.parse().map_err(|_| unknown())?),
            "evaluation" => Self::Evaluation(id.parse().map_err(|_| unknown())?),
            "ablation" => Self::Ablation(id.parse().map_err(|_| unknown())?),
            "person" => Self::Person(id.parse().map_err(|_| unknown())?),
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
    fn subjects_read_back_as_they_are_written() {
        let subjects = [
            Subject::Season,
            Subject::Stage(StageId::new()),
            Subject::Day(StageDay {
                stage: StageId::new(),
                date: jiff::civil::date(2026, 3, 1),
            }),
            Subject::DayOfNone(jiff::civil::date(2026, 3, 1)),
            Subject::Team(TeamId::new()),
            Subject::Submission(SubmissionId::new()),
            Subject::Evaluation(EvaluationId::new()),
            Subject::Ablation(AblationId::new()),
            Subject::Person(PersonId::new()),
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
