//! Strict parsers for the two answers of an agent: `ready` (to `hello` and `reset`) and `act` (to `step`).
//!
//! A line is parsed in one pass without an intermediate tree; the numbers of an action go straight into the
//! caller's buffer. A second pass is made in two cases only: over a refused line, to explain what is wrong with it,
//! and over a line with unknown fields, to find repeated keys. Unknown fields are skipped without recursion, and
//! known fields refuse nested values, so no line can exhaust the stack.

use crate::protocol::PROTOCOL_VERSION;
use faceoff_types::{AgentFaultKind, Interpolation};
use fields::Fields;

mod action;
mod diagnosis;
mod error_markers;
mod fields;
mod repeated_keys;
mod scalar;

pub use diagnosis::too_long;
pub use scalar::Scalar;

/// Maximum number of characters of an agent's name or version; longer ones are cut.
const MAX_LABEL_CHARS: usize = 100;

/// The answer to `hello`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ready {
    /// How the agent's actions become a trajectory.
    pub interpolation: Interpolation,
    /// The agent's name for itself, if it gave one as a string.
    pub name: Option<String>,
    /// The agent's version, if it gave one as a string.
    pub version: Option<String>,
}

/// Parses the answer to `hello`. `line` is without the newline.
///
/// # Errors
/// An agent fault, if the line is not a JSON object or not `ready`, has another protocol version, an unknown or no
/// interpolation, or a repeated key.
pub fn parse_ready(line: &[u8]) -> Result<Ready, AgentFaultKind> {
    const EXPECTED: &str = "ready with protocol 1 and an interpolation";
    let fields = Fields::parse(line, None)?;
    fields.require_type("ready", EXPECTED)?;
    fields.require_integer("protocol", &fields.protocol, PROTOCOL_VERSION, EXPECTED)?;
    let wrong = |got: String| AgentFaultKind::WrongMessage {
        expected: format!("{EXPECTED} (1, 2, 3, 4, 5, -1 or null)"),
        got,
    };
    let code = match &fields.interpolation {
        None => return Err(wrong("ready without interpolation".to_owned())),
        Some(Scalar::Null) => None,
        Some(Scalar::Integer(code)) => Some(*code),
        Some(other) => return Err(wrong(format!("ready with interpolation {other}"))),
    };
    let interpolation = Interpolation::from_code(code)
        .map_err(|unknown| wrong(format!("ready with interpolation {}", unknown.0)))?;
    let label = |field: &Option<Scalar<'_>>| match field {
        Some(Scalar::Text(text)) => Some(text.chars().take(MAX_LABEL_CHARS).collect()),
        _ => None,
    };
    Ok(Ready {
        interpolation,
        name: label(&fields.name),
        version: label(&fields.version),
    })
}

/// Parses the answer to `reset`. `line` is without the newline.
///
/// # Errors
/// An agent fault, if the line is not a JSON object, not `ready` for this episode, or has a repeated key.
pub fn parse_reset_ready(line: &[u8], episode: u32) -> Result<(), AgentFaultKind> {
    let expected = || format!("ready with episode {episode}");
    let fields = Fields::parse(line, None)?;
    fields.require_type("ready", &expected())?;
    fields.require_integer("episode", &fields.episode, episode, &expected())
}

/// Parses the answer to `step` into `action`, row-major. `line` is without the newline.
///
/// On success `action` holds exactly [`Interpolation::len`] numbers of at most
/// [`ACTION_LIMIT`](faceoff_types::ACTION_LIMIT) in magnitude; after an error its content is undefined.
///
/// # Errors
/// An agent fault, if the line is not a JSON object, not `act` for this step, has an action of another shape, a number that
/// is not finite or too large, or a repeated key at any depth.
pub fn parse_act(
    line: &[u8],
    step: u32,
    interpolation: Interpolation,
    action: &mut Vec<f64>,
) -> Result<(), AgentFaultKind> {
    action.clear();
    let fields = Fields::parse(line, Some((interpolation, &mut *action)))?;
    if !fields.is_act(step) {
        let expected = format!("act with step {step}");
        fields.require_type("act", &expected)?;
        fields.require_integer("step", &fields.step, step, &expected)?;
    }
    if fields.has_action {
        Ok(())
    } else {
        Err(AgentFaultKind::WrongMessage {
            expected: format!("act with step {step} and an action"),
            got: "act without action".to_owned(),
        })
    }
}
