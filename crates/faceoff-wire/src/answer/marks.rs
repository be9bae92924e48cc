//! Markers in error texts. serde errors carry only text, so the markers distinguish the parser's refusals.

/// Well-formed so far, but of another shape than the agreed one.
pub(super) const SHAPE: &str = "faceoff: shape";

/// A number beyond the bound; followed by its index in the action and its value.
pub(super) const TOO_LARGE: &str = "faceoff: too large ";

/// A repeated key; followed by the key.
pub(super) const TWICE: &str = "faceoff: twice ";
