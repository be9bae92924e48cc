//! The table from above as SVG: positions, paths and marks in millimetres, x towards the opponent, y up the page.

use faceoff_replay::model::TABLE;
use std::fmt::Write;

/// x and y in the table frame, in metres.
pub(super) type Position = [f64; 2];

/// Outline of the table, below everything else.
#[derive(Debug)]
pub(super) struct TableOutline {
    pub(super) view_box: String,
    /// Surface, middle line, goals.
    pub(super) elements: String,
}

/// Margin around the table, mm.
const MARGIN: f64 = 60.0;

impl TableOutline {
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

/// To millimetres, with y downwards as in SVG.
pub(super) fn to_svg([x, y]: Position) -> [f64; 2] {
    [(x * 1e3).round(), (-y * 1e3).round() + 0.0]
}

/// A line through positions as SVG path data; empty without positions.
pub(super) fn path(positions: &[Position]) -> String {
    let mut out = String::new();
    for (index, position) in positions.iter().enumerate() {
        let [x, y] = to_svg(*position);
        let letter = if index == 0 { 'M' } else { 'L' };
        // Writing to a string does not fail.
        let _written = write!(out, "{letter}{x} {y}");
    }
    out
}

/// The first and the last position, and those between that are at least `least_m` from the one kept before.
pub(super) fn thinned(positions: &[Position], least_m: f64) -> Vec<Position> {
    let mut kept: Vec<Position> = Vec::new();
    for (index, position) in positions.iter().enumerate() {
        let is_far = kept.last().is_none_or(|[x, y]| {
            let [dx, dy] = [position[0] - x, position[1] - y];
            dx * dx + dy * dy >= least_m * least_m
        });
        if is_far || index + 1 == positions.len() {
            kept.push(*position);
        }
    }
    kept
}

/// Dots at positions: lines of zero length, of which only the round ends are visible.
pub(super) fn dots(positions: &[Position]) -> String {
    marks(positions, |x, y| format!("M{x} {y}h0"))
}

/// Crosses at positions, 28 mm wide.
pub(super) fn crosses(positions: &[Position]) -> String {
    marks(positions, |x, y| {
        format!("M{} {}l28 28m0 -28l-28 28", x - 14.0, y - 14.0)
    })
}

/// Squares around positions, 26 mm wide.
pub(super) fn squares(positions: &[Position]) -> String {
    marks(positions, |x, y| {
        format!("M{} {}h26v26h-26z", x - 13.0, y - 13.0)
    })
}

/// Triangles around positions, 28 mm wide.
pub(super) fn triangles(positions: &[Position]) -> String {
    marks(positions, |x, y| format!("M{x} {}l14 24h-28z", y - 14.0))
}

/// The same mark at each position, as SVG path data.
fn marks(positions: &[Position], mark: impl Fn(f64, f64) -> String) -> String {
    let marks = positions.iter().map(|position| {
        let [x, y] = to_svg(*position);
        mark(x, y)
    });
    marks.collect()
}

/// A position in SVG coordinates, for attributes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dot {
    pub(super) x: f64,
    pub(super) y: f64,
}

impl Dot {
    pub(super) fn at(position: Position) -> Self {
        let [x, y] = to_svg(position);
        Self { x, y }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positive_y_is_up_the_page() {
        assert_eq!(path(&[[0.1, 0.2], [-0.1, 0.0]]), "M100 -200L-100 0");
        assert_eq!(dots(&[[0.0, -0.0004]]), "M0 0h0");
        assert_eq!(crosses(&[[0.0, 0.1]]), "M-14 -114l28 28m0 -28l-28 28");
        assert_eq!(path(&[]), "");
    }

    #[test]
    fn thinned_path_keeps_ends_and_drops_close_points() {
        let positions = [0.0, 0.001, 0.012, 0.013, 0.025, 0.026].map(|x| [x, 0.0]);
        let kept = thinned(&positions, 0.01).into_iter().map(|[x, _]| x);
        assert_eq!(kept.collect::<Vec<_>>(), [0.0, 0.012, 0.025, 0.026]);
        assert_eq!(thinned(&[], 0.01), Vec::<Position>::new());
    }
}
