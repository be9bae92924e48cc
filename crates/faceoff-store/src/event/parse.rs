/// Text that is none of an event's parts.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no actor or subject of an event")]
pub struct ParseEventError(pub(super) String);
