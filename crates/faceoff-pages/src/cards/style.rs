//! The colours of cards (pictures of link previews): those of the pages on a light ground, from their style sheet.

use crate::assets;
use std::{collections::BTreeMap, sync::OnceLock};

/// Selectors of drawings of the table. Each of their rules is one line of `episodes.css` that begins with the selector.
const DRAWING_SELECTORS: [&str; 5] = [".table-map", ".mark", ".trajectory", ".start", ".disc"];

/// Rules that make lines wide enough for the size at which chats show cards.
const WIDE_LINES: &str = ".trajectory{stroke-width:10}.mark.contact,.start,.disc{stroke-width:7}";

/// The light colour of a custom property of the pages: `ground` (background), `ink` (text), `soft` (less important text), and so on.
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
pub(super) fn drawing_css() -> &'static str {
    static CSS: OnceLock<String> = OnceLock::new();
    CSS.get_or_init(|| {
        let lines = assets::EPISODES_STYLE.text().lines();
        let css = lines.filter(|line| {
            DRAWING_SELECTORS
                .iter()
                .any(|selector| line.starts_with(selector))
        });
        let mut css: String = css.collect();
        for (name, value) in colours() {
            css = css.replace(&format!("var(--{name})"), value);
        }
        css + WIDE_LINES
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
    fn drawing_css_has_no_custom_properties() {
        let css = drawing_css();
        assert!(!css.contains("var("), "{css}");
        assert!(
            css.contains(".trajectory.puck { stroke: #9a1f1f; }"),
            "{css}"
        );
        assert!(!css.contains("figcaption"), "{css}");
    }
}
