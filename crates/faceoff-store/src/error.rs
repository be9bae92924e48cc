//! [`StoreError`]: why an operation of the store failed.

use crate::program::Program;
use faceoff_types::{SubmissionId, is_full_disk};
use jiff::{Timestamp, civil::Date};
use sqlx::{error::DatabaseError, migrate::MigrateError};
use std::{error::Error, fmt::Display};

/// Why an operation of the store failed.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// There is no entity or artifact with the given id or key; the text names its kind.
    #[error("{0} not found")]
    NotFound(&'static str),
    /// The outcomes of an old run's single episodes were removed; its summary and its dataset remain.
    #[error("the run's single outcomes were removed at {at}; its dataset has them")]
    OutcomesRemoved {
        /// When they were removed.
        at: Timestamp,
    },
    /// Names that look alike count as the same; this is the existing one.
    #[error("a team named {0:?} exists already")]
    TeamNameTaken(String),
    /// The cutoff (the start of the evaluations) of the day, or of a later one, has passed.
    #[error("the cutoff of {day} was at {cutoff_at}")]
    CutoffPassed {
        /// The requested day, or a later one.
        day: Date,
        cutoff_at: Timestamp,
    },
    /// Names that differ only in case count as the same.
    #[error("a stage named {0:?} exists already")]
    StageNameTaken(String),
    /// Names that differ only in case count as the same.
    #[error("a tournament named {0:?} exists already")]
    TournamentNameTaken(String),
    /// The team has requested as many test games and friendly games as it may on one UTC day.
    #[error("{used} of {limit} test and friendly games were requested today")]
    GameQuotaExceeded { limit: u32, used: u32 },
    /// The stage is not open yet, or is closed.
    #[error("the stage {name:?} {}", match closed_at {
        Some(at) => format!("closed at {at}"),
        None => format!("opens at {opens_at}"),
    })]
    StageNotOpen {
        name: String,
        /// When the stage opens, or opened.
        opens_at: Timestamp,
        /// When the stage closed, if it did.
        closed_at: Option<Timestamp>,
    },
    /// A disqualified team can neither upload nor compete.
    #[error("the team was disqualified at {at}: {reason}")]
    Disqualified {
        /// When the team was disqualified.
        at: Timestamp,
        /// Shown publicly.
        reason: String,
    },
    /// The team has retired from the season.
    #[error("the team retired at {at}")]
    TeamRetired {
        /// When the team retired.
        at: Timestamp,
    },
    /// No member of the team has accepted the current terms.
    #[error("no member of the team has accepted version {version} of the terms")]
    TermsNotAccepted { version: u32 },
    /// The request's token was revoked or replaced, or its user removed, while the request was under way.
    #[error("the token of the request is no longer valid")]
    TokenInvalid,
    /// Names that differ only in case count as the same.
    #[error("a user named {0:?} exists already")]
    UserNameTaken(String),
    /// The invitation link is expired, used or revoked; the text says which.
    #[error("{0}")]
    InvitationInvalid(String),
    /// The team has used an idempotency key for another bundle before.
    #[error("the key was used for the submission {submission}, whose bundle is another one")]
    IdempotencyKeyUsed {
        /// The earlier submission.
        submission: SubmissionId,
    },
    /// The season is closed: it accepts no uploads and runs no evaluations.
    #[error("the season was closed at {closed_at}")]
    SeasonClosed { closed_at: Timestamp },
    /// The season was imported from an archive and is read-only.
    #[error("the season is archived as it was at {made_at}")]
    Archived {
        /// When the archive was made.
        made_at: Timestamp,
        /// When it was imported into this data folder.
        imported_at: Option<Timestamp>,
    },
    /// The team has used its upload quota of the UTC day.
    #[error(
        "{used_bytes} of {limit_bytes} bytes of the day are used; the bundle has {bundle_bytes}"
    )]
    DailyQuotaExceeded {
        limit_bytes: u64,
        used_bytes: u64,
        bundle_bytes: u64,
    },
    /// The team's bundles fill its storage quota.
    #[error("{used_bytes} of {limit_bytes} bytes are stored; the bundle has {bundle_bytes}")]
    StorageQuotaExceeded {
        limit_bytes: u64,
        used_bytes: u64,
        bundle_bytes: u64,
    },
    /// The state of the requested team, evaluation or other resource does not allow the request; the text says why, and
    /// what to do.
    #[error("{0}")]
    Conflict(String),
    /// A disk is full. The operation was not done, or may not be; it can be repeated once there is space.
    #[error("the disk is full: {0}")]
    DiskFull(String),
    /// A later version of the program has migrated the database.
    #[error(
        "the database is of a later version of Faceoff: {} has its migration {schema}, this is {} and knows {}; use that \
         version, or a later one, or restore a backup from before it",
        program.as_deref().unwrap_or("another"), this.version, this.schema
    )]
    NewerDatabase {
        /// Number of the newest migration in the database.
        schema: i64,
        /// The version that opened the database last; `None` if it did not record itself.
        program: Option<String>,
        /// The version that refuses the database.
        this: Program,
    },
    #[error("database: {0}")]
    Database(#[source] sqlx::Error),
    /// The object store failed.
    #[error("artifacts: {0}")]
    Artifacts(String),
    /// A stored value does not have the form in which this program writes it.
    #[error("stored value is damaged: {0}")]
    Damaged(String),
}

/// Result of the store's functions.
pub(crate) type Result<T, E = StoreError> = std::result::Result<T, E>;

impl From<sqlx::Error> for StoreError {
    fn from(error: sqlx::Error) -> Self {
        match error {
            sqlx::Error::ColumnDecode { index, source } => {
                Self::Damaged(format!("column {index}: {source}"))
            }
            sqlx::Error::Database(error) if is_full(&*error) => Self::DiskFull(error.to_string()),
            error => Self::Database(error),
        }
    }
}

impl From<MigrateError> for StoreError {
    fn from(error: MigrateError) -> Self {
        Self::Database(error.into())
    }
}

/// SQLITE_FULL, or SQLITE_IOERR_SHMSIZE: the index of the write-ahead log could not grow.
fn is_full(error: &dyn DatabaseError) -> bool {
    /// Result codes of SQLite, as sqlx formats them.
    const CODES: [&str; 2] = ["13", "4874"];
    error
        .code()
        .is_some_and(|code| CODES.contains(&code.as_ref()))
}

impl StoreError {
    /// Refuses a request with [`Conflict`](Self::Conflict).
    pub(crate) fn conflict<T>(reason: impl Into<String>) -> Result<T> {
        Err(Self::Conflict(reason.into()))
    }

    /// The error for an artifact that could not be read or written.
    pub(crate) fn artifact(context: impl Display, error: &(dyn Error + 'static)) -> Self {
        let text = format!("{context}: {error}");
        if is_full_disk(error) {
            Self::DiskFull(text)
        } else {
            Self::Artifacts(text)
        }
    }

    /// For a failed statement: `duplicate` if it violated a uniqueness constraint whose columns contain `column`.
    pub(crate) fn if_duplicate(
        column: &str,
        duplicate: impl FnOnce() -> Self,
    ) -> impl FnOnce(sqlx::Error) -> Self {
        move |error| match error.as_database_error() {
            Some(found) if found.is_unique_violation() && found.message().contains(column) => {
                duplicate()
            }
            _ => error.into(),
        }
    }
}
