//! Penalty points of air hockey's violations.

use crate::episode::COMPUTATION_TIME_MAX_POINTS;
use faceoff_types::{ViolationName, Violations};

/// Penalty points for an end effector outside its bounds (paper on the 2023 Robot Air Hockey Challenge, §2.2).
pub const EE_POINTS: f64 = 3.0;
/// Penalty points for an elbow or wrist that is too low (reference implementation; not in the paper).
pub const LINK_POINTS: f64 = 3.0;
/// Penalty points for a joint beyond its position limits (paper §2.2).
pub const JOINT_POS_POINTS: f64 = 2.0;
/// Penalty points for a joint beyond its velocity limits (paper §2.2).
pub const JOINT_VEL_POINTS: f64 = 1.0;
/// Highest penalty of one episode.
pub const MAX_EPISODE_PENALTY: f64 =
    EE_POINTS + LINK_POINTS + JOINT_POS_POINTS + JOINT_VEL_POINTS + COMPUTATION_TIME_MAX_POINTS;

/// The kinds of violations with their points, in display order.
const POINTS: [(ViolationName, f64); 4] = [
    (ViolationName::new("ee"), EE_POINTS),
    (ViolationName::new("link"), LINK_POINTS),
    (ViolationName::new("joint_pos"), JOINT_POS_POINTS),
    (ViolationName::new("joint_vel"), JOINT_VEL_POINTS),
];

/// All kinds of violations, in display order.
pub(crate) fn violation_names() -> impl Iterator<Item = ViolationName> {
    let of_the_robot = POINTS.into_iter().map(|(name, _)| name);
    of_the_robot.chain([ViolationName::COMPUTATION_TIME])
}

/// Penalty points for constraints that the robot's motion violated.
pub(crate) fn violation_points(violations: &Violations) -> f64 {
    let violated = POINTS
        .into_iter()
        .filter(|(name, _)| violations.contains(*name));
    violated.map(|(_, points)| points).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_those_of_the_competition() {
        let competition = faceoff_airhockey::competition();
        assert!(violation_names().eq(competition.violations.iter().map(|info| info.name)));
        for (name, points) in POINTS {
            assert_eq!(competition.violation_points(&[name].into()), points);
        }
        assert_eq!(MAX_EPISODE_PENALTY, 11.0);
    }
}
