//! Text as outlines: its width, its truncation, and its SVG element. Letters have no kerning.

use crate::font::{Placement, Weight};

/// Replaces the rest of a truncated text.
const ELLIPSIS: char = '…';

/// How a text looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextStyle {
    pub weight: Weight,
    /// The font size: the length of an em, the unit of a font.
    pub size_px: f64,
    /// The value of the attribute `fill` in SVG, e.g. `#102030`.
    pub colour: &'static str,
}

/// Which part of a text is at the x of its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    Left,
    Middle,
    Right,
}

impl TextStyle {
    #[must_use]
    pub const fn new(weight: Weight, size_px: f64, colour: &'static str) -> Self {
        Self {
            weight,
            size_px,
            colour,
        }
    }

    #[must_use]
    pub fn width_px(&self, text: &str) -> f64 {
        let advances =
            characters_with_width(text).map(|c| self.weight.advance_em(self.weight.shape(c)));
        self.size_px * advances.sum::<f64>()
    }

    /// The text, or as much of it as fits with an ellipsis.
    #[must_use]
    pub fn truncated(&self, text: &str, max_width_px: f64) -> String {
        if self.width_px(text) <= max_width_px {
            return text.to_owned();
        }
        let mut characters: Vec<char> = text.chars().collect();
        while characters.pop().is_some() {
            while characters.last().is_some_and(|last| last.is_whitespace()) {
                characters.pop();
            }
            let shorter: String = characters.iter().copied().chain([ELLIPSIS]).collect();
            if self.width_px(&shorter) <= max_width_px {
                return shorter;
            }
        }
        String::new()
    }

    /// Lines of whole words, as wide as allowed; the last of `max_lines` is truncated.
    #[must_use]
    pub fn wrapped(&self, text: &str, max_width_px: f64, max_lines: usize) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split_whitespace() {
            let is_full = lines.len() == max_lines;
            match lines.last_mut() {
                Some(line)
                    if is_full || self.width_px(&format!("{line} {word}")) <= max_width_px =>
                {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        let lines = lines.into_iter().take(max_lines);
        lines
            .map(|line| self.truncated(&line, max_width_px))
            .collect()
    }

    /// The SVG element of a text with its baseline at `y`.
    #[must_use]
    pub fn svg(&self, text: &str, [x, y]: [f64; 2], align: Align) -> String {
        let left = match align {
            Align::Left => x,
            Align::Middle => x - self.width_px(text) / 2.0,
            Align::Right => x - self.width_px(text),
        };
        let mut path = String::new();
        let mut pen = left;
        for character in characters_with_width(text) {
            let shape = self.weight.shape(character);
            let placement = Placement {
                x: pen,
                y,
                size_px: self.size_px,
            };
            self.weight.outline(shape, placement, &mut path);
            pen += self.size_px * self.weight.advance_em(shape);
        }
        format!("<path fill=\"{}\" d=\"{path}\"/>", self.colour)
    }
}

/// Can at least one letter, digit or sign of the text be drawn? Otherwise the text is a row of boxes, which says nothing.
#[must_use]
pub fn is_legible(text: &str) -> bool {
    let mut visible = text.chars().filter(|c| !c.is_whitespace());
    visible.any(|c| Weight::Regular.covers(c))
}

/// The characters that take space: controls and joiners take none.
fn characters_with_width(text: &str) -> impl Iterator<Item = char> {
    text.chars().filter(|c| {
        !c.is_control()
            && !matches!(c, '\u{200b}'..='\u{200f}' | '\u{2060}' | '\u{fe00}'..='\u{fe0f}')
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const REGULAR: TextStyle = TextStyle::new(Weight::Regular, 2048.0, "#000");
    const SEMIBOLD: TextStyle = TextStyle::new(Weight::Semibold, 2048.0, "#000");

    #[test]
    fn width_is_the_sum_of_the_fonts_advances() {
        // In font units, of which an em has 2048.
        assert_eq!(REGULAR.width_px("H"), 1511.0);
        assert_eq!(REGULAR.width_px("H00"), 1511.0 + 2.0 * 1171.0);
        assert_eq!(SEMIBOLD.width_px("H0"), 1538.0 + 1169.0);
        let half = TextStyle::new(Weight::Regular, 1024.0, "#000");
        assert_eq!(half.width_px("H"), 755.5);
        assert_eq!(REGULAR.width_px("\u{200d}\n"), 0.0);
    }

    #[test]
    fn outline_is_inside_of_its_line() {
        let style = TextStyle::new(Weight::Regular, 100.0, "#123456");
        let element = style.svg("l", [10.0, 200.0], Align::Left);
        assert!(
            element.starts_with("<path fill=\"#123456\" d=\"M"),
            "{element}"
        );
        let data = element.split('"').nth(3).unwrap();
        let numbers: Vec<f64> = data
            .split(|c: char| c != '.' && c != '-' && !c.is_ascii_digit())
            .filter(|text| !text.is_empty())
            .map(|text| text.parse().unwrap())
            .collect();
        let right = 10.0 + style.width_px("l");
        assert!(numbers.len() >= 8, "{data}");
        for point in numbers.chunks(2) {
            assert!((10.0..=right).contains(&point[0]), "{data}");
            assert!((120.0..=200.0).contains(&point[1]), "{data}");
        }
        assert_eq!(
            style.svg(" ", [0.0, 0.0], Align::Left),
            "<path fill=\"#123456\" d=\"\"/>"
        );
    }

    #[test]
    fn text_is_aligned_at_its_position() {
        let style = TextStyle::new(Weight::Semibold, 40.0, "#000");
        let width = style.width_px("Team 1");
        let left = style.svg("Team 1", [100.0, 50.0], Align::Left);
        assert_eq!(
            style.svg("Team 1", [100.0 + width, 50.0], Align::Right),
            left
        );
        assert_eq!(
            style.svg("Team 1", [100.0 + width / 2.0, 50.0], Align::Middle),
            left
        );
    }

    #[test]
    fn long_text_is_truncated_to_its_width() {
        let text = "Grundgesetz Hockey";
        let full_width = REGULAR.width_px(text);
        assert_eq!(REGULAR.truncated(text, full_width), text);
        assert_eq!(
            REGULAR.truncated(text, full_width - 1.0),
            "Grundgesetz Hock…"
        );
        let width_of_first_word = REGULAR.width_px("Grundgesetz …");
        assert_eq!(REGULAR.truncated(text, width_of_first_word), "Grundgesetz…");
        assert_eq!(REGULAR.truncated(text, 1.0), "");
    }

    #[test]
    fn words_are_wrapped_and_the_last_line_truncated() {
        let width = REGULAR.width_px("one two");
        assert_eq!(
            REGULAR.wrapped("one two three four", width, 5),
            ["one two", "three", "four"]
        );
        let cut = REGULAR.wrapped("one two three four", width, 2);
        assert_eq!(cut.len(), 2);
        assert_eq!(cut[0], "one two");
        assert!(
            cut[1].ends_with('…') && REGULAR.width_px(&cut[1]) <= width,
            "{cut:?}"
        );
        assert!(REGULAR.wrapped(" ", width, 2).is_empty());
    }

    #[test]
    fn character_without_a_glyph_is_a_box() {
        let element = REGULAR.svg("冰", [0.0, 0.0], Align::Left);
        // A box has two outlines, an outer and an inner one, each of which begins with `M`.
        assert_eq!(element.matches('M').count(), 2, "{element}");
        assert_eq!(element, REGULAR.svg("球", [0.0, 0.0], Align::Left));
        assert!(REGULAR.width_px("冰") > 0.0);
        assert!(!is_legible("冰球"));
        assert!(!is_legible(" "));
        for name in ["冰球 2", "Łódź", "Ωμέγα", "Шайба"] {
            assert!(is_legible(name), "{name}");
        }
    }

    #[test]
    fn latin_greek_and_cyrillic_have_no_box() {
        for text in [
            "Ñandú Šťastný Çelik",
            "Αθήνα",
            "Київ Ёж",
            "1 – 2 ≤ 3 … “x” €",
        ] {
            for weight in [Weight::Regular, Weight::Semibold] {
                let without_glyph: Vec<char> =
                    text.chars().filter(|c| !weight.covers(*c)).collect();
                assert!(without_glyph.is_empty(), "{without_glyph:?}");
            }
        }
    }
}
