//! Parts of a picture of the table from above: its surface, paths and discs, as SVG in the table frame.

use faceoff_sim::table::geometry::TABLE;
use std::fmt::Write;

/// Visible margin around the table, m.
const MARGIN_M: f64 = 0.07;

/// Closes the elements that [`begin`] opens.
pub const END: &str = "</g>\n</svg>\n";

/// The colours of paths: of the first side, the second, and the puck.
pub const PATH_COLOURS: [&str; 3] = ["#2a6fb0", "#b98a3a", "#c0392b"];
/// The colours of the discs of first mallet, second mallet and puck.
pub const DISC_COLOURS: [&str; 3] = ["#7fb2e0", "#e8c27c", "#e06a5c"];
/// The colours of the table: its surface and edge, the middle line, the goals, and a target zone.
pub const TABLE_COLOURS: [&str; 5] = ["#fbfbf8", "#333", "#bbb", "#c33", "#dff0dc"];

/// Height of a picture of the table.
pub fn height_px(width_px: u32) -> f64 {
    let [width, height] = extent_m();
    (f64::from(width_px) * height / width).round()
}

/// Width and height of the visible part.
fn extent_m() -> [f64; 2] {
    [TABLE.half_length_m(), TABLE.half_width_m()].map(|half| 2.0 * (half + MARGIN_M))
}

/// Opens an SVG element that shows the area of the table, without drawing the table.
pub fn begin_without_table(width_px: u32, attributes: &str) -> String {
    let [width, height] = extent_m();
    let (left, top) = (-width / 2.0, -height / 2.0);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" {attributes} width=\"{width_px}\" height=\"{:.0}\" \
         viewBox=\"{left} {top} {width} {height}\" role=\"img\" aria-label=\"the table from above\">\n\
         <g transform=\"scale(1 -1)\" fill=\"none\" stroke-width=\"0.004\">\n",
        height_px(width_px)
    )
}

/// The empty table, with the first robot's goal on the left.
pub fn begin(width_px: u32, attributes: &str) -> String {
    let (half_length, half_width) = (TABLE.half_length_m(), TABLE.half_width_m());
    let [surface, edge, middle, goal, _] = TABLE_COLOURS;
    let mut out = begin_without_table(width_px, attributes);
    let half_goal = TABLE.goal_width_m / 2.0;
    out += &format!(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{surface}\" stroke=\"{edge}\"/>\n\
         <path d=\"M0 {}V{}\" stroke=\"{middle}\"/>\n",
        -half_length, -half_width, TABLE.length_m, TABLE.width_m, -half_width, half_width
    );
    for x in [-half_length, half_length] {
        out += &format!(
            "<path d=\"M{x} {}V{half_goal}\" stroke=\"{goal}\" stroke-width=\"0.012\"/>\n",
            -half_goal
        );
    }
    out
}

pub fn path(points: &[[f64; 2]], colour: &str, attributes: &str) -> String {
    let mut out = String::from("<polyline points=\"");
    for [x, y] in points {
        // Writing to a string does not fail.
        let _written = write!(out, "{x:.4},{y:.4} ");
    }
    out + &format!("\" stroke=\"{colour}\" {attributes}/>\n")
}

pub fn disc(id: &str, x: f64, y: f64, radius: f64, colour: &str) -> String {
    format!(
        "<circle id=\"{id}\" cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"{radius}\" fill=\"{colour}\" stroke=\"#333\"/>\n"
    )
}
