//! Quotes a line of an agent in the description of its fault.

use faceoff_types::escape_unprintable;

/// Maximum number of characters of an offending line in a fault.
const QUOTED_CHARS: usize = 400;

/// An offending line for a fault: lossy UTF-8 with unprintable characters escaped, cut to 400 characters.
#[must_use]
pub fn quote_line(line: &[u8]) -> String {
    // A character has at most four bytes, so these bytes contain all quoted characters.
    let head = &line[..line.len().min(4 * QUOTED_CHARS)];
    let text = String::from_utf8_lossy(head);
    let text = escape_unprintable(&text);
    let mut quoted: String = text.chars().take(QUOTED_CHARS).collect();
    if quoted.len() < text.len() || head.len() < line.len() {
        quoted.push('…');
        if quoted.chars().count() > QUOTED_CHARS {
            quoted = quoted.chars().take(QUOTED_CHARS - 1).chain(['…']).collect();
        }
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_line_is_cut_to_400_characters_with_a_mark() {
        assert_eq!(quote_line(b"{}"), "{}");
        assert_eq!(quote_line(&[b'a'; 400]), "a".repeat(400));
        let cut = quote_line(&[b'a'; 401]);
        assert_eq!(cut.chars().count(), 400);
        assert!(cut.ends_with("a…"));
        assert_eq!(
            quote_line("é".repeat(50_000).as_bytes()).chars().count(),
            400
        );
        assert_eq!(quote_line(&[0xff]), "\u{fffd}");
        assert_eq!(quote_line(b"\x1b[2J"), "\\u001b[2J");
    }
}
