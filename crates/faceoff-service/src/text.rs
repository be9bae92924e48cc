//! Validation of text from users: trimmed, limited in length, and without control characters.

use crate::problem::Problem;

/// Text of one line.
pub fn single_line(field: &str, text: &str, most_chars: usize) -> Result<String, Problem> {
    let text = text.trim();
    let chars = text.chars().count();
    if !(1..=most_chars).contains(&chars) {
        let detail = format!("expected 1 to {most_chars} characters, got {chars}");
        return Err(Problem::invalid(field, detail));
    }
    match text.chars().find(|c| !faceoff_types::is_printable(*c)) {
        Some(bad) => Err(Problem::invalid(
            field,
            format!("expected one line of text, got the character {bad:?}"),
        )),
        None => Ok(text.to_owned()),
    }
}

/// Text of one or more lines.
pub fn multi_line(field: &str, text: &str, most_chars: usize) -> Result<String, Problem> {
    let text = text.replace("\r\n", "\n");
    let text = text.trim();
    let chars = text.chars().count();
    if !(1..=most_chars).contains(&chars) {
        let detail = format!("expected 1 to {most_chars} characters, got {chars}");
        return Err(Problem::invalid(field, detail));
    }
    let is_fine = |c: char| matches!(c, '\n' | '\t') || faceoff_types::is_printable(c);
    match text.chars().find(|c| !is_fine(*c)) {
        Some(bad) => Err(Problem::invalid(
            field,
            format!("expected plain text, got the character {bad:?}"),
        )),
        None => Ok(text.to_owned()),
    }
}

/// An http or https address for a link on a page.
pub fn link(field: &str, text: &str) -> Result<String, Problem> {
    let text = single_line(field, text, 300)?;
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
