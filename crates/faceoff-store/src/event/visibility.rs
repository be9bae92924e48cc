//! Visibility of events: public ones are in the feed that needs no account.

use super::Event;

impl Event {
    /// Is an event of this kind public with all of its fields? The fields of a public event are also shown on a public page: a
    /// board, an evaluation's page, the announcements or the season's page. An event of a single evaluation is public only if
    /// the evaluation is, too; this function does not check that.
    #[must_use]
    pub const fn is_public(&self) -> bool {
        match self {
            Self::TeamCreated { .. }
            | Self::TeamRenamed { .. }
            | Self::TeamDescribed { .. }
            | Self::TeamMadeBaseline
            | Self::TeamMadeRanked
            | Self::TeamRetired
            | Self::TeamReturned
            | Self::TeamDisqualified { .. }
            | Self::TermsPublished { .. }
            | Self::DivisionsSet { .. }
            | Self::RegistrationOpened
            | Self::RegistrationClosed
            | Self::Announced { .. }
            | Self::EvaluationFinished { .. }
            | Self::EvaluationAgentFailed
            | Self::EvaluationPlatformFailed { .. }
            | Self::EvaluationCancelled { .. }
            | Self::EvaluationDeadlineMissed { .. }
            | Self::EvaluationVoided { .. }
            | Self::EvaluationPublished
            | Self::ExtraEvaluationAdded { .. }
            | Self::DayStarted { .. }
            | Self::DayOverdue { .. }
            | Self::DayReleased
            | Self::DayVoided { .. }
            | Self::MissedDayStarted { .. }
            | Self::BoardsFrozen { .. }
            | Self::BoardsUnfrozen
            | Self::StageCreated { .. }
            | Self::StageChanged { .. }
            | Self::StageRulesChanged { .. }
            | Self::StageFinalStarted { .. }
            | Self::StageFinalised
            | Self::StageRetentionChanged { .. }
            | Self::TournamentOpened { .. }
            | Self::TournamentPaused { .. }
            | Self::TournamentResumed
            | Self::TournamentClosed
            | Self::TeamsEntered { .. }
            | Self::EntrantRemoved { .. }
            | Self::TeamLeftTournament { .. }
            | Self::RoundStarted { .. }
            | Self::RoundOver { .. }
            | Self::DatasetRemoved { .. }
            | Self::QueuePaused { .. }
            | Self::QueueResumed
            | Self::SeasonNamed { .. }
            | Self::SeasonClosed => true,
            Self::ClockStepAccepted { .. }
            | Self::WorkerBanned { .. }
            | Self::WorkerReadmitted { .. }
            | Self::TokenReplaced
            | Self::TokenCreated { .. }
            | Self::TokenRotated { .. }
            | Self::TokenRevoked { .. }
            | Self::Invited { .. }
            | Self::InvitationRevoked { .. }
            | Self::UserJoined { .. }
            | Self::UserRenamed { .. }
            | Self::UserLeft { .. }
            | Self::SignedIn
            | Self::PasswordSet
            | Self::TermsAccepted { .. }
            | Self::TeamRegistered { .. }
            | Self::RegistrationApproved { .. }
            | Self::RegistrationRefused { .. }
            | Self::TeamReinstated { .. }
            | Self::Asked { .. }
            | Self::Answered { .. }
            | Self::SubmissionUploaded { .. }
            | Self::SubmissionValid { .. }
            | Self::SubmissionInvalid { .. }
            | Self::SubmissionNotValidated { .. }
            | Self::SubmissionActivated
            | Self::SubmissionWithdrawn
            | Self::SubmissionLabelled { .. }
            | Self::SubmissionNoted
            | Self::SubmissionExcluded { .. }
            | Self::SubmissionDeleted { .. }
            | Self::BundleRemoved { .. }
            | Self::EvaluationQueued { .. }
            | Self::EvaluationBegun
            | Self::EvaluationScoringStarted
            | Self::EvaluationApplied { .. }
            | Self::AblationRequested { .. }
            | Self::AblationFinished
            | Self::AblationFailed { .. }
            | Self::ProposalMade { .. }
            | Self::ProposalPlayed
            | Self::ProposalApplied
            | Self::ProposalDropped
            | Self::ShardCommitted { .. }
            // These also concern test games and friendly games, which are not public.
            | Self::TestOrFriendlyGameQueued { .. }
            | Self::GameBegun { .. }
            | Self::GamePlayed { .. }
            | Self::GamePlatformFailed { .. }
            | Self::GameVoided { .. }
            | Self::GameQueuedAgain
            | Self::GameCancelled { .. }
            | Self::TournamentChanged { .. }
            | Self::ScheduleReplaysRequested { .. }
            | Self::ScheduleReplaysCancelled { .. }
            | Self::FriendlyGamesDeclined { .. }
            | Self::WebhookCreated { .. }
            | Self::WebhookChanged { .. }
            | Self::WebhookRotated { .. }
            | Self::WebhookRemoved { .. }
            | Self::WebhookDisabled { .. }
            | Self::JobFailed { .. } => false,
        }
    }
}
