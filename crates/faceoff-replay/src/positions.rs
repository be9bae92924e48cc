//! Positions of puck and mallets in a clip.

use crate::{clip::Clip, column::Column};
use faceoff_sim::{
    JOINTS, dynamics::arm::Kinematics, model::DOFS, table::frames::table_from_robot,
};

impl Clip {
    /// The puck's true position at each sample: x, y (m), table frame.
    #[must_use]
    pub fn puck_positions(&self) -> Vec<[f64; 2]> {
        self.pairs("puck_x", "puck_y")
    }

    /// The puck's observed position at each sample: x, y (m), table frame; only in clips of observations.
    #[must_use]
    pub fn observed_puck_positions(&self) -> Vec<[f64; 2]> {
        self.pairs("seen_x", "seen_y")
    }

    /// Position of a robot's mallet at each sample, by the arm's kinematics: x, y (m), table frame; empty if there is no such
    /// robot. The universal joint between the opponent's arm and mallet is not recorded in episodes; it is assumed to be
    /// straight.
    #[must_use]
    pub fn mallet_positions(&self, robot: usize) -> Vec<[f64; 2]> {
        let angles: Vec<Vec<f64>> = self
            .angles(robot)
            .map(|column| {
                column
                    .map(|column| column.values().collect())
                    .unwrap_or_default()
            })
            .collect();
        let samples = angles[..JOINTS]
            .iter()
            .map(Vec::len)
            .min()
            .unwrap_or_default();
        let position = |sample: usize| {
            mallet(robot, |joint| {
                angles[joint].get(sample).copied().unwrap_or_default()
            })
        };
        (0..samples).map(position).collect()
    }

    /// Position of a robot's mallet at a sample, counted from the clip's first; `None` if there is no such robot or sample.
    #[must_use]
    pub fn mallet_position(&self, robot: usize, sample: usize) -> Option<[f64; 2]> {
        let angles: Vec<Option<f64>> = self
            .angles(robot)
            .map(|column| column?.values().nth(sample))
            .collect();
        let exists = angles[..JOINTS].iter().all(Option::is_some);
        exists.then(|| mallet(robot, |joint| angles[joint].unwrap_or_default()))
    }

    /// The columns of a robot's joints and of its universal joint.
    fn angles(&self, robot: usize) -> impl Iterator<Item = Option<&Column>> {
        let prefix = if robot == 0 { "" } else { "opponent_" };
        let names = (1..=JOINTS).map(move |joint| format!("{prefix}q_{joint}"));
        let universal_names = [1, 2].map(|axis| format!("{prefix}universal_{axis}"));
        names.chain(universal_names).map(|name| self.column(&name))
    }

    /// The values of two columns as pairs.
    fn pairs(&self, x: &str, y: &str) -> Vec<[f64; 2]> {
        match (self.column(x), self.column(y)) {
            (Some(x), Some(y)) => x.values().zip(y.values()).map(Into::into).collect(),
            _ => Vec::new(),
        }
    }
}

/// The mallet's position, by the arm's kinematics.
fn mallet(robot: usize, angle: impl Fn(usize) -> f64) -> [f64; 2] {
    let q: [f64; DOFS] = std::array::from_fn(angle);
    // The kinematics can compute several arms at once; the only one here is lane 0.
    let centre = Kinematics::new(&q).cylinder_centre().to_array();
    let [x, y, _] = table_from_robot(robot, centre);
    [x, y]
}
