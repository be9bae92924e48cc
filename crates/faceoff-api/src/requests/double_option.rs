use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Distinguishes null (`Some(None)`) from a field that is left out (`None`).
pub(super) fn deserialize_some<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<Option<T>>, D::Error> {
    Option::deserialize(deserializer).map(Some)
}

#[expect(
    clippy::option_option,
    reason = "null differs from a field that is left out"
)]
pub(super) fn serialize_option<S: Serializer, T: Serialize>(
    value: &Option<Option<T>>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    value
        .as_ref()
        .and_then(Option::as_ref)
        .serialize(serializer)
}
