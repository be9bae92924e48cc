//! Persistence of Faceoff: teams, submissions, evaluations and the job queue in SQLite;
//! bundles, recordings and datasets as artifacts (files) in an object store.
//!
//! All SQL is in this crate, in four modules. `queue` holds jobs (pieces of work for the workers) without
//! knowing their purpose. `tables` defines the rows. `operations` are transactions over both. `queries`
//! reads rows for the API and the pages. Every change goes through the function `Store::write`, which also
//! appends to the events table and then wakes listeners. A process killed at any point leaves either the
//! whole change or none of it.
//!
//! The other modules: `column` has the Rust types of columns, `schema` migrates a database, `readers` and `database` have its
//! connections, `signals` notifies listeners in this process, `program` is the version of Faceoff that opens a database.
//!
//! The store runs no agent, computes no score and reads no clock: instants are passed in. Per-step
//! data never enters the database.
//!
//! # Durability
//! Write-ahead log with `synchronous = FULL`: a change that a function has reported survives `kill -9`
//! and a power cut. SQLite has one writer, so there is one write connection. Every transaction on it
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
mod free_space;
mod health;
mod health_probes;
mod operations;
mod program;
mod queries;
mod queue;
mod readers;
mod schema;
mod signals;
mod store;
mod tables;
mod write;
mod write_ahead_log;

/// `#[boxed_future]` on a public `async fn` makes it return a boxed future. Each crate that awaits an `async fn` compiles its body; if
/// the future is boxed, only the store does. This saves the server, the workers and every test from compiling it. A call costs one
/// allocation.
pub(crate) use async_recursion::async_recursion as boxed_future;

pub use artifacts::{AblationPart, ArtifactStream, Artifacts};
pub use error::StoreError;
pub use event::{Actor, Change, Event, EventRecord, ParseEventError, Subject};
pub use free_space::{DiskSpace, FreeSpace};
pub use health::{Health, QueueHealth};
pub use operations::{
    announcements::MAX_OPEN_QUESTIONS,
    archive_snapshot::{DatabaseSnapshot, MissingSummaries},
    backup::CheckedDatabase,
    claim_job::MAX_LEASES,
    cleanup::{
        ENDED_CREDENTIALS_KEPT_FOR, INVALID_LOGS_KEPT, PLATFORM_FAILED_BUNDLES_KEPT_FOR,
        RECORDINGS_KEPT_FOR,
    },
    commit_job::CommitOutcome,
    ended_credentials::EndedCredentials,
    invitations::{CodeStatus, JoinOutcome, JoinRequest, MAX_OPEN_INVITATIONS, NewInvitation},
    job_purpose::JobFilter,
    jobs::{ClaimedJob, Job, RunSeeds},
    lease_release::MAX_PLATFORM_FAULTS,
    proposals::Reevaluation,
    registrations::{MAX_PENDING_REGISTRATIONS, NewRegistration},
    requester::Requester,
    rerun_evaluation::RERUN_PAUSES_S,
    retention::{FILES_KEPT_FOR, RemovalSummary},
    runs::RunOwner,
    stages::{NewStage, StageChange},
    submission_description::SubmissionDescription,
    teams::TeamChange,
    tokens::{
        LAST_USE_INTERVAL, MAX_TOKENS, NewToken, Principal, RevocationExtent, RevokedToken,
        SESSION_LIFETIME, TokenRejection, VerifiedToken,
    },
    tournament::{
        entrants::DepartureRequest,
        open_tournament::{NewTournament, TournamentChange},
        schedule_replays::MAX_SCHEDULE_REPLAYS,
    },
    webhooks::{
        DELIVERIES_KEPT_FOR, DISABLED_AFTER, DeliveryOutcome, MAX_ORGANISER_WEBHOOKS,
        MAX_PENDING_DELIVERIES, MAX_TEAM_WEBHOOKS, NewWebhook, OLD_SECRET_VALID_FOR,
        PlannedDeliveries, WebhookChange,
    },
};
pub use program::Program;
pub use queries::{
    board::{BoardRecord, BoardScope},
    board_days::{BoardDays, DayScore},
    evaluations::EvaluationFilter,
    gauges::Gauges,
    queue_forecast::{EvaluationBacklog, QueueForecast, QueuePosition},
    runs::RunFaults,
    storage::{StorageScope, TeamStorage},
    subject_contexts::SubjectContext,
    tournaments::{GameFilter, TournamentRecord},
    worker_bans::WorkerResults,
};
pub use queue::JobClaim;
pub use schema::Upgrade;
pub use store::Store;
pub use tables::{
    ablations::{Ablation, AblationState},
    announcements::Announcement,
    archive::{ArchivedArtifact, ArchivedSeason, ArtifactOwner, Edition, ParseEditionError},
    bundles::{UploadQuota, UploadUsage},
    days::Day,
    decision_records::DecisionRecord,
    deliveries::{Delivery, DeliveryAttempt, DeliveryState},
    entrants::{Departure, Entrant},
    evaluations::{Evaluation, EvaluationState, ProposedEvaluation},
    events::EventFilter,
    game_attempts::{AttemptEnd, AttemptOutcome, GameAttempt},
    games::{
        Game, GameCommit, GamePurpose, GameRecording, GameState, ScheduleEntry, StoredGameResult,
    },
    invitations::{Invitation, InvitationRole, InvitationState},
    job_durations::JobDurations,
    proposals::{Proposal, ProposalKind, ProposalOutcome},
    questions::{Question, QuestionAnswer},
    registrations::{Registration, RegistrationState},
    required_artifacts::RequiredArtifact,
    rounds::{DrawnMatchday, DrawnRound, RoundBye, TournamentRound},
    run_plan::RunPlan,
    run_progress::{RunProgress, ShardProgress},
    runs::Run,
    season::Season,
    shards::{Shard, ShardCommit},
    sign_offs::SignOff,
    stages::{Revision, Stage, StagePhase},
    submissions::{DeletionRequest, Submission, SubmissionState},
    teams::{Team, TeamProfile},
    terms::Terms,
    tokens::{Creator, Token, TokenFilter, TokenKind, TokenOwner},
    tournaments::Tournament,
    users::User,
    webhooks::{DisabledWebhook, Webhook, WebhookSecrets},
    worker_bans::WorkerBan,
};
pub use write_ahead_log::MAX_LOG_BYTES;
