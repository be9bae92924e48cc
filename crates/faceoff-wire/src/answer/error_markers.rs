//! Markers in the texts of serde errors. The parser of answers puts them in, and [`diagnosis`](super::diagnosis) finds the kind
//! of an error by them, since a serde error carries only text.

/// The action has another shape than the interpolation from the agent's `ready` requires.
pub(super) const SHAPE: &str = "faceoff: shape";

/// A number beyond `ACTION_LIMIT`; followed by its index in the action and its value.
pub(super) const TOO_LARGE: &str = "faceoff: too large ";

/// A repeated key; followed by the key.
pub(super) const REPEATED_KEY: &str = "faceoff: twice ";
