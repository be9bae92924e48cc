//! Reads one line of an agent into the fields that the protocol defines, in one pass.

use super::{action::ActionSeed, diagnosis, error_markers, repeated_keys, scalar::Scalar};
use crate::protocol::MAX_LINE_BYTES;
use faceoff_types::{ActionLayout, AgentFaultKind, escape_unprintable};
use serde::{
    Deserializer as _,
    de::{Error as _, IgnoredAny, MapAccess, Visitor},
};
use std::fmt;

/// Maximum number of characters of an unexpected message type in a fault.
const MAX_TYPE_CHARS: usize = 60;

/// The fields of an answer that the protocol defines; `None` if absent.
#[derive(Debug, Default)]
pub(super) struct Fields<'a> {
    /// The field `type`.
    pub kind: Option<Scalar<'a>>,
    pub protocol: Option<Scalar<'a>>,
    pub interpolation: Option<Scalar<'a>>,
    pub episode: Option<Scalar<'a>>,
    pub step: Option<Scalar<'a>>,
    pub name: Option<Scalar<'a>>,
    pub version: Option<Scalar<'a>>,
    /// Was an action read into the caller's buffer?
    pub has_action: bool,
    /// Was an array or object skipped, or the value of an unknown field, so that its keys have not been checked for repetition?
    has_skipped_values: bool,
}

/// The layout from the agent's `ready` and the buffer for its action; `None` if no action is expected.
pub(super) type ActionSink<'s> = Option<(ActionLayout, &'s mut Vec<f64>)>;

impl<'a> Fields<'a> {
    /// Parses one line. Without a sink an `action` is skipped like any unknown field.
    pub fn parse(line: &'a [u8], sink: ActionSink<'_>) -> Result<Self, AgentFaultKind> {
        if line.len() > MAX_LINE_BYTES {
            return Err(diagnosis::too_long());
        }
        let text = std::str::from_utf8(line).map_err(|error| AgentFaultKind::NotJson {
            detail: format!("not UTF-8 after byte {}", error.valid_up_to()),
        })?;
        // Some languages begin their output with a byte order mark.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let layout = sink.as_ref().map(|(layout, _)| *layout);
        let mut json = serde_json::Deserializer::from_str(text);
        let fields = json
            .deserialize_map(FieldsVisitor { sink })
            .and_then(|fields| json.end().map(|()| fields))
            .map_err(|error| diagnosis::diagnose(text, &error, layout))?;
        if fields.has_skipped_values {
            repeated_keys::refuse(text)?;
        }
        Ok(fields)
    }

    /// Is this an `act` for `step`? A check without allocations, since it is made for each answer.
    pub fn is_act(&self, step: u32) -> bool {
        matches!(&self.kind, Some(Scalar::Text(kind)) if kind == "act")
            && self.step == Some(Scalar::Integer(i64::from(step)))
    }

    /// Requires the `type` to be `kind`. `expected` describes the whole expected answer, for the fault.
    pub fn require_type(&self, kind: &str, expected: &str) -> Result<(), AgentFaultKind> {
        let got = match &self.kind {
            Some(Scalar::Text(got)) if got == kind => return Ok(()),
            Some(Scalar::Text(got)) => {
                let head: String = got.chars().take(MAX_TYPE_CHARS).collect();
                escape_unprintable(&head).into_owned()
            }
            Some(other) => format!("an object whose type is {other}"),
            None => "an object without type".to_owned(),
        };
        Err(AgentFaultKind::WrongMessage {
            expected: expected.to_owned(),
            got,
        })
    }

    /// Requires `field`, which is called `name`, to be `value`. `expected` is as in [`Self::require_type`].
    pub fn require_integer(
        &self,
        name: &str,
        field: &Option<Scalar<'_>>,
        value: u32,
        expected: &str,
    ) -> Result<(), AgentFaultKind> {
        let kind = match &self.kind {
            Some(Scalar::Text(kind)) => kind,
            _ => "an object",
        };
        let got = match field {
            Some(Scalar::Integer(got)) if *got == i64::from(value) => return Ok(()),
            Some(other) => format!("{kind} with {name} {other}"),
            None => format!("{kind} without {name}"),
        };
        Err(AgentFaultKind::WrongMessage {
            expected: expected.to_owned(),
            got,
        })
    }
}

struct FieldsVisitor<'s> {
    sink: ActionSink<'s>,
}

impl<'de> Visitor<'de> for FieldsVisitor<'_> {
    type Value = Fields<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut map: A) -> Result<Fields<'de>, A::Error> {
        let mut fields = Fields::default();
        while let Some(key) = map.next_key::<Key>()? {
            let field = match key {
                Key::Type => &mut fields.kind,
                Key::Protocol => &mut fields.protocol,
                Key::Interpolation => &mut fields.interpolation,
                Key::Episode => &mut fields.episode,
                Key::Step => &mut fields.step,
                Key::Name => &mut fields.name,
                Key::Version => &mut fields.version,
                Key::Action => match &mut self.sink {
                    Some(_) if fields.has_action => {
                        return Err(A::Error::custom(format_args!(
                            "{}action",
                            error_markers::REPEATED_KEY
                        )));
                    }
                    Some((layout, numbers)) => {
                        map.next_value_seed(ActionSeed {
                            shape: layout.shape(),
                            numbers,
                        })?;
                        fields.has_action = true;
                        continue;
                    }
                    None => {
                        fields.has_skipped_values = true;
                        map.next_value::<IgnoredAny>()?;
                        continue;
                    }
                },
                Key::Unknown => {
                    fields.has_skipped_values = true;
                    map.next_value::<IgnoredAny>()?;
                    continue;
                }
            };
            let value = map.next_value()?;
            fields.has_skipped_values |= matches!(value, Scalar::Array | Scalar::Object);
            if field.replace(value).is_some() {
                return Err(A::Error::custom(format_args!(
                    "{}{}",
                    error_markers::REPEATED_KEY,
                    key.as_str()
                )));
            }
        }
        Ok(fields)
    }
}

#[derive(Clone, Copy, serde::Deserialize)]
#[serde(field_identifier, rename_all = "lowercase")]
enum Key {
    Type,
    Protocol,
    Interpolation,
    Episode,
    Step,
    Action,
    Name,
    Version,
    #[serde(other)]
    Unknown,
}

impl Key {
    const fn as_str(self) -> &'static str {
        match self {
            Self::Type => "type",
            Self::Protocol => "protocol",
            Self::Interpolation => "interpolation",
            Self::Episode => "episode",
            Self::Step => "step",
            Self::Action => "action",
            Self::Name => "name",
            Self::Version => "version",
            Self::Unknown => "unknown",
        }
    }
}
