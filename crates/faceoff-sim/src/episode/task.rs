//! The three tasks: the puck's initial state, the end of an episode, and success (`docs/rules.md`, "What is played"). In `hit`
//! the agent scores a goal, in `defend` it stops an incoming puck, in `prepare` it moves a resting puck into a good position.

use crate::AirHockeyTask;
use crate::episode::ends::{CROSSED_MIDDLE, LEFT_TABLE, REACHED_AXIS, STOPPED};
use crate::{
    model::TOOL,
    stream::RandomStream,
    table::{
        geometry::{PUCK, TABLE},
        puck::Puck,
    },
};
use faceoff_types::EpisodeEnd;
use std::f64::consts::FRAC_PI_2;

pub use faceoff_types::EPISODE_STEPS;

/// The numbers of the tasks, in the table frame: origin at the table's centre, x towards the opponent's goal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaskRules {
    /// Range of the puck's x at the start of `hit`, m.
    pub hit_x_m: [f64; 2],
    /// Range of the puck's speed at the start of `hit`, m/s.
    pub hit_speed_m_s: [f64; 2],
    /// Largest angle ± between the puck's initial velocity in `hit` and −x, rad.
    pub hit_angle_rad: f64,
    /// Largest yaw rate ± of the puck at the start of `hit`, rad/s.
    pub hit_yaw_rate_rad_s: f64,
    /// Least speed at which a goal counts, m/s. The challenge's paper requires one, its simulator does not.
    pub hit_min_goal_speed_m_s: f64,
    /// Range of the puck's x at the start of `defend`, m.
    pub defend_x_m: [f64; 2],
    /// Largest |y| of the puck at the start of `defend`, m.
    pub defend_y_m: f64,
    /// Range of the puck's speed at the start of `defend`, m/s.
    pub defend_speed_m_s: [f64; 2],
    /// Largest angle ± between the puck's initial velocity in `defend` and −x, rad.
    pub defend_angle_rad: f64,
    /// Largest yaw rate ± of the puck at the start of `defend`, rad/s.
    pub defend_yaw_rate_rad_s: f64,
    /// `defend` ends when the puck is slower than this, m/s.
    pub defend_stopped_m_s: f64,
    /// `prepare` starts with the puck in a strip near the edge of the table. Range of x of the strip along a long side, m.
    pub prepare_side_x_m: [f64; 2],
    /// Range of x of the strip in a corner, m.
    pub prepare_corner_x_m: [f64; 2],
    /// `prepare` ends when the puck's |y| is below this, m.
    pub prepare_axis_m: f64,
    /// Range of x in which `defend` and `prepare` succeed, m.
    pub success_x_m: [f64; 2],
    /// Bound on vx below which `defend` and `prepare` succeed, m/s.
    pub success_vx_m_s: f64,
    /// A faster puck counts as having left the table, m/s.
    pub lost_speed_m_s: f64,
}

/// The numbers of the current ruleset.
pub const TASK_RULES: TaskRules = TaskRules {
    hit_x_m: [-0.7, -0.2],
    hit_speed_m_s: [0.0, 0.5],
    hit_angle_rad: FRAC_PI_2 + 0.1,
    hit_yaw_rate_rad_s: 2.0,
    hit_min_goal_speed_m_s: 0.0,
    defend_x_m: [0.29, 0.65],
    defend_y_m: 0.4,
    defend_speed_m_s: [1.0, 3.0],
    defend_angle_rad: 0.5,
    defend_yaw_rate_rad_s: 10.0,
    defend_stopped_m_s: 0.1,
    prepare_side_x_m: [-0.8, -0.2],
    prepare_corner_x_m: [-0.94, -0.8],
    prepare_axis_m: 0.01,
    success_x_m: [-0.8, -0.2],
    success_vx_m_s: 0.1,
    lost_speed_m_s: 100.0,
};

/// Largest |y| of a puck with enough space for the mallet between it and a long side: the puck's radius and the
/// mallet's diameter from the side, 0.39105 m.
pub const PLAYABLE_Y_M: f64 = TABLE.half_width_m() - PUCK.radius_m - 2.0 * TOOL.cylinder_radius_m;

/// |y| at the outer edge of the strips of `prepare`, 0.48535 m.
const STRIP_Y_M: f64 = TABLE.half_width_m() - PUCK.radius_m - 0.002;

/// Draws the puck's initial state [x, y, yaw, vx, vy, yaw rate]. It always makes six draws, so that the draws of one quantity do not
/// depend on the task.
pub fn initial_puck(task: AirHockeyTask, stream: &mut RandomStream) -> [f64; 6] {
    // Uniform in [0, 1).
    let u: [f64; 6] = std::array::from_fn(|_| stream.unit());
    let between = |[low, high]: [f64; 2], u: f64| low + (high - low) * u;
    let within_plus_minus = |limit: f64, u: f64| between([-limit, limit], u);
    // `angle` is measured from −x, towards the agent's goal.
    let moving = |x: f64, y: f64, speed: f64, angle: f64, yaw_rate: f64| {
        let (sin, cos) = libm::sincos(angle);
        [x, y, 0.0, -cos * speed, sin * speed, yaw_rate]
    };
    match task {
        AirHockeyTask::Hit => moving(
            between(TASK_RULES.hit_x_m, u[0]),
            within_plus_minus(PLAYABLE_Y_M, u[1]),
            between(TASK_RULES.hit_speed_m_s, u[2]),
            within_plus_minus(TASK_RULES.hit_angle_rad, u[3]),
            within_plus_minus(TASK_RULES.hit_yaw_rate_rad_s, u[4]),
        ),
        AirHockeyTask::Defend => moving(
            between(TASK_RULES.defend_x_m, u[0]),
            within_plus_minus(TASK_RULES.defend_y_m, u[1]),
            between(TASK_RULES.defend_speed_m_s, u[2]),
            within_plus_minus(TASK_RULES.defend_angle_rad, u[3]),
            within_plus_minus(TASK_RULES.defend_yaw_rate_rad_s, u[4]),
        ),
        AirHockeyTask::Prepare => {
            // Ranges of x and |y|; a strip is drawn with a probability in proportion to its area.
            let side = (TASK_RULES.prepare_side_x_m, [PLAYABLE_Y_M, STRIP_Y_M]);
            let corner = (
                TASK_RULES.prepare_corner_x_m,
                [TABLE.goal_width_m / 2.0, STRIP_Y_M],
            );
            let area = |(x, y): ([f64; 2], [f64; 2])| (x[1] - x[0]) * (y[1] - y[0]);
            let (xs, ys) = if u[2] * (area(side) + area(corner)) < area(side) {
                side
            } else {
                corner
            };
            let sign = if u[3] < 0.5 { -1.0 } else { 1.0 };
            [
                between(xs, u[0]),
                sign * between(ys, u[1]),
                0.0,
                0.0,
                0.0,
                0.0,
            ]
        }
    }
}

/// The reason if an episode ends in this true state, `steps` control steps after its start.
#[must_use]
pub fn end(task: AirHockeyTask, puck: &Puck, steps: u32) -> Option<EpisodeEnd> {
    end_by_puck(task, puck).or((steps >= EPISODE_STEPS).then_some(EpisodeEnd::HORIZON))
}

/// The reason if the puck's state ends the episode, regardless of time.
fn end_by_puck(task: AirHockeyTask, puck: &Puck) -> Option<EpisodeEnd> {
    let [x, y, _] = puck.pose;
    let vx = puck.velocity[0];
    let speed = puck.speed();
    // Negated, so that NaN ends the episode too.
    let is_on_table = x.abs() <= TABLE.half_length_m()
        && y.abs() <= TABLE.half_width_m()
        && speed <= TASK_RULES.lost_speed_m_s;
    if !is_on_table {
        return Some(LEFT_TABLE);
    }
    match task {
        AirHockeyTask::Hit if x > 0.0 && vx < 0.0 => Some(CROSSED_MIDDLE),
        AirHockeyTask::Defend if x > 0.0 && vx > 0.0 => Some(CROSSED_MIDDLE),
        AirHockeyTask::Defend if speed < TASK_RULES.defend_stopped_m_s => Some(STOPPED),
        AirHockeyTask::Prepare if x > 0.0 => Some(CROSSED_MIDDLE),
        AirHockeyTask::Prepare if y.abs() < TASK_RULES.prepare_axis_m => Some(REACHED_AXIS),
        _ => None,
    }
}

/// Is this true state of the puck, the last of an episode, a success?
#[must_use]
pub fn success(task: AirHockeyTask, puck: &Puck) -> bool {
    let [x, y, _] = puck.pose;
    let is_in_place = TASK_RULES.success_x_m[0] < x
        && x <= TASK_RULES.success_x_m[1]
        && puck.velocity[0] < TASK_RULES.success_vx_m_s;
    match task {
        AirHockeyTask::Hit => {
            x > TABLE.half_length_m()
                && y.abs() < TABLE.goal_width_m / 2.0
                && puck.speed() >= TASK_RULES.hit_min_goal_speed_m_s
        }
        AirHockeyTask::Defend => is_in_place,
        AirHockeyTask::Prepare => is_in_place && y.abs() < PLAYABLE_Y_M,
    }
}
