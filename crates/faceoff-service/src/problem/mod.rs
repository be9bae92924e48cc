//! Error responses: problem details (RFC 9457).
//!
//! `detail` says what was expected, what came and what to do. Internal causes (database, disk) stay in the log; the
//! response contains the request's id for a report.

mod details;
mod from_store;
mod kind;
mod quota;

pub use details::{Problem, ProblemBody};
pub use kind::ProblemKind;
