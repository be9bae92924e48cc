//! The default reward of the environments.

use faceoff_scoring::tournament::{EE_POINTS, JOINT_POS_POINTS, JOINT_VEL_POINTS, LINK_POINTS};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{Episode, ViolatedConstraints, table::geometry::TABLE};

/// Reward of a success at the episode's end.
pub const SUCCESS: f64 = 10.0;
/// Decrease of the potential per metre between mallet and puck, up to one metre.
const PER_METRE_TO_PUCK: f64 = 0.5;
/// Decrease of the potential per m/s of the puck's speed in `defend`, up to 5 m/s.
const PER_METRE_PER_SECOND: f64 = 1.0;

/// Potential of a state, in points; the reward of a step contains its change (potential-based shaping). It is higher the closer the
/// state is to success: the puck near the opponent's end (hit), slow (defend), or near the table's long axis (prepare).
pub fn potential(task: AirHockeyTask, episode: &Episode) -> f64 {
    let world = episode.world();
    let puck = world.puck();
    let [x, y, _] = puck.pose;
    let [mallet_x, mallet_y, _] = world.kinematics(0).end_effector.origin.to_array();
    let (dx, dy) = (mallet_x - TABLE.base_x_m - x, mallet_y - y);
    let distance = (dx * dx + dy * dy).sqrt();
    let distance_cost = PER_METRE_TO_PUCK * distance.min(1.0);
    let value = match task {
        AirHockeyTask::Hit => x.clamp(-1.0, 1.0) - distance_cost,
        AirHockeyTask::Defend => -PER_METRE_PER_SECOND * puck.speed().min(5.0) - distance_cost,
        AirHockeyTask::Prepare => -y.abs().min(1.0) - distance_cost,
    };
    // The numbers of a diverged world are meaningless.
    if value.is_finite() { value } else { 0.0 }
}

/// Penalty points of the constraints whose first violation in this episode was in the last step.
pub fn new_penalty_points(before: ViolatedConstraints, after: ViolatedConstraints) -> f64 {
    [
        (before.ee, after.ee, EE_POINTS),
        (before.link, after.link, LINK_POINTS),
        (before.joint_pos, after.joint_pos, JOINT_POS_POINTS),
        (before.joint_vel, after.joint_vel, JOINT_VEL_POINTS),
    ]
    .into_iter()
    .filter(|(before, after, _)| *after && !*before)
    .map(|(_, _, points)| points)
    .sum()
}
