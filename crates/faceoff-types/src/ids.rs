//! Ids of teams, submissions, evaluations and other resources: one type per kind of resource, each a UUID.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};
use uuid::Uuid;

/// Text that is not an id of the expected kind.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is not a {kind} id: expected a UUID")]
pub struct ParseIdError {
    kind: &'static str,
    text: String,
}

macro_rules! id {
    ($(#[$doc:meta])* $name:ident, $kind:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
        #[serde(transparent)]
        pub struct $name(Uuid);

        impl $name {
            /// A new id; ids sort by their time of creation (UUID version 7).
            #[must_use]
            pub fn new() -> Self {
                Self(Uuid::now_v7())
            }

            #[must_use]
            pub const fn as_uuid(self) -> Uuid {
                self.0
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self::new()
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }

        impl FromStr for $name {
            type Err = ParseIdError;
            fn from_str(s: &str) -> Result<Self, Self::Err> {
                Uuid::parse_str(s)
                    .map(Self)
                    .map_err(|_| ParseIdError { kind: $kind, text: s.chars().take(64).collect() })
            }
        }

        impl From<Uuid> for $name {
            fn from(uuid: Uuid) -> Self {
                Self(uuid)
            }
        }
    };
}

id!(TeamId, "team");
id!(
    /// A part of a season with its own days, rules and board. The seeds of its days derive from its id.
    StageId,
    "stage"
);
id!(SubmissionId, "submission");
id!(
    /// One run of a submission over the tasks of a profile.
    EvaluationId,
    "evaluation"
);
id!(
    /// An ablation: a submission evaluated in the ideal simulator, with each perturbation alone, and with all, to show what
    /// each of them costs.
    AblationId,
    "ablation"
);
id!(
    /// The episodes of an evaluation or ablation under one profile, split into shards.
    RunId,
    "run"
);
id!(
    /// A range of episodes of one task of a run, played as one job.
    ShardId,
    "shard"
);
id!(
    /// A person with an account: an organiser, or a member of a team.
    UserId,
    "person"
);
id!(
    /// A named API token of a user, a team or the host (the server's operator).
    TokenId,
    "token"
);
id!(
    /// A link with which one person joins, once.
    InvitationId,
    "invitation"
);
id!(
    /// A team's request to take part.
    RegistrationId,
    "registration"
);
id!(
    /// A public message from the organisers.
    AnnouncementId,
    "announcement"
);
id!(
    /// A team's question to the organisers.
    QuestionId,
    "question"
);
id!(
    /// Evaluations that do not count: a trial, or a proposed re-evaluation until it is applied.
    ProposalId,
    "proposal"
);
id!(TournamentId, "tournament");
id!(
    /// A game between two submissions.
    GameId,
    "game"
);
id!(
    /// An HTTP address that is notified of events.
    WebhookId,
    "webhook"
);
id!(
    /// One event for one webhook, however often its delivery is tried.
    DeliveryId,
    "delivery"
);
