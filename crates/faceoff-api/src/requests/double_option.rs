//! Serialisation of optional fields in change requests: null removes a value, and a field that is left out does not change.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A new value of a setting that can be unset, which is null in JSON.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct OrNull<T>(pub Option<T>);

/// Deserialises a field that is present, also null: `Some(None)` if `T` is an option. With `serde(default)`, a field that is
/// left out is `None`.
pub(super) fn deserialize_some<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

#[expect(
    clippy::option_option,
    reason = "null differs from a field that is left out"
)]
/// Serialises a field that is present: null for `Some(None)`.
pub(super) fn serialize_option<S: Serializer, T: Serialize>(
    value: &Option<Option<T>>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    value
        .as_ref()
        .and_then(Option::as_ref)
        .serialize(serializer)
}
