//! Errors as the outside sees them: problem details (RFC 9457).
//!
//! Every problem says in `detail` what was expected, what came and what to do. Causes that are ours
//! (database, disk) stay in the log; the outside gets the request's id to quote.

mod details;
mod from_store;
mod kind;
mod quota;

pub use details::{Problem, ProblemBody};
pub use kind::ProblemKind;
