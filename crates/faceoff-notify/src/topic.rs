//! Topics: groups of events that clients follow, each about a part of the season that a page shows.

use faceoff_store::{Event, Subject};
use std::{fmt, str::FromStr};

/// A part of the season whose changes can be followed. An event can belong to several topics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topic {
    /// The season itself, its terms and pauses of its queue.
    Season,
    /// All events that can change a board.
    Board,
    /// All events that can change the queue.
    Queue,
    /// Stages and their days.
    Stages,
    Teams,
    Submissions,
    Evaluations,
    Ablations,
    /// Announcements, and questions with their answers.
    Announcements,
    /// Users: organisers and members of teams.
    People,
    /// Registrations of new teams.
    Registrations,
    /// Trials, which never count, and proposed re-evaluations, which count once an organiser applies them.
    Proposals,
    /// Tournaments and their rounds.
    Tournaments,
    Games,
}

impl Topic {
    pub const ALL: [Self; 14] = [
        Self::Season,
        Self::Board,
        Self::Queue,
        Self::Stages,
        Self::Teams,
        Self::Submissions,
        Self::Evaluations,
        Self::Ablations,
        Self::Announcements,
        Self::People,
        Self::Registrations,
        Self::Proposals,
        Self::Tournaments,
        Self::Games,
    ];

    /// The topic's word in filters.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Season => "season",
            Self::Board => "board",
            Self::Queue => "queue",
            Self::Stages => "stages",
            Self::Teams => "teams",
            Self::Submissions => "submissions",
            Self::Evaluations => "evaluations",
            Self::Ablations => "ablations",
            Self::Announcements => "announcements",
            Self::People => "people",
            Self::Registrations => "registrations",
            Self::Proposals => "proposals",
            Self::Tournaments => "tournaments",
            Self::Games => "games",
        }
    }

    /// Whether an event about this subject belongs to the topic.
    #[must_use]
    pub const fn includes(self, subject: Subject, event: &Event) -> bool {
        match self {
            Self::Board => changes_boards(event),
            Self::Queue => changes_queue(event),
            Self::Season => matches!(subject, Subject::Season),
            Self::Stages => matches!(
                subject,
                Subject::Stage(_) | Subject::Day(_) | Subject::DayWithoutStage(_)
            ),
            Self::Teams => matches!(subject, Subject::Team(_)),
            Self::Submissions => matches!(subject, Subject::Submission(_)),
            Self::Evaluations => matches!(subject, Subject::Evaluation(_)),
            Self::Ablations => matches!(subject, Subject::Ablation(_)),
            Self::Announcements => {
                matches!(subject, Subject::Announcement(_) | Subject::Question(_))
            }
            Self::People => matches!(subject, Subject::User(_)),
            Self::Registrations => matches!(subject, Subject::Registration(_)),
            Self::Proposals => matches!(subject, Subject::Proposal(_)),
            Self::Tournaments => matches!(subject, Subject::Tournament(_)),
            Self::Games => matches!(subject, Subject::Game(_)),
        }
    }
}

const fn changes_boards(event: &Event) -> bool {
    matches!(
        event,
        Event::EvaluationFinished { .. }
            | Event::EvaluationVoided { .. }
            | Event::EvaluationApplied { .. }
            | Event::EvaluationPublished
            | Event::DatasetRemoved { .. }
            | Event::DayReleased
            | Event::DayVoided { .. }
            | Event::BoardsFrozen { .. }
            | Event::BoardsUnfrozen
            | Event::StageCreated { .. }
            | Event::StageChanged { .. }
            | Event::StageRulesChanged { .. }
            | Event::StageFinalised
            | Event::TeamRenamed { .. }
            | Event::TeamDescribed { .. }
            | Event::TeamDisqualified { .. }
            | Event::TeamReinstated { .. }
            | Event::TeamRetired
            | Event::TeamReturned
            | Event::DivisionsSet { .. }
    )
}

const fn changes_queue(event: &Event) -> bool {
    matches!(
        event,
        Event::QueuePaused { .. }
            | Event::QueueResumed
            | Event::SubmissionUploaded { .. }
            | Event::SubmissionValid { .. }
            | Event::SubmissionInvalid { .. }
            | Event::SubmissionNotValidated { .. }
            | Event::DayStarted { .. }
            | Event::DayOverdue { .. }
            | Event::MissedDayStarted { .. }
            | Event::EvaluationQueued { .. }
            | Event::EvaluationBegun
            | Event::EvaluationScoringStarted
            | Event::EvaluationFinished { .. }
            | Event::EvaluationAgentFailed
            | Event::EvaluationPlatformFailed { .. }
            | Event::EvaluationCancelled { .. }
            | Event::EvaluationDeadlineMissed { .. }
            | Event::AblationRequested { .. }
            | Event::AblationFinished
            | Event::AblationFailed { .. }
            | Event::ProposalMade { .. }
            | Event::ProposalPlayed
            | Event::ProposalDropped
            | Event::ShardCommitted { .. }
            | Event::JobFailed { .. }
            | Event::RoundStarted { .. }
            | Event::ScheduleReplaysRequested { .. }
            | Event::ScheduleReplaysCancelled { .. }
            | Event::TournamentPaused { .. }
            | Event::TournamentResumed
            | Event::TestOrFriendlyGameQueued { .. }
            | Event::GameBegun { .. }
            | Event::GamePlayed { .. }
            | Event::GamePlatformFailed { .. }
            | Event::GameQueuedAgain
            | Event::GameCancelled { .. }
    )
}

impl fmt::Display for Topic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Topic {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let found = Self::ALL.into_iter().find(|topic| topic.name() == text);
        found.ok_or(())
    }
}
