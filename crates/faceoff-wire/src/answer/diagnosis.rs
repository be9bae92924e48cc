//! Explains what is wrong with an agent's line that the parser refused. It may be slow, since a refused line ends the episode.

use super::error_markers;
use crate::protocol::MAX_LINE_BYTES;
use faceoff_types::{ACTION_LIMIT, ActionLayout, AgentFaultKind};
use serde_json::Value;

/// Maximum number of characters of a repeated key in a message.
const MAX_KEY_CHARS: usize = 60;

/// Maximum number of characters of a parser message, without the position at its end.
const MAX_DETAIL_CHARS: usize = 200;
/// Maximum length of the position at the end of a parser message, such as ` at character 17`.
const MAX_POSITION_BYTES: usize = 40;

/// The fault of a line longer than the protocol allows.
#[must_use]
pub const fn too_long() -> AgentFaultKind {
    AgentFaultKind::LineTooLong {
        limit_bytes: MAX_LINE_BYTES as u64,
    }
}

/// The fault behind a parser error. `layout` is the one from the agent's `ready` if the line should contain an action.
pub(super) fn diagnose(
    text: &str,
    error: &serde_json::Error,
    layout: Option<ActionLayout>,
) -> AgentFaultKind {
    let message = error.to_string();
    if let Some(rest) = message.strip_prefix(error_markers::REPEATED_KEY) {
        return repeated_key(rest.split(' ').next().unwrap_or_default());
    }
    if let Some(layout) = layout {
        if let Some(index_and_value) = message.strip_prefix(error_markers::TOO_LARGE) {
            return too_large(index_and_value, layout);
        }
        if message.contains(error_markers::SHAPE) {
            return wrong_shape(text, layout);
        }
    }
    if message.starts_with("number out of range") || has_non_finite_word(text) {
        return AgentFaultKind::NonFinite;
    }
    if text.trim().is_empty() {
        return AgentFaultKind::NotJson {
            detail: "the line is empty".to_owned(),
        };
    }
    // The text is a single line, so only the column helps.
    let detail = message.replace(" at line 1 column ", " at character ");
    let hint = hint(text).map_or(String::new(), |hint| format!(" ({hint})"));
    AgentFaultKind::NotJson {
        detail: shorten(&detail) + &hint,
    }
}

/// What a line that is not JSON probably is.
fn hint(text: &str) -> Option<&'static str> {
    let text = text.trim_start();
    if !text.starts_with('{') {
        return Some(
            "standard output is for answers; print everything else to standard error, or make it the log: stdout = \"log\" in agent.toml",
        );
    }
    let first_key = text[1..].trim_start();
    let has_word = |words: &[&str]| words.iter().any(|word| text.contains(word));
    if first_key.starts_with('\'') || has_word(&[": None", ": True", ": False"]) {
        return Some("this looks like a printed Python dict; in Python, print json.dumps(answer)");
    }
    if has_word(&["array(", "tensor(", "float64(", "float32("]) {
        return Some("this looks like a printed array; convert it to a list of numbers first");
    }
    if first_key.starts_with(|first: char| first.is_alphabetic()) {
        return Some("names need double quotes in JSON");
    }
    None
}

/// The fault for a repeated key.
pub(super) fn repeated_key(key: &str) -> AgentFaultKind {
    let key: String = key.chars().take(MAX_KEY_CHARS).collect();
    AgentFaultKind::NotJson {
        detail: format!("the key {key:?} is given twice"),
    }
}

/// Shortens a parser message, which may quote a whole line, but keeps the position at its end.
fn shorten(detail: &str) -> String {
    let Some((end, _)) = detail.char_indices().nth(MAX_DETAIL_CHARS) else {
        return detail.to_owned();
    };
    let position = detail[end..]
        .rfind(" at ")
        .map(|offset| &detail[end + offset..]);
    let position = position.filter(|position| position.len() <= MAX_POSITION_BYTES);
    format!("{}…{}", &detail[..end], position.unwrap_or_default())
}

/// The fault for a number beyond [`ACTION_LIMIT`]. `index_and_value` is its row-major index in the action and its value,
/// separated by a space.
fn too_large(index_and_value: &str, layout: ActionLayout) -> AgentFaultKind {
    let mut words = index_and_value.split(' ');
    let mut index: usize = words.next().and_then(|word| word.parse().ok()).unwrap_or(0);
    let value = words.next().and_then(|word| word.parse().ok());
    let mut indices = Vec::new();
    for len in layout.shape().iter().rev() {
        indices.push(index % len);
        index /= len;
    }
    indices.reverse();
    AgentFaultKind::TooLarge {
        place: format!("action{}", shape_text(&indices)),
        value: value.unwrap_or(f64::MAX),
        limit: ACTION_LIMIT,
    }
}

fn wrong_shape(text: &str, layout: ActionLayout) -> AgentFaultKind {
    let got = match serde_json::from_str::<Value>(text) {
        Ok(value) => describe_action(&value["action"], layout.shape()),
        Err(error) if error.to_string().starts_with("number out of range") => {
            return AgentFaultKind::NonFinite;
        }
        Err(_) if has_non_finite_word(text) => return AgentFaultKind::NonFinite,
        Err(_) => "arrays nested too deep, or cut off".to_owned(),
    };
    AgentFaultKind::WrongShape {
        expected: shape_text(layout.shape()),
        got,
    }
}

/// `[2][7]` for `[2, 7]`; used for shapes and for the indices of a number.
fn shape_text(shape: &[usize]) -> String {
    shape.iter().map(|len| format!("[{len}]")).collect()
}

/// A description of an action of a wrong shape: its shape, such as `[2][6]`, if it is regular; otherwise the first element that
/// breaks the shape.
fn describe_action(action: &Value, expected: &[usize]) -> String {
    let mut shape = Vec::new();
    let mut inner = action;
    while let Value::Array(items) = inner {
        shape.push(items.len());
        match items.first() {
            Some(first) => inner = first,
            None => return shape_text(&shape),
        }
    }
    if shape.is_empty() {
        return kind_of(action).to_owned();
    }
    match irregularity(action, &shape, &mut Vec::new()) {
        None => {
            let hint = shape_hint(&shape, expected);
            shape_text(&shape) + &hint.map_or(String::new(), |hint| format!(" ({hint})"))
        }
        Some(text) => text,
    }
}

/// The probable reason why an action has the shape `got`.
fn shape_hint(got: &[usize], expected: &[usize]) -> Option<&'static str> {
    let count = |shape: &[usize]| {
        shape
            .iter()
            .try_fold(1_usize, |all, len| all.checked_mul(*len))
    };
    let numbers = count(expected);
    if got.iter().rev().eq(expected) {
        return Some("transposed; send a list per row");
    }
    if got.first() == Some(&1) && got.get(1..) == Some(expected) {
        return Some("a batch of one; send its only element");
    }
    if got.len() == 1 && count(got) == numbers {
        return Some("one flat list; send a list per row");
    }
    if count(got) == numbers.and_then(|numbers| numbers.checked_mul(2))
        && got.len() == expected.len()
        && got.last() == expected.last().map(|len| len * 2).as_ref()
    {
        return Some("perhaps with decimal commas; JSON has decimal points");
    }
    None
}

/// Describes the first element, below the element at `path`, that does not fit `shape`; `None` if all fit.
fn irregularity(value: &Value, shape: &[usize], path: &mut Vec<usize>) -> Option<String> {
    match (value, shape.split_first()) {
        (Value::Array(items), Some((&len, inner))) => {
            if items.len() != len {
                return Some(format!(
                    "{} numbers or rows at action{}",
                    items.len(),
                    shape_text(path)
                ));
            }
            items.iter().enumerate().find_map(|(index, item)| {
                path.push(index);
                let found = irregularity(item, inner, path);
                path.pop();
                found
            })
        }
        (Value::Number(_), None) => None,
        (other, _) => Some(format!("{} at action{}", kind_of(other), shape_text(path))),
    }
}

const fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}

/// Does `rest` start with `word`, followed by no letter or digit?
fn is_word(rest: &[u8], word: &[u8]) -> bool {
    rest.strip_prefix(word)
        .is_some_and(|after| !after.first().is_some_and(u8::is_ascii_alphanumeric))
}

/// Does an object contain, outside of strings, one of the words that lenient JSON writers such as Python's emit for
/// numbers that are not finite?
fn has_non_finite_word(text: &str) -> bool {
    if !text.trim_start().starts_with('{') {
        return false; // output of a stray print statement, not an answer
    }
    let mut in_string = false;
    let mut escaped = false;
    text.bytes().enumerate().any(|(index, byte)| {
        if in_string {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => in_string = false,
                _ => {}
            }
            return false;
        }
        match byte {
            b'"' => in_string = true,
            b'N' => return is_word(&text.as_bytes()[index..], b"NaN"),
            b'I' => return is_word(&text.as_bytes()[index..], b"Infinity"),
            _ => {}
        }
        false
    })
}
