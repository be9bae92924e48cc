//! A JSON object whose keys must be unique.

use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};
use std::{collections::HashSet, fmt, hash::Hash, marker::PhantomData, str::FromStr};

/// A JSON object with parsed keys, in the sequence of the file. Duplicate keys are refused: JSON readers silently use the
/// last one, and a board would lose a team.
pub(crate) struct UniqueMap<K, V>(pub(crate) Vec<(K, V)>);

impl<'de, K, V> Deserialize<'de> for UniqueMap<K, V>
where
    K: FromStr<Err: fmt::Display> + Eq + Hash + Clone + fmt::Display,
    V: Deserialize<'de>,
{
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(UniqueMapVisitor(PhantomData))
    }
}

struct UniqueMapVisitor<K, V>(PhantomData<(K, V)>);

impl<'de, K, V> Visitor<'de> for UniqueMapVisitor<K, V>
where
    K: FromStr<Err: fmt::Display> + Eq + Hash + Clone + fmt::Display,
    V: Deserialize<'de>,
{
    type Value = UniqueMap<K, V>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut entries = Vec::new();
        let mut seen_keys = HashSet::new();
        while let Some(text) = map.next_key::<String>()? {
            let key: K = text
                .parse()
                .map_err(|error| A::Error::custom(format_args!("{text:?}: {error}")))?;
            if !seen_keys.insert(key.clone()) {
                return Err(A::Error::custom(format_args!("{key} occurs twice")));
            }
            entries.push((key, map.next_value()?));
        }
        Ok(UniqueMap(entries))
    }
}
