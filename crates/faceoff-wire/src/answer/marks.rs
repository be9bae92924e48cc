//! serde carries only text in its errors; these words tell the parser's refusals from each other.

/// Well-formed so far, but another shape than the agreed one.
pub(super) const SHAPE: &str = "faceoff: shape";

/// A number beyond the bound; its index in the action and its value follow.
pub(super) const TOO_LARGE: &str = "faceoff: too large ";

/// A repeated key, which follows.
pub(super) const TWICE: &str = "faceoff: twice ";
