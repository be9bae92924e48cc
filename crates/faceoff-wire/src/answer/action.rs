//! Reads the `action` of an `act` line: nested arrays of numbers, whose shape depends on the action layout (for air hockey, the
//! interpolation) of the agent's `ready`. The texts of errors contain markers ([`error_markers`]), by which
//! [`diagnosis`](super::diagnosis) finds the kind of an error, since serde errors carry only text.

use super::error_markers;
use faceoff_types::ACTION_LIMIT;
use serde::de::{DeserializeSeed, Deserializer, Error as _, SeqAccess, Visitor};
use std::fmt;

/// A serde seed (a deserialiser with parameters) that reads nested arrays of exactly `shape` into `numbers`, row-major, and
/// refuses numbers beyond [`ACTION_LIMIT`].
///
/// The shape bounds the recursion: an array in place of a number is refused before it is entered.
pub(super) struct ActionSeed<'s> {
    pub shape: &'s [usize],
    pub numbers: &'s mut Vec<f64>,
}

impl<'de> DeserializeSeed<'de> for ActionSeed<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for ActionSeed<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(error_markers::SHAPE)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        let Some((&expected, inner)) = self.shape.split_first() else {
            return Err(A::Error::custom(error_markers::SHAPE));
        };
        if inner.is_empty() {
            for _ in 0..expected {
                let Some(Number(value)) = seq.next_element()? else {
                    return Err(A::Error::custom(error_markers::SHAPE));
                };
                if value.abs() > ACTION_LIMIT {
                    return Err(A::Error::custom(format_args!(
                        "{}{} {value:?}",
                        error_markers::TOO_LARGE,
                        self.numbers.len()
                    )));
                }
                self.numbers.push(value);
            }
        } else {
            for _ in 0..expected {
                let seed = ActionSeed {
                    shape: inner,
                    numbers: self.numbers,
                };
                if seq.next_element_seed(seed)?.is_none() {
                    return Err(A::Error::custom(error_markers::SHAPE));
                }
            }
        }
        // serde_json refuses surplus elements with an error of its own; requesting one more element reports
        // them as a wrong shape.
        match seq.next_element::<serde::de::IgnoredAny>()? {
            None => Ok(()),
            Some(_) => Err(A::Error::custom(error_markers::SHAPE)),
        }
    }
}

/// A JSON number; anything else is an error with the marker of a wrong shape.
struct Number(f64);

impl<'de> serde::Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberVisitor;
        impl Visitor<'_> for NumberVisitor {
            type Value = Number;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(error_markers::SHAPE)
            }
            fn visit_f64<E>(self, value: f64) -> Result<Number, E> {
                Ok(Number(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Number, E> {
                Ok(Number(value as f64))
            }
            fn visit_u64<E>(self, value: u64) -> Result<Number, E> {
                Ok(Number(value as f64))
            }
        }
        deserializer.deserialize_any(NumberVisitor)
    }
}
