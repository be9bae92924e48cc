//! Validation of text from users. The functions return the trimmed text, or a problem that names the field.

use crate::problem::Problem;

/// One line of text with 1 to `max_chars` printable characters.
pub fn single_line(field: &str, text: &str, max_chars: usize) -> Result<String, Problem> {
    let is_allowed = faceoff_types::is_printable;
    checked(field, text, max_chars, "one line of text", is_allowed)
}

/// One or more lines of text with 1 to `max_chars` characters: printable ones, line breaks and tabs.
pub fn multi_line(field: &str, text: &str, max_chars: usize) -> Result<String, Problem> {
    let text = text.replace("\r\n", "\n");
    let is_allowed = |c: char| matches!(c, '\n' | '\t') || faceoff_types::is_printable(c);
    checked(field, &text, max_chars, "plain text", is_allowed)
}

/// Text of a `kind` with 1 to `max_chars` characters, all of them allowed.
fn checked(
    field: &str,
    text: &str,
    max_chars: usize,
    kind: &str,
    is_allowed: impl Fn(char) -> bool,
) -> Result<String, Problem> {
    let text = text.trim();
    let chars = text.chars().count();
    if !(1..=max_chars).contains(&chars) {
        let detail = format!("expected 1 to {max_chars} characters, got {chars}");
        return Err(Problem::invalid(field, detail));
    }
    match text.chars().find(|c| !is_allowed(*c)) {
        Some(character) => {
            let detail = format!("expected {kind}, got the character {character:?}");
            Err(Problem::invalid(field, detail))
        }
        None => Ok(text.to_owned()),
    }
}

/// Longest address of a link.
const MAX_LINK_CHARS: usize = 300;

/// An http or https address for a link on a page.
pub fn link(field: &str, text: &str) -> Result<String, Problem> {
    let text = single_line(field, text, MAX_LINK_CHARS)?;
    let rest = text
        .strip_prefix("https://")
        .or_else(|| text.strip_prefix("http://"));
    let is_address = rest.is_some_and(|rest| {
        !rest.is_empty() && !rest.starts_with('/') && !rest.contains(char::is_whitespace)
    });
    if is_address {
        return Ok(text);
    }
    let detail = format!("expected an address that begins with https:// or http://, got {text:?}");
    Err(Problem::invalid(field, detail))
}
