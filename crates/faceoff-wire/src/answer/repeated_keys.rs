//! Finds repeated keys in those values of an agent's line that the parser skips. Programs disagree on which of two values counts,
//! so such a line is ambiguous.

use super::diagnosis;
use faceoff_types::AgentFaultKind;
use std::{borrow::Cow, collections::HashSet};

/// Refuses the first repeated key of an object in `text`, at any depth. `text` is one valid JSON value.
/// It uses an explicit stack in place of recursion.
pub(super) fn refuse(text: &str) -> Result<(), AgentFaultKind> {
    let bytes = text.as_bytes();
    // The arrays (`None`) and objects (their keys so far) around the current byte, outermost first.
    let mut enclosing: Vec<Option<HashSet<Cow<'_, str>>>> = Vec::new();
    let mut is_key = false;
    let mut index = 0;
    while let Some(byte) = bytes.get(index) {
        match byte {
            b'{' => {
                enclosing.push(Some(HashSet::new()));
                is_key = true;
            }
            b'[' => {
                enclosing.push(None);
                is_key = false;
            }
            b'}' | b']' => {
                enclosing.pop();
                is_key = false;
            }
            b',' => is_key = matches!(enclosing.last(), Some(Some(_))),
            b'"' => {
                let end = end_of_string(bytes, index);
                if is_key && let Some(Some(keys)) = enclosing.last_mut() {
                    let key = decode_key(&text[index..end])?;
                    if let Some(key) = keys.replace(key) {
                        return Err(diagnosis::repeated_key(&key));
                    }
                }
                is_key = false;
                index = end;
                continue;
            }
            _ => {}
        }
        index += 1;
    }
    Ok(())
}

/// The index after the string that opens at `start`.
fn end_of_string(bytes: &[u8], start: usize) -> usize {
    let mut index = start + 1;
    while let Some(byte) = bytes.get(index) {
        match byte {
            b'\\' => index += 2,
            b'"' => return index + 1,
            _ => index += 1,
        }
    }
    bytes.len()
}

/// A key without quotes and escapes: `"a"` and `"\u0061"` are the same key.
fn decode_key(quoted: &str) -> Result<Cow<'_, str>, AgentFaultKind> {
    if quoted.contains('\\') {
        let decoded = serde_json::from_str(quoted).map_err(|error| AgentFaultKind::NotJson {
            detail: format!("a key cannot be read: {error}"),
        })?;
        return Ok(Cow::Owned(decoded));
    }
    Ok(Cow::Borrowed(&quoted[1..quoted.len() - 1]))
}
