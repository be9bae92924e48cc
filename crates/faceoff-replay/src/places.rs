//! Where things of a clip are on the table.

use crate::clip::Clip;
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
        let prefix = if robot == 0 { "" } else { "opponent_" };
        let values = |name: String| -> Vec<f64> {
            self.column(&name)
                .map(|column| column.values().collect())
                .unwrap_or_default()
        };
        let names = (1..=JOINTS).map(|joint| format!("{prefix}q_{joint}"));
        let hinges = [1, 2].map(|axis| format!("{prefix}universal_{axis}"));
        let angles: Vec<Vec<f64>> = names.chain(hinges).map(values).collect();
        let samples = angles[..JOINTS]
            .iter()
            .map(Vec::len)
            .min()
            .unwrap_or_default();
        let place = |sample: usize| {
            let q: [f64; DOFS] =
                std::array::from_fn(|i| angles[i].get(sample).copied().unwrap_or_default());
            let centre = Kinematics::new(&q).cylinder_centre().lane(0);
            let [x, y, _] = table_from_robot(robot, centre);
            [x, y]
        };
        (0..samples).map(place).collect()
    }

    fn pairs(&self, x: &str, y: &str) -> Vec<[f64; 2]> {
        match (self.column(x), self.column(y)) {
            (Some(x), Some(y)) => x.values().zip(y.values()).map(Into::into).collect(),
            _ => Vec::new(),
        }
    }
}
