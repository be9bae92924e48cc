//! [`ParseEventError`]: the error for a stored actor or subject that cannot be parsed.

/// A text that is neither an actor nor a subject of an event.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is not an actor or subject of an event")]
pub struct ParseEventError(pub(super) String);
