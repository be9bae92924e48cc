//! Short names of the tasks, profiles, rulesets and other parts of a competition. They are stored inline, without an allocation.

use std::fmt;

/// Maximum length of a short name.
pub(crate) const MAX_LEN: usize = 24;

/// 1 to 24 of a-z, 0-9, `_`, `-` and in some types `.`, with a letter first.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ShortName {
    /// ASCII, filled up with zeros.
    bytes: [u8; MAX_LEN],
}

impl ShortName {
    /// `None` if the text is no short name. `with_dots`: dots are allowed, too.
    pub(crate) const fn from_text(text: &str, with_dots: bool) -> Option<Self> {
        let text = text.as_bytes();
        if text.is_empty() || text.len() > MAX_LEN || !text[0].is_ascii_lowercase() {
            return None;
        }
        let mut bytes = [0; MAX_LEN];
        let mut index = 0;
        while index < text.len() {
            let byte = text[index];
            let is_always_allowed = matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'_' | b'-');
            let is_allowed = is_always_allowed || with_dots && byte == b'.';
            if !is_allowed {
                return None;
            }
            bytes[index] = byte;
            index += 1;
        }
        Some(Self { bytes })
    }

    pub(crate) fn as_str(&self) -> &str {
        let is_end = |byte: &u8| *byte == 0;
        let len = self.bytes.iter().position(is_end).unwrap_or(MAX_LEN);
        str::from_utf8(&self.bytes[..len]).unwrap_or_default()
    }
}

impl fmt::Debug for ShortName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Text that is not a valid short name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{text:?} is not the name of {kind}: expected 1 to {MAX_LEN} of {}, with a letter first",
    if *with_dots { "a-z, 0-9, _, - and ." } else { "a-z, 0-9, _ and -" }
)]
pub struct InvalidShortName {
    pub(crate) text: String,
    pub(crate) kind: &'static str,
    pub(crate) with_dots: bool,
}

/// A type of short names; `kind` is its description with an article. `with_dots`: its names may have dots.
macro_rules! short_name {
    ($(#[$doc:meta])* $name:ident, $kind:literal) => {
        $crate::short_name::short_name!(@ false, $(#[$doc])* $name, $kind);
    };
    ($(#[$doc:meta])* $name:ident, $kind:literal, with_dots) => {
        $crate::short_name::short_name!(@ true, $(#[$doc])* $name, $kind);
    };
    (@ $with_dots:literal, $(#[$doc:meta])* $name:ident, $kind:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash)]
        pub struct $name($crate::short_name::ShortName);

        impl $name {
            /// From a text in the code; others are parsed.
            ///
            /// # Panics
            /// If the text is not such a name.
            #[must_use]
            pub const fn new(name: &str) -> Self {
                match $crate::short_name::ShortName::from_text(name, $with_dots) {
                    Some(name) => Self(name),
                    None => panic!("not a short name"),
                }
            }

            /// The name in files, in the API and on the command line.
            #[must_use]
            pub fn as_str(&self) -> &str {
                self.0.as_str()
            }
        }

        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.as_str())
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.as_str())
            }
        }

        impl std::str::FromStr for $name {
            type Err = $crate::InvalidShortName;
            fn from_str(text: &str) -> Result<Self, Self::Err> {
                let name = $crate::short_name::ShortName::from_text(text, $with_dots);
                name.map(Self).ok_or_else(|| $crate::InvalidShortName {
                    text: text.to_owned(),
                    kind: $kind,
                    with_dots: $with_dots,
                })
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.as_str())
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Text;
                impl serde::de::Visitor<'_> for Text {
                    type Value = $name;
                    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                        f.write_str(concat!("the name of ", $kind))
                    }
                    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<$name, E> {
                        text.parse().map_err(E::custom)
                    }
                }
                deserializer.deserialize_str(Text)
            }
        }

        #[cfg(feature = "openapi")]
        impl utoipa::PartialSchema for $name {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::Schema> {
                utoipa::openapi::ObjectBuilder::new()
                    .schema_type(utoipa::openapi::Type::String)
                    .description(Some(concat!("The name of ", $kind, " of the competition.")))
                    .into()
            }
        }

        #[cfg(feature = "openapi")]
        impl utoipa::ToSchema for $name {}
    };
}

pub(crate) use short_name;

#[cfg(test)]
mod tests {
    use super::MAX_LEN;
    use crate::{Ruleset, Task};

    #[test]
    fn names_are_short_and_without_capitals() {
        let longest = "a".repeat(MAX_LEN);
        for name in ["hit", "reach-2_b", &longest] {
            let task: Task = name.parse().unwrap();
            assert_eq!(task.as_str(), name);
            let json = serde_json::to_string(&task).unwrap();
            assert_eq!(json, format!("{name:?}"));
            assert_eq!(serde_json::from_str::<Task>(&json).unwrap(), task);
        }
        assert_eq!("a-1.2".parse::<Ruleset>().unwrap().as_str(), "a-1.2");
        let error = "A".parse::<Ruleset>().unwrap_err().to_string();
        assert!(error.contains("a-z, 0-9, _, - and ."), "{error}");
        let too_long = "a".repeat(MAX_LEN + 1);
        for name in ["", "2d", "Hit", "a b", "a/b", "a.b", "ü", "a\0", &too_long] {
            let error = name.parse::<Task>().unwrap_err().to_string();
            assert!(
                error.contains("is not the name of a task: expected 1 to 24"),
                "{error}"
            );
        }
    }
}
