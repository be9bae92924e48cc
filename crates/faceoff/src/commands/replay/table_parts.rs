//! Parts of a picture of the table from above: its surface, paths and discs, as SVG in the table frame.

use faceoff_sim::table::geometry::TABLE;
use std::fmt::Write;

/// Visible margin around the table, m.
const MARGIN_M: f64 = 0.07;

/// Closes the elements that [`begin`] opens.
pub const END: &str = "</g>\n</svg>\n";

/// The empty table, with the first robot's goal on the left.
pub fn begin(width_px: u32, attributes: &str) -> String {
    let (half_length, half_width) = (TABLE.half_length_m(), TABLE.half_width_m());
    let (left, top) = (-half_length - MARGIN_M, -half_width - MARGIN_M);
    let (width, height) = (-2.0 * left, -2.0 * top);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" {attributes} width=\"{width_px}\" height=\"{:.0}\" \
         viewBox=\"{left} {top} {width} {height}\" role=\"img\" aria-label=\"the table from above\">\n\
         <g transform=\"scale(1 -1)\" fill=\"none\" stroke-width=\"0.004\">\n",
        f64::from(width_px) * height / width
    );
    let half_goal = TABLE.goal_width_m / 2.0;
    out += &format!(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"#fbfbf8\" stroke=\"#333\"/>\n\
         <path d=\"M0 {}V{}\" stroke=\"#bbb\"/>\n",
        -half_length, -half_width, TABLE.length_m, TABLE.width_m, -half_width, half_width
    );
    for x in [-half_length, half_length] {
        out += &format!(
            "<path d=\"M{x} {}V{half_goal}\" stroke=\"#c33\" stroke-width=\"0.012\"/>\n",
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
