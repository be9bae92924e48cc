//! What Faceoff remembers: teams, submissions, evaluations, shards and the queue of work in SQLite,
//! bundles, recordings and datasets as artifacts in an object store.
//!
//! SQL stays in here, in three levels: the queue, whose units know nothing of what they are for; the
//! tables, with their rows; the operations, which are transactions over both. Reads stand beside the
//! operations. Every change goes through one function, which also appends to the events table and
//! then wakes listeners, so that a process killed at any point leaves either all of it or nothing.
//! The store runs no agent, computes no score and reads no clock: instants are passed in. Per-step
//! data never enters the database.
//!
//! # Durability
//! Write-ahead log with `synchronous = FULL`: what a function has returned survives `kill -9` and a
//! power cut. SQLite has one writer, so there is one write connection, and every transaction on it
//! begins IMMEDIATE: it waits for another process's writer instead of failing half way.
//!
//! # Queries
//! All SQL is checked at compile time. `.sqlx/` at the workspace root holds what the check needs
//! without a database; after a change of SQL or of a migration run `crates/faceoff-store/prepare.sh`
//! (`--check` compares instead of writing).

mod artifacts;
mod checkpoint;
mod column;
mod database;
mod error;
mod event;
mod health;
mod live;
mod log;
mod operations;
mod program;
mod pulse;
mod queue;
mod reads;
mod room;
mod schema;
mod signals;
mod store;
mod tables;
mod workers;
mod write;

/// What others await is boxed. The body of an `async fn` is compiled by each crate that awaits it, and by none
/// before: the web side, the workers and every file of tests compiled the store's again. A call costs an allocation.
pub(crate) use async_recursion::async_recursion as boxed;

pub use artifacts::{ArtifactStream, Artifacts};
pub use error::StoreError;
pub use event::{Actor, Change, Event, EventRecord, ParseEventError, Subject};
pub use health::{Health, QueueHealth};
pub use live::{LIVE_GAMES_KEPT, LiveGames, LiveMark, LiveNews, LiveWatch};
pub use log::LOG_BOUND_BYTES;
pub use operations::{
    announcements::MAX_OPEN_QUESTIONS,
    backup::CheckedDatabase,
    claim::MAX_LEASES,
    commit::Committed,
    describe_submission::SubmissionWords,
    give_back::MAX_ATTEMPTS,
    invitations::{Code, Joined, Joining, MAX_OPEN_INVITATIONS, NewInvitation},
    proposals::Reevaluation,
    purpose::Lot,
    registrations::{MAX_WAITING, NewRegistration},
    rerun::RERUN_PAUSES_S,
    retention::{FILES_KEPT, Removed},
    runs::RunOwner,
    snapshot::Snapshot,
    stages::{NewStage, StageChange},
    teams::TeamChange,
    tidy::{RECORDINGS_KEPT, UNCHECKED_KEPT},
    tokens::{Holder, LAST_USE, MAX_TOKENS, NewToken, Refusal, SESSION, Who},
    tournament::{
        entrants::Leaving,
        open::{NewTournament, TournamentChange},
        replays::MAX_REPLAYS,
    },
    webhooks::{
        AttemptMeans, DELIVERIES_KEPT, FAILING_FOR, MAX_ORGANISER_WEBHOOKS, MAX_TEAM_WEBHOOKS,
        MAX_WAITING_DELIVERIES, NewWebhook, OLD_SECRET, PlannedDeliveries, WebhookChange,
    },
    work::{Claimed, RunSeeds, Work},
};
pub use program::Program;
pub use queue::Claim;
pub use reads::{
    board::{BoardRecord, BoardScope},
    concerns::Concern,
    evaluations::EvaluationsOf,
    numbers::Numbers,
    outlook::{OpenWork, Outlook, QueuePlace},
    runs::RunFaults,
    standings::BoardDays,
    storage::{Counted, TeamStorage},
    tournaments::{GamesOf, TournamentRecord},
    worker_bans::PlayedBy,
};
pub use room::{DiskSpace, Room};
pub use schema::Upgrade;
pub use store::Store;
pub use tables::{
    ablations::{Ablation, AblationState},
    announcements::Announcement,
    archived::{Archived, Edition, KeptArtifact, KeptOf, ParseEditionError},
    bundles::{UploadQuota, UploadUsage},
    days::Day,
    deliveries::{Delivery, DeliveryAttempt, DeliveryState},
    drafts::Draft,
    entrants::{Entrant, Leave},
    evaluations::{Evaluation, EvaluationState},
    events::EventFilter,
    finalised::Finalised,
    game_attempts::{AttemptEnd, AttemptOutcome, GameAttempt},
    games::{Game, GameCommit, GamePurpose, GameRecording, GameResultRow, GameState, Meeting},
    invitations::{Invitation, InvitationState, InvitedAs},
    measured::Measured,
    needed::Needed,
    people::Person,
    plan::RunPlan,
    proposals::{Proposal, ProposalKind, Settled},
    questions::{Question, Reply},
    registrations::{Registration, RegistrationState},
    rounds::{DrawnMatchday, DrawnRound, RoundBye, TournamentRound},
    rulings::Ruling,
    runs::{Clearable, Run},
    season::Season,
    shards::{Shard, ShardCommit},
    stages::{Revision, Stage, StagePhase},
    submissions::{Deletion, Submission, SubmissionState},
    teams::{Team, TeamProfile},
    terms::Terms,
    tokens::{Token, TokenKind, TokenOwner},
    tournaments::Tournament,
    webhooks::{DeadWebhook, Webhook, WebhookKeys},
    worker_bans::WorkerBan,
};
pub use workers::{
    NoWorkerName, Storing, WORKER_SILENT, WorkTold, WorkerAbout, WorkerBusy, WorkerHeard,
    WorkerName, Workers,
};
