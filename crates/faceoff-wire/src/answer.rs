//! Strict parsers for the two answers of an agent: `ready` (to `hello` and `reset`) and `act` (to `step`). If agents choose the layout of
//! their actions (how many numbers, in which nested arrays), `ready` names it by a code, in the field `interpolation`.
//!
//! A line is parsed in one pass without an intermediate tree; the numbers of an action go straight into the
//! caller's buffer. A second pass is made in two cases only: over a refused line, to explain what is wrong with it,
//! and over a line with unknown fields, to find repeated keys. Unknown fields are skipped without recursion, and
//! known fields refuse nested values, so no line can exhaust the stack.

use crate::protocol::PROTOCOL_VERSION;
use faceoff_types::{ActionLayout, ActionSpace, AgentFaultKind};
use fields::Fields;

mod action;
mod diagnosis;
// Markers in the texts of serde errors, by which their kind is found.
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
    /// The layout of the agent's actions.
    pub layout: ActionLayout,
    /// The agent's name for itself, if it gave one as a string.
    pub name: Option<String>,
    /// The agent's version, if it gave one as a string.
    pub version: Option<String>,
}

/// Parses the answer to `hello` in a competition with these actions. `line` is without the newline.
///
/// # Errors
/// An agent fault, if the line is not a JSON object or not `ready`, has another protocol version, an unknown or no
/// layout of actions where one must be stated, or a repeated key.
pub fn parse_ready(line: &[u8], actions: &ActionSpace) -> Result<Ready, AgentFaultKind> {
    let expected = if actions.agents_choose_layout {
        "ready with protocol 1 and an interpolation"
    } else {
        "ready with protocol 1"
    };
    let fields = Fields::parse(line, None)?;
    fields.require_type("ready", expected)?;
    fields.require_integer("protocol", &fields.protocol, PROTOCOL_VERSION, expected)?;
    let layout = match actions.only_layout() {
        Some(layout) => layout,
        None => stated_layout(actions, fields.interpolation.as_ref(), expected)?,
    };
    let label = |field: &Option<Scalar<'_>>| match field {
        Some(Scalar::Text(text)) => Some(text.chars().take(MAX_LABEL_CHARS).collect()),
        _ => None,
    };
    Ok(Ready {
        layout,
        name: label(&fields.name),
        version: label(&fields.version),
    })
}

/// The layout that an agent states.
fn stated_layout(
    actions: &ActionSpace,
    stated: Option<&Scalar<'_>>,
    expected: &str,
) -> Result<ActionLayout, AgentFaultKind> {
    let wrong = |got: String| AgentFaultKind::WrongMessage {
        expected: format!("{expected} ({})", actions.codes_text()),
        got,
    };
    let code = match stated {
        None => return Err(wrong("ready without interpolation".to_owned())),
        Some(Scalar::Null) => None,
        Some(Scalar::Integer(code)) => Some(*code),
        Some(other) => return Err(wrong(format!("ready with interpolation {other}"))),
    };
    actions.find(code).ok_or_else(|| {
        let code = code.map_or_else(|| "null".to_owned(), |code| code.to_string());
        wrong(format!("ready with interpolation {code}"))
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
/// On success `action` holds exactly [`ActionLayout::len`] numbers of at most
/// [`ACTION_LIMIT`](faceoff_types::ACTION_LIMIT) in magnitude; after an error its content is undefined.
///
/// # Errors
/// An agent fault, if the line is not a JSON object, not `act` for this step, has an action of another shape, a number that
/// is not finite or too large, or a repeated key at any depth.
pub fn parse_act(
    line: &[u8],
    step: u32,
    layout: ActionLayout,
    action: &mut Vec<f64>,
) -> Result<(), AgentFaultKind> {
    action.clear();
    let fields = Fields::parse(line, Some((layout, &mut *action)))?;
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
