//! The table from above, as SVG elements of a template: places, paths and marks in millimetres, x towards the opponent, y up the page.

use faceoff_replay::model::TABLE;
use std::fmt::Write;

/// A place or a way in the drawing's units.
pub(super) type Place = [f64; 2];

/// The table on which the rest is drawn.
#[derive(Debug)]
pub(super) struct Ground {
    /// What is seen, with a margin.
    pub(super) view_box: String,
    /// Surface, middle line, goals.
    pub(super) elements: String,
}

/// What is shown around the table, mm.
const MARGIN: f64 = 60.0;

impl Ground {
    pub(super) fn new() -> Self {
        let [half_length, half_width, goal] = [
            TABLE.half_length_m(),
            TABLE.half_width_m(),
            TABLE.goal_width_m / 2.0,
        ]
        .map(|m| (m * 1e3).round());
        let (left, top) = (-half_length - MARGIN, -half_width - MARGIN);
        let goals = [-half_length, half_length]
            .map(|x| format!("<path class=\"goal\" d=\"M{x} {}V{goal}\"/>", -goal));
        Self {
            view_box: format!("{left} {top} {} {}", -2.0 * left, -2.0 * top),
            elements: format!(
                "<rect class=\"surface\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>\
                 <path class=\"middle\" d=\"M0 {}V{half_width}\"/>{}",
                -half_length,
                -half_width,
                2.0 * half_length,
                2.0 * half_width,
                -half_width,
                goals.concat()
            ),
        }
    }
}

/// In millimetres, y turned downwards as SVG has it.
fn drawn([x, y]: Place) -> [f64; 2] {
    [(x * 1e3).round(), (-y * 1e3).round() + 0.0]
}

/// A way through places, as the data of an SVG path; empty without places.
pub(super) fn way(places: &[Place]) -> String {
    let mut out = String::new();
    for (index, place) in places.iter().enumerate() {
        let [x, y] = drawn(*place);
        let letter = if index == 0 { 'M' } else { 'L' };
        // Writing to a string does not fail.
        let _written = write!(out, "{letter}{x} {y}");
    }
    out
}

/// Dots at places: a path of lines without length, whose round ends are seen.
pub(super) fn dots(places: &[Place]) -> String {
    let mut out = String::new();
    for place in places {
        let [x, y] = drawn(*place);
        let _written = write!(out, "M{x} {y}h0");
    }
    out
}

/// Crosses at places, 28 mm wide.
pub(super) fn crosses(places: &[Place]) -> String {
    let mut out = String::new();
    for place in places {
        let [x, y] = drawn(*place);
        let _written = write!(out, "M{} {}l28 28m0 -28l-28 28", x - 14.0, y - 14.0);
    }
    out
}

/// Squares around places, 26 mm wide.
pub(super) fn squares(places: &[Place]) -> String {
    let mut out = String::new();
    for place in places {
        let [x, y] = drawn(*place);
        let _written = write!(out, "M{} {}h26v26h-26z", x - 13.0, y - 13.0);
    }
    out
}

/// Triangles around places, 28 mm wide.
pub(super) fn triangles(places: &[Place]) -> String {
    let mut out = String::new();
    for place in places {
        let [x, y] = drawn(*place);
        let _written = write!(out, "M{x} {}l14 24h-28z", y - 14.0);
    }
    out
}

/// A place's numbers for attributes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dot {
    pub(super) x: f64,
    pub(super) y: f64,
}

impl Dot {
    pub(super) fn at(place: Place) -> Self {
        let [x, y] = drawn(place);
        Self { x, y }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_the_table_is_up_the_page() {
        assert_eq!(way(&[[0.1, 0.2], [-0.1, 0.0]]), "M100 -200L-100 0");
        assert_eq!(dots(&[[0.0, -0.0004]]), "M0 0h0");
        assert_eq!(crosses(&[[0.0, 0.1]]), "M-14 -114l28 28m0 -28l-28 28");
        assert_eq!(way(&[]), "");
    }
}
