//! The picture of the table from above, with the paths of puck and mallets.

use super::{
    recording::{CONSTRAINTS, EpisodeRecording},
    table_parts::{self, DISC_COLOURS, PATH_COLOURS, TABLE_COLOURS, disc, path},
};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    episode::task::{PLAYABLE_Y_M, TASK_RULES},
    model::TOOL,
    table::geometry::{PUCK, TABLE},
};
use faceoff_types::Task;

/// The table from above as SVG, with the opponent's goal on the right: paths, final positions, and marks of the first
/// constraint violations. The script animates elements with an id.
pub fn svg(recording: &EpisodeRecording, width_px: u32, attributes: &str) -> String {
    let mut out = table_parts::begin(width_px, attributes);
    out += &target_zone(recording.outcome.task);
    let puck: Vec<[f64; 2]> = recording.puck.iter().map(|[x, y, _]| [*x, *y]).collect();
    let [mallet_path, opponent_path, puck_path] = PATH_COLOURS;
    let [mallet_disc, opponent_disc, puck_disc] = DISC_COLOURS;
    out += &path(
        &recording.opponent,
        opponent_path,
        "stroke-dasharray=\"0.006 0.006\"",
    );
    out += &path(&recording.mallet, mallet_path, "");
    out += &path(&puck, puck_path, "");
    for [x, y] in &recording.observed_puck {
        out += &format!("<circle cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"0.003\" fill=\"#888\"/>\n");
    }
    for (constraint, (name, ..)) in CONSTRAINTS.iter().enumerate() {
        if let Some([x, y]) = recording
            .first_violation(constraint)
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
            "<circle cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"{puck_radius}\" stroke=\"{puck_path}\" stroke-dasharray=\"0.01 0.008\"/>\n"
        );
    }
    if let Some([x, y]) = recording.opponent.last() {
        out += &disc("opponent", *x, *y, mallet_radius, opponent_disc);
    }
    if let Some([x, y]) = recording.mallet.last() {
        out += &disc("mallet", *x, *y, mallet_radius, mallet_disc);
    }
    if let Some([x, y]) = recording.observed_puck.last() {
        out += &format!(
            "<circle id=\"observed\" cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"{puck_radius}\" stroke=\"#777\"/>\n"
        );
    }
    if let Some([x, y, _]) = recording.puck.last() {
        out += &disc("puck", *x, *y, puck_radius, puck_disc);
    }
    out + table_parts::END
}

/// The zone in which the puck should end.
pub fn target_zone(task: Task) -> String {
    let half_width = match AirHockeyTask::try_from(task) {
        Ok(AirHockeyTask::Defend) => TABLE.half_width_m(),
        Ok(AirHockeyTask::Prepare) => PLAYABLE_Y_M,
        Ok(AirHockeyTask::Hit) | Err(_) => return String::new(),
    };
    let [from, to] = TASK_RULES.success_x_m;
    format!(
        "<rect x=\"{from}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"><title>target zone of the puck</title></rect>\n",
        -half_width,
        to - from,
        2.0 * half_width,
        TABLE_COLOURS[4]
    )
}
