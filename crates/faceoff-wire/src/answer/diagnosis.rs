//! Says what was wrong with a line that the one-pass parser refused. Not on the normal path.

use super::marks;
use crate::protocol::MAX_LINE_BYTES;
use faceoff_types::{AgentFaultKind, Interpolation};
use serde_json::Value;

/// The fault of a line longer than the protocol allows.
#[must_use]
pub const fn too_long() -> AgentFaultKind {
    AgentFaultKind::LineTooLong {
        limit_bytes: MAX_LINE_BYTES as u64,
    }
}

/// The fault behind a parser's error. `interpolation` is the agreed one where an action was due.
pub(super) fn diagnose(
    text: &str,
    error: &serde_json::Error,
    interpolation: Option<Interpolation>,
) -> AgentFaultKind {
    let message = error.to_string();
    if let Some(rest) = message.strip_prefix(marks::TWICE) {
        let key = rest.split(' ').next().unwrap_or_default();
        return AgentFaultKind::NotJson {
            detail: format!("the key {key:?} is given twice"),
        };
    }
    if let Some(code) = interpolation
        && message.contains(marks::SHAPE)
    {
        return wrong_shape(text, code);
    }
    if message.starts_with("number out of range") || has_non_finite_word(text) {
        return AgentFaultKind::NonFinite;
    }
    if text.trim().is_empty() {
        return AgentFaultKind::NotJson {
            detail: "the line is empty".to_owned(),
        };
    }
    // A line is line 1 of itself: the column alone helps.
    let detail = message.replace(" at line 1 column ", " at character ");
    AgentFaultKind::NotJson { detail }
}

fn wrong_shape(text: &str, code: Interpolation) -> AgentFaultKind {
    let got = match serde_json::from_str::<Value>(text) {
        Ok(value) => describe_action(&value["action"]),
        Err(error) if error.to_string().starts_with("number out of range") => {
            return AgentFaultKind::NonFinite;
        }
        Err(_) if has_non_finite_word(text) => return AgentFaultKind::NonFinite,
        Err(_) => "arrays nested too deep, or cut off".to_owned(),
    };
    AgentFaultKind::WrongShape {
        expected: shape_text(code.shape()),
        got,
    }
}

fn shape_text(shape: &[usize]) -> String {
    shape.iter().map(|len| format!("[{len}]")).collect()
}

/// `[2][6]` for a regular array; otherwise the first place that is out of line.
fn describe_action(action: &Value) -> String {
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
        None => shape_text(&shape),
        Some(text) => text,
    }
}

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

fn is_word(rest: &[u8], word: &[u8]) -> bool {
    rest.strip_prefix(word)
        .is_some_and(|after| !after.first().is_some_and(u8::is_ascii_alphanumeric))
}

/// Does an object, outside of its strings, hold one of the words that lenient JSON writers (such as
/// Python's) emit for what JSON cannot say?
fn has_non_finite_word(text: &str) -> bool {
    if !text.trim_start().starts_with('{') {
        return false; // a stray print, not an answer
    }
    let mut in_string = false;
    let mut escaped = false;
    text.bytes().enumerate().any(|(at, byte)| {
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
            b'N' => return is_word(&text.as_bytes()[at..], b"NaN"),
            b'I' => return is_word(&text.as_bytes()[at..], b"Infinity"),
            _ => {}
        }
        false
    })
}
