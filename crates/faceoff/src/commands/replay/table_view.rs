//! The picture of the table from above, with the paths of puck and mallets.

use super::recording::{CONSTRAINTS, EpisodeRecording};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    episode::task::{PLAYABLE_Y_M, TASK_RULES},
    model::TOOL,
    table::geometry::{PUCK, TABLE},
};
use faceoff_types::Task;
use std::fmt::Write;

/// Visible margin around the table, m.
const MARGIN_M: f64 = 0.07;

/// The table from above as SVG, with the opponent's goal on the right: paths, final positions, and marks of the first
/// constraint violations. The script animates elements with an id.
pub fn svg(recording: &EpisodeRecording, width_px: u32, attributes: &str) -> String {
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
    out += &target_zone(recording.outcome.task);
    let puck: Vec<[f64; 2]> = recording.puck.iter().map(|[x, y, _]| [*x, *y]).collect();
    out += &path(
        &recording.opponent,
        "#b98a3a",
        "stroke-dasharray=\"0.006 0.006\"",
    );
    out += &path(&recording.mallet, "#2a6fb0", "");
    out += &path(&puck, "#c0392b", "");
    for [x, y] in &recording.observed_puck {
        out += &format!("<circle cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"0.003\" fill=\"#888\"/>\n");
    }
    for (group, (name, ..)) in CONSTRAINTS.iter().enumerate() {
        if let Some([x, y]) = recording
            .first_violation(group)
            .and_then(|k| recording.mallet.get(k))
        {
            out += &format!(
                "<path d=\"M{:.4} {:.4}l0.03 0.03m0 -0.03l-0.03 0.03\" stroke=\"#e00\" stroke-width=\"0.007\">\
                 <title>first violation of the {name} limit</title></path>\n",
                x - 0.015,
                y - 0.015
            );
        }
    }
    let (puck_radius, mallet_radius) = (PUCK.radius_m, TOOL.cylinder_radius_m);
    if let Some([x, y, _]) = recording.puck.first() {
        out += &format!(
            "<circle cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"{puck_radius}\" stroke=\"#c0392b\" stroke-dasharray=\"0.01 0.008\"/>\n"
        );
    }
    if let Some([x, y]) = recording.opponent.last() {
        out += &disc("opponent", *x, *y, mallet_radius, "#e8c27c");
    }
    if let Some([x, y]) = recording.mallet.last() {
        out += &disc("mallet", *x, *y, mallet_radius, "#7fb2e0");
    }
    if let Some([x, y]) = recording.observed_puck.last() {
        out += &format!(
            "<circle id=\"observed\" cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"{puck_radius}\" stroke=\"#777\"/>\n"
        );
    }
    if let Some([x, y, _]) = recording.puck.last() {
        out += &disc("puck", *x, *y, puck_radius, "#e06a5c");
    }
    out + "</g>\n</svg>\n"
}

/// The zone in which the puck should end.
fn target_zone(task: Task) -> String {
    let half_width = match AirHockeyTask::try_from(task) {
        Ok(AirHockeyTask::Defend) => TABLE.half_width_m(),
        Ok(AirHockeyTask::Prepare) => PLAYABLE_Y_M,
        Ok(AirHockeyTask::Hit) | Err(_) => return String::new(),
    };
    let [from, to] = TASK_RULES.success_x_m;
    format!(
        "<rect x=\"{from}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"#dff0dc\"><title>target zone of the puck</title></rect>\n",
        -half_width,
        to - from,
        2.0 * half_width
    )
}

fn path(points: &[[f64; 2]], colour: &str, attributes: &str) -> String {
    let mut out = String::from("<polyline points=\"");
    for [x, y] in points {
        // Writing to a string does not fail.
        let _written = write!(out, "{x:.4},{y:.4} ");
    }
    out + &format!("\" stroke=\"{colour}\" {attributes}/>\n")
}

fn disc(id: &str, x: f64, y: f64, radius: f64, colour: &str) -> String {
    format!(
        "<circle id=\"{id}\" cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"{radius}\" fill=\"{colour}\" stroke=\"#333\"/>\n"
    )
}
