//! The picture of the table from above, with the paths of puck and mallets in a rally.

use super::{
    super::table_parts::{self, DISC_COLOURS, PATH_COLOURS, disc, path},
    recording::RecordedGame,
};
use faceoff_dataset::game::ListedRally;
use faceoff_sim::{model::TOOL, table::geometry::PUCK};

/// The rally's paths and final positions as SVG, with the first side on the left. The script animates elements with an id.
pub fn svg(game: &RecordedGame, rally: &ListedRally, width_px: u32, attributes: &str) -> String {
    let samples = game.rally_samples(rally);
    let mut out = table_parts::begin(width_px, attributes);
    out += "<g id=\"paths\">\n";
    let bodies: [Vec<[f64; 2]>; 3] = [
        thinned(samples.iter().map(|sample| sample.mallets[0])),
        thinned(samples.iter().map(|sample| sample.mallets[1])),
        thinned(samples.iter().map(|sample| sample.puck)),
    ];
    for (points, colour) in bodies.iter().zip(PATH_COLOURS) {
        out += &path(points, colour, "");
    }
    let [x, y] = rally.initial_puck;
    let (puck_radius, mallet_radius) = (PUCK.radius_m, TOOL.cylinder_radius_m);
    out += &format!(
        "<circle cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"{puck_radius}\" stroke=\"#c0392b\" stroke-dasharray=\"0.01 0.008\"/>\n</g>\n"
    );
    for (name, colour) in ["trail-1", "trail-2", "trail-puck"]
        .into_iter()
        .zip(PATH_COLOURS)
    {
        out += &format!("<polyline id=\"{name}\" stroke=\"{colour}\" points=\"\"/>\n");
    }
    if let Some(last) = samples.last() {
        for (side, id) in ["mallet-1", "mallet-2"].into_iter().enumerate() {
            let [x, y] = last.mallets[side];
            out += &disc(id, x, y, mallet_radius, DISC_COLOURS[side]);
        }
        let [x, y] = last.puck;
        out += &disc("puck", x, y, puck_radius, DISC_COLOURS[2]);
    }
    out + table_parts::END
}

/// The points without those that are less than a millimetre from the one before, so that a robot that waits adds none.
fn thinned(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for [x, y] in points {
        let is_near =
            |[last_x, last_y]: &[f64; 2]| (x - last_x).abs() < 1e-3 && (y - last_y).abs() < 1e-3;
        if !kept.last().is_some_and(is_near) {
            kept.push([x, y]);
        }
    }
    kept
}
