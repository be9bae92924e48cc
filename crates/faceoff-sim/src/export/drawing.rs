//! Export of a drawing as SVG: the robot from the side and the table from above, to scale, with lengths in mm.

use super::numbers::tidy;
use crate::{
    dynamics::arm::Kinematics,
    episode::constraints::{HEIGHT_TOLERANCE_M, LINK_HEIGHT_M},
    model::{EE_DESIRED_HEIGHT_M, INITIAL_Q, JOINTS, LINKS, Offset, TOOL},
    robot::inverse_kinematics::with_zero_universal,
    table::{
        frames::robot_from_table,
        geometry::{PUCK, TABLE},
    },
};
use std::fmt::{Display, Write as _};

/// The text of the SVG file. In both views the base frame's x points to the right. In the side view z points up, in the top view y.
#[must_use]
pub fn drawing() -> String {
    let mut picture = Picture {
        text: String::new(),
    };
    side_view(&mut picture);
    top_view(&mut picture);
    let [width, height] = SIZE;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <!-- Written by `faceoff sim export`. -->\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n{}</svg>\n",
        picture.text
    )
}

/// Width and height, pixels.
const SIZE: [f64; 2] = [1000.0, 870.0];
/// Pixels per metre.
const SCALE: f64 = 340.0;
/// The base frame's origin in each of the views, pixels.
const SIDE_ORIGIN: [f64; 2] = [90.0, 370.0];
const TOP_ORIGIN: [f64; 2] = [90.0, 655.0];

/// SVG attributes of the arm's lines.
const ARM: &str = "stroke=\"#4a6fa5\" stroke-linecap=\"round\"";
/// SVG attributes of auxiliary lines.
const FAINT: &str = "stroke=\"#999999\" stroke-dasharray=\"4 3\"";

fn side_view(picture: &mut Picture) {
    let to_pixels = |x: f64, z: f64| pixels(SIDE_ORIGIN, [x, z]);
    let surface = -TABLE.base_z_m;
    let [near, far] = [-1.0, 1.0].map(|side| on_table([side * TABLE.half_length_m(), 0.0])[0]);
    picture.line(
        to_pixels(near, surface),
        to_pixels(far, surface),
        "stroke=\"black\" stroke-width=\"3\"",
    );
    let end = to_pixels(far, surface);
    picture.label(
        [end[0] - 250.0, end[1] + 18.0],
        format_args!("surface of the table, {} mm above the base", mm(surface)),
    );
    for (height, text) in [
        (EE_DESIRED_HEIGHT_M, "end effector's height"),
        (LINK_HEIGHT_M, "least height of links 4 and 7"),
    ] {
        picture.line(to_pixels(-0.2, height), to_pixels(far, height), FAINT);
        let end = to_pixels(far, height);
        picture.label(
            [end[0] - 250.0, end[1] - 4.0],
            format_args!("{text}: {} mm", mm(height)),
        );
    }
    let end = to_pixels(far, EE_DESIRED_HEIGHT_M);
    picture.label(
        [end[0] - 250.0, end[1] + 12.0],
        format_args!("± {} mm", mm(HEIGHT_TOLERANCE_M)),
    );
    arm(picture);
    axes(picture, SIDE_ORIGIN, "z");
    picture.label(
        [SIDE_ORIGIN[0] - 70.0, 24.0],
        "From the side: start pose, all joints in the plane y = 0",
    );
}

/// Draws the arm in its start pose, with the numbers of its joints and the lengths of its links.
fn arm(picture: &mut Picture) {
    let to_pixels = |[x, _, z]: [f64; 3]| pixels(SIDE_ORIGIN, [x, z]);
    let kinematics = Kinematics::new(&with_zero_universal(&INITIAL_Q));
    let ee = kinematics.end_effector.origin.to_array();
    let mut points = vec![[0.0; 3]];
    points.extend(kinematics.links.map(|link| link.origin.to_array()));
    points.push(ee);
    for (i, ends) in points.windows(2).enumerate() {
        let width = if i == JOINTS { 4 } else { 14 };
        let (from, to) = (to_pixels(ends[0]), to_pixels(ends[1]));
        picture.line(from, to, format_args!("{ARM} stroke-width=\"{width}\""));
        let length = match LINKS.get(i).map(|link| link.offset) {
            Some(Offset::Y(length) | Offset::Z(length)) => length,
            None => TOOL.end_effector_z_m,
        };
        let [x, y] = [0, 1].map(|k| (from[k] + to[k]) / 2.0);
        if is_level(from, to) {
            picture.label([x - 18.0, y + 24.0], mm(length));
        } else {
            picture.label([x + 14.0, y + 12.0], mm(length));
        }
    }
    for (i, ends) in points.windows(2).take(JOINTS).enumerate() {
        let (from, [x, y]) = (to_pixels(ends[0]), to_pixels(ends[1]));
        picture.disc(
            [x, y],
            6.0,
            "fill=\"white\" stroke=\"#1d3557\" stroke-width=\"2\"",
        );
        let beside = if is_level(from, [x, y]) {
            [x - 7.0, y - 14.0]
        } else {
            [x - 26.0, y - 4.0]
        };
        picture.label(beside, format_args!("q{}", i + 1));
    }
    // The universal joint holds the mallet's axis vertical, with z downwards.
    let centre = [ee[0], 0.0, ee[2] - TOOL.cylinder_centre_z_m];
    let [x, y] = to_pixels(centre);
    let (radius, half) = (
        TOOL.cylinder_radius_m * SCALE,
        TOOL.cylinder_half_height_m * SCALE,
    );
    picture.line(
        to_pixels(ee),
        [x, y],
        "stroke=\"#b23a48\" stroke-width=\"3\"",
    );
    picture.rect(
        [x - radius, y - half],
        [2.0 * radius, 2.0 * half],
        "fill=\"#b23a48\"",
    );
    let [x, y] = to_pixels(ee);
    picture.disc([x, y], 4.0, "fill=\"#1d3557\"");
    picture.label(
        [x + 22.0, y - 16.0],
        "universal joint = end effector; below it the mallet",
    );
}

fn top_view(picture: &mut Picture) {
    let to_pixels = |point: [f64; 2]| pixels(TOP_ORIGIN, on_table(point));
    let (x, y) = (TABLE.half_length_m(), TABLE.half_width_m());
    let mouth = TABLE.goal_width_m / 2.0;
    let rim = "stroke=\"black\" stroke-width=\"3\"";
    for side in [-1.0, 1.0] {
        picture.line(to_pixels([-x, side * y]), to_pixels([x, side * y]), rim);
        for end in [-1.0, 1.0] {
            picture.line(
                to_pixels([end * x, side * y]),
                to_pixels([end * x, side * mouth]),
                rim,
            );
        }
    }
    picture.line(to_pixels([0.0, -y]), to_pixels([0.0, y]), FAINT);
    let radius = TOOL.cylinder_radius_m;
    let [left, top] = to_pixels([-x + radius, y - radius]);
    let [right, bottom] = to_pixels([x, -(y - radius)]);
    picture.rect(
        [left, top],
        [right - left, bottom - top],
        "fill=\"#4a6fa5\" fill-opacity=\"0.08\" stroke=\"#4a6fa5\" stroke-dasharray=\"4 3\"",
    );
    picture.label(
        [left + 8.0, bottom - 8.0],
        "allowed area of the end effector",
    );
    picture.disc(
        to_pixels([0.0, 0.0]),
        PUCK.radius_m * SCALE,
        "fill=\"#333333\"",
    );
    picture.label(
        [
            to_pixels([0.0, 0.0])[0] + 16.0,
            to_pixels([0.0, 0.0])[1] - 10.0,
        ],
        "puck",
    );
    let start = Kinematics::new(&with_zero_universal(&INITIAL_Q))
        .end_effector
        .origin
        .to_array();
    let mallet = pixels(TOP_ORIGIN, [start[0], start[1]]);
    picture.disc(mallet, radius * SCALE, "fill=\"#b23a48\"");
    picture.label([mallet[0] - 16.0, mallet[1] - 24.0], "mallet");
    for (point, text) in [
        (
            [-x, 0.0],
            format!("own goal: {} mm", mm(TABLE.goal_width_m)),
        ),
        ([x - 0.3, 0.0], "the other goal".to_owned()),
    ] {
        let [x, y] = to_pixels(point);
        picture.label([x + 8.0, y + 40.0], text);
    }
    let [left, bottom] = to_pixels([-x, -y]);
    picture.label(
        [left + 300.0, bottom + 20.0],
        format_args!("{} × {} mm", mm(TABLE.length_m), mm(TABLE.width_m)),
    );
    let base = TOP_ORIGIN;
    picture.label(
        [base[0] - 70.0, base[1] + 34.0],
        format_args!("base, {} mm from", mm(TABLE.base_x_m)),
    );
    picture.label([base[0] - 70.0, base[1] + 50.0], "the middle");
    axes(picture, TOP_ORIGIN, "y");
    picture.label(
        [SIDE_ORIGIN[0] - 70.0, 440.0],
        "From above: the table and robot 1's base frame",
    );
}

/// A point of the table frame, seen from above, in robot 1's base frame, m.
fn on_table([x, y]: [f64; 2]) -> [f64; 2] {
    let [x, y, _] = robot_from_table(0, [x, y, 0.0]);
    [x, y]
}

/// The position in the picture of a point with these coordinates (m) in a view with this origin (pixels).
fn pixels(origin: [f64; 2], [right, up]: [f64; 2]) -> [f64; 2] {
    [origin[0] + SCALE * right, origin[1] - SCALE * up]
}

/// Draws the two axes of a view; `up` is the name of the vertical one.
fn axes(picture: &mut Picture, origin: [f64; 2], up: &str) {
    const LENGTH: f64 = 34.0; // pixels
    let [x, y] = origin;
    let style = "stroke=\"#2a7f3f\" stroke-width=\"2\"";
    picture.line([x, y], [x + LENGTH, y], style);
    picture.line([x, y], [x, y - LENGTH], style);
    picture.label([x + LENGTH + 4.0, y + 4.0], "x");
    picture.label([x - 18.0, y - LENGTH + 8.0], up);
}

/// Is a line closer to horizontal than to vertical, in pixels?
fn is_level(from: [f64; 2], to: [f64; 2]) -> bool {
    (to[0] - from[0]).abs() > (to[1] - from[1]).abs()
}

/// A length in mm, without rounding noise.
fn mm(length_m: f64) -> f64 {
    tidy(1000.0 * length_m)
}

/// The shapes drawn so far as SVG, one per line, later ones on top. Coordinates are in pixels.
struct Picture {
    text: String,
}

impl Picture {
    /// Appends a shape.
    fn put(&mut self, shape: std::fmt::Arguments<'_>) {
        writeln!(self.text, "{shape}").expect("writing to a string cannot fail");
    }

    fn line(&mut self, from: [f64; 2], to: [f64; 2], style: impl Display) {
        self.put(format_args!(
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" {style}/>",
            from[0], from[1], to[0], to[1]
        ));
    }

    fn rect(&mut self, corner: [f64; 2], size: [f64; 2], style: &str) {
        self.put(format_args!(
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" {style}/>",
            corner[0], corner[1], size[0], size[1]
        ));
    }

    fn disc(&mut self, centre: [f64; 2], radius: f64, style: &str) {
        self.put(format_args!(
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius:.1}\" {style}/>",
            centre[0], centre[1]
        ));
    }

    fn label(&mut self, position: [f64; 2], text: impl Display) {
        self.put(format_args!(
            "<text x=\"{:.1}\" y=\"{:.1}\">{text}</text>",
            position[0], position[1]
        ));
    }
}
