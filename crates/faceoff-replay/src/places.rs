//! Where things of a clip are on the table.

use crate::{clip::Clip, column::Column};
use faceoff_sim::{
    JOINTS, dynamics::arm::Kinematics, model::DOFS, table::frames::table_from_robot,
};

impl Clip {
    /// The puck's true place at each sample: x, y (m), table frame.
    #[must_use]
    pub fn puck_places(&self) -> Vec<[f64; 2]> {
        self.pairs("puck_x", "puck_y")
    }

    /// Where the agent was told that the puck is, at each sample: x, y (m), table frame; of clips of what was observed.
    #[must_use]
    pub fn seen_places(&self) -> Vec<[f64; 2]> {
        self.pairs("seen_x", "seen_y")
    }

    /// A robot's mallet at each sample, by the arm's kinematics: x, y (m), table frame; empty for a robot that is not there.
    /// The opponent's universal joint, which is not recorded in episodes, counts as straight.
    #[must_use]
    pub fn mallet_places(&self, robot: usize) -> Vec<[f64; 2]> {
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
        let place = |sample: usize| {
            mallet(robot, |joint| {
                angles[joint].get(sample).copied().unwrap_or_default()
            })
        };
        (0..samples).map(place).collect()
    }

    /// A robot's mallet at one sample of the clip, counted from its first; `None` if there is no such robot or sample.
    #[must_use]
    pub fn mallet_place(&self, robot: usize, sample: usize) -> Option<[f64; 2]> {
        let angles: Vec<Option<f64>> = self
            .angles(robot)
            .map(|column| column?.values().nth(sample))
            .collect();
        let is_there = angles[..JOINTS].iter().all(Option::is_some);
        is_there.then(|| mallet(robot, |joint| angles[joint].unwrap_or_default()))
    }

    /// The columns of a robot's joints and of its mallet's hinges.
    fn angles(&self, robot: usize) -> impl Iterator<Item = Option<&Column>> {
        let prefix = if robot == 0 { "" } else { "opponent_" };
        let names = (1..=JOINTS).map(move |joint| format!("{prefix}q_{joint}"));
        let hinges = [1, 2].map(|axis| format!("{prefix}universal_{axis}"));
        names.chain(hinges).map(|name| self.column(&name))
    }

    fn pairs(&self, x: &str, y: &str) -> Vec<[f64; 2]> {
        match (self.column(x), self.column(y)) {
            (Some(x), Some(y)) => x.values().zip(y.values()).map(Into::into).collect(),
            _ => Vec::new(),
        }
    }
}

/// By the arm's kinematics.
fn mallet(robot: usize, angle: impl Fn(usize) -> f64) -> [f64; 2] {
    let q: [f64; DOFS] = std::array::from_fn(angle);
    let centre = Kinematics::new(&q).cylinder_centre().lane(0);
    let [x, y, _] = table_from_robot(robot, centre);
    [x, y]
}
