use crate::program::Program;
use faceoff_types::tells_of_full_disk;
use jiff::{Timestamp, civil::Date};
use sqlx::error::DatabaseError;
use std::{error::Error, fmt::Display};

/// Why the store could not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// No such team, submission, evaluation or artifact.
    #[error("{0} not found")]
    NotFound(&'static str),
    /// The outcomes of a run that has long been over; its summary and its dataset have what is asked for.
    #[error("the run's single outcomes were removed at {at}; its dataset has them")]
    Cleared {
        at: Timestamp,
    },
    /// Names that differ only in case count as the same.
    #[error("a team named {0:?} exists already")]
    TeamNameTaken(String),
    /// The day has had its cut, and has no other.
    #[error("{day} had its cut at {cut_at}")]
    DayHasCut {
        /// The day, or a later one.
        day: Date,
        cut_at: Timestamp,
    },
    /// Names that differ only in case count as the same.
    #[error("a stage named {0:?} exists already")]
    StageNameTaken(String),
    /// Names that differ only in case count as the same.
    #[error("a tournament named {0:?} exists already")]
    TournamentNameTaken(String),
    /// The team has asked for as many games that do not count as it may on one UTC day.
    #[error("{used} of {limit} games that do not count were asked for today")]
    FreeGamesSpent {
        limit: u32,
        used: u32,
    },
    /// The stage's days do not start yet, or no longer.
    #[error("the stage {name:?} {}", match closed_at {
        Some(at) => format!("closed at {at}"),
        None => format!("opens at {opens_at}"),
    })]
    StageNotOpen {
        name: String,
        /// From when on they start.
        opens_at: Timestamp,
        /// When it closed, if it did.
        closed_at: Option<Timestamp>,
    },
    /// The team neither uploads nor plays.
    #[error("the team was disqualified at {at}: {reason}")]
    Disqualified {
        at: Timestamp,
        /// As everybody may read it.
        reason: String,
    },
    /// The team takes no part any more, by its own wish.
    #[error("the team retired at {at}")]
    Retired {
        at: Timestamp,
    },
    /// Nobody of the team has accepted the terms as they are now.
    #[error("nobody of the team has accepted version {version} of the terms")]
    TermsOwed {
        version: u32,
    },
    /// Names that differ only in case count as the same.
    #[error("a person named {0:?} exists already")]
    PersonNameTaken(String),
    /// The link is worth nothing; the text says why.
    #[error("{0}")]
    InvitationSpent(String),
    /// The season is over: nothing more is uploaded or evaluated.
    #[error("the season was closed at {closed_at}")]
    SeasonClosed {
        closed_at: Timestamp,
    },
    /// The season is an archive's: nothing of it changes.
    #[error("the season is archived as it was at {made_at}")]
    Archived {
        /// The moment that the archive shows.
        made_at: Timestamp,
        /// When it was taken in here.
        imported_at: Option<Timestamp>,
    },
    /// The team has uploaded as much as it may on one UTC day.
    #[error(
        "{used_bytes} of {limit_bytes} bytes of the day are used; the bundle has {bundle_bytes}"
    )]
    DayQuotaSpent {
        limit_bytes: u64,
        used_bytes: u64,
        bundle_bytes: u64,
    },
    /// The team's bundles fill the room that it has.
    #[error("{used_bytes} of {limit_bytes} bytes are stored; the bundle has {bundle_bytes}")]
    StoredQuotaSpent {
        limit_bytes: u64,
        used_bytes: u64,
        bundle_bytes: u64,
    },
    /// What was asked does not fit the entity's state; the text says what does.
    #[error("{0}")]
    Conflict(String),
    /// A disk is full: what was asked is not done, or may not be, and can be once there is room.
    #[error("the disk is full: {0}")]
    FullDisk(String),
    /// A later version of the program has migrated the database.
    #[error(
        "the database is of a later version of Faceoff: {} has its migration {schema}, this is {} and knows {}; use that \
         version, or a later one, or restore a backup from before it",
        program.as_deref().unwrap_or("another"), this.version, this.schema
    )]
    NewerDatabase {
        schema: i64,
        /// What opened it last.
        program: Option<String>,
        this: Program,
    },
    #[error("database: {0}")]
    Database(#[source] sqlx::Error),
    /// The object store failed.
    #[error("artifacts: {0}")]
    Artifacts(String),
    /// A stored value cannot be what this program wrote.
    #[error("stored value is damaged: {0}")]
    Damaged(String),
}

/// What the store's functions answer.
pub(crate) type Result<T, E = StoreError> = std::result::Result<T, E>;

impl From<sqlx::Error> for StoreError {
    fn from(error: sqlx::Error) -> Self {
        match error {
            sqlx::Error::ColumnDecode { index, source } => {
                Self::Damaged(format!("column {index}: {source}"))
            }
            sqlx::Error::Database(error) if is_full(&*error) => Self::FullDisk(error.to_string()),
            error => Self::Database(error),
        }
    }
}

/// SQLITE_FULL; and SQLITE_IOERR_SHMSIZE: the index of the log could not grow.
fn is_full(error: &dyn DatabaseError) -> bool {
    const CODES: [&str; 2] = ["13", "4874"];
    error
        .code()
        .is_some_and(|code| CODES.contains(&code.as_ref()))
}

impl StoreError {
    /// An artifact that could not be read or written, and why.
    pub(crate) fn artifact(what: impl Display, error: &(dyn Error + 'static)) -> Self {
        let text = format!("{what}: {error}");
        if tells_of_full_disk(error) {
            Self::FullDisk(text)
        } else {
            Self::Artifacts(text)
        }
    }

    /// Was a uniqueness constraint broken, one whose columns contain `column`?
    pub(crate) fn is_duplicate(error: &sqlx::Error, column: &str) -> bool {
        error
            .as_database_error()
            .is_some_and(|error| error.is_unique_violation() && error.message().contains(column))
    }
}
