//! Text of strangers (agents' logs, names and lines, files from anywhere) as it may be shown: what would
//! steer a terminal, hide, or turn the order of what is read becomes visible.

use std::{borrow::Cow, fmt::Write as _};

/// Is this character only itself where it is shown? Not so control characters, line breaks included,
/// overrides of the writing direction, and what is invisible.
#[must_use]
pub fn is_harmless(c: char) -> bool {
    let deceptive = matches!(
        c,
        '\u{ad}' | '\u{61c}' | '\u{115f}' | '\u{1160}' | '\u{180e}' | '\u{200b}' | '\u{200e}'
            | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{3164}'
            | '\u{feff}' | '\u{ffa0}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e0fff}'
    );
    !c.is_control() && !deceptive
}

/// Text with every character that is not harmless as `\u202e`; line breaks and tabs stay. What was JSON
/// still is, and says the same.
#[must_use]
pub fn harmless(text: &str) -> Cow<'_, str> {
    if text
        .bytes()
        .all(|byte| matches!(byte, b' '..=b'~' | b'\n' | b'\t'))
    {
        return Cow::Borrowed(text);
    }
    let stays = |c: char| is_harmless(c) || matches!(c, '\n' | '\t');
    if text.chars().all(stays) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        if stays(c) || (c == '\r' && chars.peek() == Some(&'\n')) {
            shown.push(c);
        } else {
            for unit in c.encode_utf16(&mut [0; 2]) {
                // Writing to a String cannot fail.
                let _ = write!(shown, "\\u{unit:04x}");
            }
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_steers_hides_or_reverses_is_shown() {
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
            assert_eq!(harmless(text), shown);
            assert_eq!(harmless(shown), shown);
        }
        for text in ["", "two\nlines\tand é, ž, 漢字, \u{5d0}\r\n"] {
            assert_eq!(harmless(text), text);
        }
    }
}
