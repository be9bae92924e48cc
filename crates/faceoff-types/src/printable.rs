//! Makes untrusted text, such as agents' logs and names, safe to show. Characters that control a terminal, are invisible
//! or change the reading order become visible escapes.

use std::{borrow::Cow, fmt::Write as _};

/// Is this character safe to show? Control characters, including line breaks, are not; nor are invisible characters and
/// those that override the writing direction.
#[must_use]
pub fn is_printable(c: char) -> bool {
    let deceptive = matches!(
        c,
        '\u{ad}' | '\u{61c}' | '\u{115f}' | '\u{1160}' | '\u{180e}' | '\u{200b}' | '\u{200e}'
            | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{3164}'
            | '\u{feff}' | '\u{ffa0}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e0fff}'
    );
    !c.is_control() && !deceptive
}

/// Replaces each character that is not printable by an escape such as `\u202e`; line breaks and tabs stay. JSON text
/// stays JSON with the same meaning.
#[must_use]
pub fn escape_unprintable(text: &str) -> Cow<'_, str> {
    if text
        .bytes()
        .all(|byte| matches!(byte, b' '..=b'~' | b'\n' | b'\t'))
    {
        return Cow::Borrowed(text);
    }
    let is_kept = |c: char| is_printable(c) || matches!(c, '\n' | '\t');
    if text.chars().all(is_kept) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        if is_kept(c) || (c == '\r' && chars.peek() == Some(&'\n')) {
            shown.push(c);
        } else {
            for code_unit in c.encode_utf16(&mut [0; 2]) {
                // Writing to a String cannot fail.
                let _ = write!(shown, "\\u{code_unit:04x}");
            }
        }
    }
    Cow::Owned(shown)
}

/// The first characters of a text from outside, such as a worker's message, safe to show.
#[must_use]
pub fn printable_excerpt(text: &str, max_chars: usize) -> String {
    let end = text.char_indices().nth(max_chars);
    let excerpt = end.map_or(text, |(end, _)| &text[..end]);
    escape_unprintable(excerpt).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excerpt_has_at_most_the_given_number_of_characters() {
        for (text, excerpt) in [
            ("", ""),
            ("größer", "größ"),
            ("größ", "größ"),
            ("a\u{1b}bcd", "a\\u001bbc"),
        ] {
            assert_eq!(printable_excerpt(text, 4), excerpt);
        }
    }

    #[test]
    fn control_and_bidi_characters_are_escaped() {
        for (text, shown) in [
            (
                "\u{1b}[31mred\u{1b}]0;title\u{7}",
                "\\u001b[31mred\\u001b]0;title\\u0007",
            ),
            ("\u{9b}2J", "\\u009b2J"),
            ("over\rwritten", "over\\u000dwritten"),
            ("user\u{202e}nimda", "user\\u202enimda"),
            ("\u{2066}a\u{2069}\u{200f}", "\\u2066a\\u2069\\u200f"),
            ("tag\u{e0041}", "tag\\udb40\\udc41"),
        ] {
            assert_eq!(escape_unprintable(text), shown);
            assert_eq!(escape_unprintable(shown), shown);
        }
        for text in ["", "two\nlines\tand é, ž, 漢字, \u{5d0}\r\n"] {
            assert_eq!(escape_unprintable(text), text);
        }
    }
}
