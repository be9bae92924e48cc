//! Texts that look alike have the same *skeleton*, as defined by Unicode's technical standard 39.

use unicode_normalization::UnicodeNormalization;

// Written by build.rs: `CHARACTERS` in ascending order. The *prototype* of a character is the text that it looks like. It is the part of
// `PROTOTYPES` that ends at the character's number in `ENDS`, in bytes.
include!(concat!(env!("OUT_DIR"), "/look_alikes.rs"));

/// The text that a character looks like; `None` if it looks only like itself.
fn prototype(c: char) -> Option<&'static str> {
    let index = CHARACTERS.binary_search(&c).ok()?;
    let start = match index {
        0 => 0,
        _ => ENDS[index - 1],
    };
    Some(&PROTOTYPES[usize::from(start)..usize::from(ENDS[index])])
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
            // Alone, and between a neighbour and a mark: decomposition sorts adjacent marks, which may change their order.
            for text in [c.to_string(), format!("{last}{c}\u{323}")] {
                assert_eq!(skeleton(&text), standard(&text), "{text:?}");
            }
            last = c;
        }
        assert_eq!(skeleton("раураl"), skeleton("paypal"));
        assert_ne!(skeleton("paypal"), skeleton("striker"));
    }
}
