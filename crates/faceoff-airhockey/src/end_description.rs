//! Descriptions of the ends of episodes, in words for the agent's team.

use faceoff_sim::episode::ends::{CROSSED_MIDDLE, LEFT_TABLE, REACHED_AXIS, STOPPED};
use faceoff_sim::{
    AirHockeyTask,
    episode::task::{PLAYABLE_Y_M, TASK_RULES},
    table::geometry::TABLE,
};
use faceoff_types::{AgentFaultKind, EpisodeEnd, Task};

const HIT: Task = AirHockeyTask::Hit.name();
const PREPARE: Task = AirHockeyTask::Prepare.name();

/// The beginning of descriptions of episodes of `hit` whose puck entered the opponent's goal below the required speed.
pub const SLOW_GOAL: &str = "no goal, since it was too slow";
/// The beginning of descriptions of own goals.
pub const OWN_GOAL: &str = "own goal";
/// The beginning of descriptions of pucks that became too fast for the simulation.
pub const PUCK_TOO_FAST: &str = "puck was lost";

/// Describes in one sentence, without a full stop, how the episode ended and what would have been a success.
///
/// `puck` is the puck's last true state in the table frame: x, y (m), yaw (rad), and their rates (m/s, rad/s). `steps` is the number
/// of control steps, and `fault` the agent fault that ended the episode, if any.
#[must_use]
pub fn describe_end(
    task: Task,
    end: EpisodeEnd,
    puck: &[f64; 6],
    steps: u32,
    fault: Option<&AgentFaultKind>,
) -> String {
    let [x, y, _, vx, vy, _] = *puck;
    // Not `hypot`: it would make the program depend on the C library of newer systems.
    let speed = (vx * vx + vy * vy).sqrt();
    match end {
        EpisodeEnd::AGENT_FAULT => match fault {
            Some(fault) => format!("the agent's fault ended the episode: {fault}"),
            None => "a fault of the agent ended the episode".to_owned(),
        },
        LEFT_TABLE => left_the_table(task, x, y, speed),
        CROSSED_MIDDLE if task == PREPARE => format!(
            "puck crossed the middle line: x = {} m, and it had to stay at x ≤ {} m",
            relative_to(x, 0.0),
            rule_value(TASK_RULES.success_x_m[1])
        ),
        CROSSED_MIDDLE if task == HIT => format!(
            "puck came back without a goal: x = {} m in the opponent's half, moving back at {} m/s",
            relative_to(x, 0.0),
            relative_to(-vx, 0.0)
        ),
        CROSSED_MIDDLE => format!(
            "puck was sent back across the middle: x = {} m, vx = {} m/s; it had to stay in the agent's half",
            relative_to(x, 0.0),
            relative_to(vx, 0.0)
        ),
        STOPPED => format!(
            "puck stopped (below {} m/s) at {}",
            rule_value(TASK_RULES.defend_stopped_m_s),
            position_text(task, x, y, vx)
        ),
        REACHED_AXIS => format!(
            "puck reached the table's long axis (|y| < {} m) at {}",
            rule_value(TASK_RULES.prepare_axis_m),
            position_text(task, x, y, vx)
        ),
        EpisodeEnd::HORIZON if task == HIT => format!(
            "time was up after {steps} steps, without a goal: puck at x = {} m, y = {} m, {} m/s",
            rounded(x),
            rounded(y),
            rounded(speed)
        ),
        EpisodeEnd::HORIZON => format!(
            "time was up after {steps} steps: puck at {}",
            position_text(task, x, y, vx)
        ),
        other => format!("{other} at {}", position_text(task, x, y, vx)),
    }
}

fn left_the_table(task: Task, x: f64, y: f64, speed: f64) -> String {
    let goal_half_width = TABLE.goal_width_m / 2.0;
    let y_text = rounded(y);
    if speed > TASK_RULES.lost_speed_m_s {
        return format!(
            "{PUCK_TOO_FAST}: its speed exceeded {} m/s",
            TASK_RULES.lost_speed_m_s
        );
    }
    if x > TABLE.half_length_m() && y.abs() < goal_half_width {
        let is_too_slow = task == HIT && speed < TASK_RULES.hit_min_goal_speed_m_s;
        let verdict = match (task, is_too_slow) {
            (HIT, false) => "goal",
            (HIT, true) => SLOW_GOAL,
            _ => "puck left through the opponent's goal",
        };
        return format!(
            "{verdict}: puck passed the line x = {} m at y = {y_text} m, inside ±{} m, with {} m/s",
            rule_value(TABLE.half_length_m()),
            rule_value(goal_half_width),
            rounded(speed)
        );
    }
    if x < -TABLE.half_length_m() && y.abs() < goal_half_width {
        return format!(
            "{OWN_GOAL}: puck passed x = {} m at y = {y_text} m",
            rule_value(-TABLE.half_length_m())
        );
    }
    if x.abs() > TABLE.half_length_m() {
        return format!(
            "puck left the table beside the goal: x = {} m, y = {} m, outside ±{} m",
            rounded(x),
            relative_to(y, goal_half_width.copysign(y)),
            rule_value(goal_half_width)
        );
    }
    format!(
        "puck left the table over a long side: x = {} m, y = {y_text} m",
        rounded(x)
    )
}

/// The puck's position compared with the success region of `defend` and `prepare`, followed by the other conditions of a success
/// that are not met.
fn position_text(task: Task, x: f64, y: f64, vx: f64) -> String {
    let [from, to] = TASK_RULES.success_x_m;
    let place = |is_inside: bool| if is_inside { "inside" } else { "outside" };
    let nearest_bound = if (x - from).abs() < (x - to).abs() {
        from
    } else {
        to
    };
    let mut text = format!(
        "x = {} m, {} {} … {}",
        relative_to(x, nearest_bound),
        place(from < x && x <= to),
        rule_value(from),
        rule_value(to)
    );
    if task == PREPARE && y.abs() >= PLAYABLE_Y_M {
        text += &format!(
            "; y = {} m, outside ±{} m",
            relative_to(y, PLAYABLE_Y_M.copysign(y)),
            rule_value(PLAYABLE_Y_M)
        );
    }
    if vx >= TASK_RULES.success_vx_m_s {
        text += &format!(
            "; vx = {} m/s, not below {}",
            relative_to(vx, TASK_RULES.success_vx_m_s),
            rule_value(TASK_RULES.success_vx_m_s)
        );
    }
    text
}

/// The value with two decimals, or with as many more as are needed to show on which side of the bound it is.
fn relative_to(value: f64, bound: f64) -> String {
    let side = value.partial_cmp(&bound);
    let shows_side = |decimals: &usize| {
        let rounded: Option<f64> = format!("{value:.decimals$}").parse().ok();
        rounded.and_then(|rounded| rounded.partial_cmp(&bound)) == side
    };
    let decimals = (2..17).find(shows_side).unwrap_or(17);
    with_minus_sign(&format!("{value:.decimals$}"))
}

fn rounded(value: f64) -> String {
    with_minus_sign(&format!("{value:.2}"))
}

/// A value of the rules, to a hundredth of a millimetre.
fn rule_value(value: f64) -> String {
    with_minus_sign(&((value * 1e5).round() / 1e5).to_string())
}

/// Replaces a hyphen by a minus sign, and drops it if the number is rounded to zero.
fn with_minus_sign(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests;
