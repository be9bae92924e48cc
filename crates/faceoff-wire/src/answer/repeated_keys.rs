//! Finds repeated keys in values that the parser skipped. Programs disagree on which of two values counts, so such a
//! line would be ambiguous.

use super::diagnosis;
use faceoff_types::AgentFaultKind;
use std::{borrow::Cow, collections::HashSet};

/// Refuses the first repeated key of an object in `text`, at any depth. `text` is one valid JSON value.
/// It uses an explicit stack in place of recursion.
pub(super) fn refuse(text: &str) -> Result<(), AgentFaultKind> {
    let bytes = text.as_bytes();
    // The enclosing arrays (`None`) and objects (with their keys so far).
    let mut open: Vec<Option<HashSet<Cow<'_, str>>>> = Vec::new();
    let mut is_key = false;
    let mut at = 0;
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'{' => {
                open.push(Some(HashSet::new()));
                is_key = true;
            }
            b'[' => {
                open.push(None);
                is_key = false;
            }
            b'}' | b']' => {
                open.pop();
                is_key = false;
            }
            b',' => is_key = matches!(open.last(), Some(Some(_))),
            b'"' => {
                let end = end_of_string(bytes, at);
                if is_key && let Some(Some(keys)) = open.last_mut() {
                    let key = decoded(&text[at..end])?;
                    if let Some(key) = keys.replace(key) {
                        return Err(diagnosis::twice(&key));
                    }
                }
                is_key = false;
                at = end;
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    Ok(())
}

/// The index after the string that opens at `start`.
fn end_of_string(bytes: &[u8], start: usize) -> usize {
    let mut at = start + 1;
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'\\' => at += 2,
            b'"' => return at + 1,
            _ => at += 1,
        }
    }
    bytes.len()
}

/// A key without quotes and escapes: `"a"` and `"\u0061"` are the same key.
fn decoded(quoted: &str) -> Result<Cow<'_, str>, AgentFaultKind> {
    if quoted.contains('\\') {
        let decoded = serde_json::from_str(quoted).map_err(|error| AgentFaultKind::NotJson {
            detail: format!("a key cannot be read: {error}"),
        })?;
        return Ok(Cow::Owned(decoded));
    }
    Ok(Cow::Borrowed(&quoted[1..quoted.len() - 1]))
}
