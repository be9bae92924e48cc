//! Texts that look alike have the same *skeleton*, as defined by Unicode's technical standard 39.

use std::cmp::Ordering;
use unicode_normalization::UnicodeNormalization;

/// Each character with what it looks like, sorted by character; entries end with `\0`. Made by `build.rs`.
static TABLE: &str = include_str!(concat!(env!("OUT_DIR"), "/look_alikes.txt"));

/// What a character looks like; `None` if only like itself. Searches the table by halves: a map of it takes longer to make than most
/// programs ever search.
fn prototype(wanted: char) -> Option<&'static str> {
    let mut entries = TABLE;
    while !entries.is_empty() {
        let mut middle = entries.len() / 2;
        while !entries.is_char_boundary(middle) {
            middle -= 1;
        }
        let start = entries[..middle].rfind('\0').map_or(0, |end| end + 1);
        let (entry, later) = entries[start..].split_once('\0')?;
        let c = entry.chars().next()?;
        entries = match wanted.cmp(&c) {
            Ordering::Less => &entries[..start],
            Ordering::Equal => return Some(&entry[c.len_utf8()..]),
            Ordering::Greater => later,
        };
    }
    None
}

/// The skeleton of `text`.
pub(crate) fn skeleton(text: &str) -> String {
    let mut prototypes = String::with_capacity(text.len());
    for c in text.nfd() {
        match prototype(c) {
            Some(prototype) => prototypes.push_str(prototype),
            None => prototypes.push(c),
        }
    }
    prototypes.nfd().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use unicode_security::confusable_detection;

    #[test]
    fn skeletons_are_those_of_the_standard() {
        let standard = |text: &str| confusable_detection::skeleton(text).collect::<String>();
        let mut last = 'x';
        for c in '\u{1}'..=char::MAX {
            // With a neighbour, since marks are sorted.
            for text in [c.to_string(), format!("{last}{c}\u{323}")] {
                assert_eq!(skeleton(&text), standard(&text), "{text:?}");
            }
            last = c;
        }
        assert_eq!(skeleton("раураl"), skeleton("paypal"));
        assert_ne!(skeleton("paypal"), skeleton("striker"));
    }
}
