//! The colours of cards: those of the pages on a light ground, from their style sheet.

use crate::assets;
use std::{collections::BTreeMap, sync::OnceLock};

/// Begins of the lines of `episodes.css` that style drawings of the table.
const DRAWING_RULES: [&str; 5] = [".table-map", ".mark", ".trajectory", ".start", ".disc"];

/// Lines of drawings are visible at the size at which chats show cards.
const WIDE_LINES: &str = ".trajectory{stroke-width:10}.mark.contact,.start,.disc{stroke-width:7}";

/// The light colour of a custom property of the pages, such as `ink`.
pub(super) fn colour(name: &str) -> &'static str {
    let found = colours().get(name);
    found
        .copied()
        .expect("faceoff.css defines the colours of cards")
}

/// The custom properties of the first block of `faceoff.css`, which are those of the light scheme.
fn colours() -> &'static BTreeMap<&'static str, &'static str> {
    static COLOURS: OnceLock<BTreeMap<&str, &str>> = OnceLock::new();
    COLOURS.get_or_init(|| {
        let block = assets::STYLE.text().split('}').next().unwrap_or_default();
        let properties = block.lines().filter_map(|line| {
            let (name, value) = line.trim().strip_prefix("--")?.split_once(": ")?;
            Some((name, value.strip_suffix(';')?))
        });
        properties.collect()
    })
}

/// The style sheet of drawings of the table, with colours in place of custom properties: drawings in pictures have none.
pub(super) fn drawing_rules() -> &'static str {
    static RULES: OnceLock<String> = OnceLock::new();
    RULES.get_or_init(|| {
        let lines = assets::EPISODES_STYLE.text().lines();
        let rules = lines.filter(|line| DRAWING_RULES.iter().any(|rule| line.starts_with(rule)));
        let mut rules: String = rules.collect();
        for (name, value) in colours() {
            rules = rules.replace(&format!("var(--{name})"), value);
        }
        rules + WIDE_LINES
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_those_of_the_light_scheme() {
        assert_eq!(colour("ground"), "#fcfcfa");
        assert_eq!(colour("ink"), "#14181c");
    }

    #[test]
    fn rules_of_drawings_have_colours_only() {
        let rules = drawing_rules();
        assert!(!rules.contains("var("), "{rules}");
        assert!(
            rules.contains(".trajectory.puck { stroke: #9a1f1f; }"),
            "{rules}"
        );
        assert!(!rules.contains("figcaption"), "{rules}");
    }
}
