//! Texts that look alike have the same *skeleton*, as defined by Unicode's technical standard 39.

use std::{collections::HashMap, sync::LazyLock};
use unicode_normalization::UnicodeNormalization;

/// Each character with what it looks like; entries end with `\0`. Made by `build.rs`.
static TABLE: &str = include_str!(concat!(env!("OUT_DIR"), "/look_alikes.txt"));

static PROTOTYPES: LazyLock<HashMap<char, &'static str>> = LazyLock::new(|| {
    let entries = TABLE.split_terminator('\0');
    entries
        .filter_map(|entry| {
            let c = entry.chars().next()?;
            Some((c, &entry[c.len_utf8()..]))
        })
        .collect()
});

/// The skeleton of `text`.
pub(crate) fn skeleton(text: &str) -> String {
    let mut prototypes = String::with_capacity(text.len());
    for c in text.nfd() {
        match PROTOTYPES.get(&c) {
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
