//! Old names of renamed response fields. Until the next minor version, responses contain each renamed field under both
//! names, and clients accept either name.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _, ser::Error as _};
use serde_json::{Error, Value, value};

/// A response type with renamed fields; [`deprecated_names!`](crate::deprecated_names!) implements it.
pub trait DeprecatedNames {
    /// The old and the new name of each renamed field.
    const DEPRECATED_NAMES: &'static [(&'static str, &'static str)];
}

/// Implements `Serialize` and `Deserialize` for a type with renamed fields, given as `Type { old => new }`; JSON has
/// both.
///
/// The type derives both traits with `#[serde(remote = "Self")]`, by which serde generates functions of the type instead of the traits.
/// The macro implements the traits with these functions, and adds the old names. Renamed fields of an enum's variants are listed
/// without their variant.
#[macro_export]
macro_rules! deprecated_names {
    ($type:ident { $($old:ident => $new:ident),+ $(,)? }) => {
        impl $crate::deprecated_names::DeprecatedNames for $type {
            const DEPRECATED_NAMES: &'static [(&'static str, &'static str)] =
                &[$((stringify!($old), stringify!($new))),+];
        }

        impl ::serde::Serialize for $type {
            fn serialize<S: ::serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                $crate::deprecated_names::serialize::<$type, S>(|json| $type::serialize(self, json), serializer)
            }
        }

        impl<'de> ::serde::Deserialize<'de> for $type {
            fn deserialize<D: ::serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                $crate::deprecated_names::deserialize::<$type, D>(|json| $type::deserialize(json), deserializer)
            }
        }
    };
}

/// Serialises a value with the old names beside the new ones; `to_json` serialises it with the new ones only.
pub fn serialize<T: DeprecatedNames, S: Serializer>(
    to_json: impl FnOnce(value::Serializer) -> Result<Value, Error>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let mut json = to_json(value::Serializer).map_err(S::Error::custom)?;
    if let Value::Object(fields) = &mut json {
        for (old, new) in T::DEPRECATED_NAMES {
            if let Some(value) = fields.get(*new).cloned() {
                fields.insert((*old).to_owned(), value);
            }
        }
    }
    json.serialize(serializer)
}

/// Deserialises a value with old names, new names or both; if a field has both, the new name wins. `from_json` reads a value that
/// has the new names only.
pub fn deserialize<'de, T: DeprecatedNames, D: Deserializer<'de>>(
    from_json: impl FnOnce(Value) -> Result<T, Error>,
    deserializer: D,
) -> Result<T, D::Error> {
    let mut json = Value::deserialize(deserializer)?;
    if let Value::Object(fields) = &mut json {
        for (old, new) in T::DEPRECATED_NAMES {
            if let Some(value) = fields.remove(*old) {
                fields.entry(*new).or_insert(value);
            }
        }
    }
    from_json(json).map_err(D::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{from_value, json, to_value};

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(remote = "Self")]
    struct Delivery {
        bytes: u32,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        job: Option<String>,
        #[serde(flatten)]
        state: State,
    }
    deprecated_names!(Delivery { size => bytes, unit => job });

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(remote = "Self", tag = "state", rename_all = "snake_case")]
    enum State {
        Waiting,
        Delivered { ended_at: u64 },
    }
    deprecated_names!(State { settled_at => ended_at });

    #[test]
    fn response_has_old_and_new_names() {
        let delivered = Delivery {
            bytes: 3,
            job: None,
            state: State::Delivered { ended_at: 7 },
        };
        let sent =
            json!({"bytes": 3, "size": 3, "state": "delivered", "ended_at": 7, "settled_at": 7});
        assert_eq!(to_value(&delivered).unwrap(), sent);
        assert_eq!(from_value::<Delivery>(sent).unwrap(), delivered);
    }

    #[test]
    fn old_names_alone_are_read() {
        let old = json!({"size": 3, "unit": "hit", "state": "waiting"});
        let expected = Delivery {
            bytes: 3,
            job: Some("hit".to_owned()),
            state: State::Waiting,
        };
        assert_eq!(from_value::<Delivery>(old).unwrap(), expected);
    }
}
