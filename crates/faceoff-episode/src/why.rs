//! Why an episode ended as it did, in words.

use faceoff_sim::{
    episode::task::{PLAYABLE_Y_M, TASK_RULES},
    table::geometry::TABLE,
};
use faceoff_types::{AgentFaultKind, EpisodeEnd, Task};

/// What happened and what would have counted, in one sentence without a full stop.
///
/// `puck` is the last true state, table frame: x, y (m), yaw (rad), and their rates (m/s, rad/s); `steps` the control
/// steps played; `fault` the agent's, if one ended the episode.
#[must_use]
pub fn why_it_ended(
    task: Task,
    end: EpisodeEnd,
    puck: &[f64; 6],
    steps: u32,
    fault: Option<&AgentFaultKind>,
) -> String {
    let [x, y, _, vx, vy, _] = *puck;
    // Not `hypot`: the C library of newer systems only has it, and the program would need that one.
    let speed = (vx * vx + vy * vy).sqrt();
    match end {
        EpisodeEnd::AgentFault => match fault {
            Some(fault) => format!("the agent's fault ended the episode: {fault}"),
            None => "a fault of the agent ended the episode".to_owned(),
        },
        EpisodeEnd::LeftTable => left_the_table(task, x, y, speed),
        EpisodeEnd::CrossedMiddle if task == Task::Prepare => format!(
            "puck crossed the middle line: x = {} m, and it had to stay at x ≤ {} m",
            beside(x, 0.0),
            rule(TASK_RULES.success_x_m[1])
        ),
        EpisodeEnd::CrossedMiddle if task == Task::Hit => format!(
            "puck came back without a goal: x = {} m in the opponent's half, vx = {} m/s towards us",
            beside(x, 0.0),
            beside(vx, 0.0)
        ),
        EpisodeEnd::CrossedMiddle => format!(
            "puck was sent back across the middle: x = {} m, vx = {} m/s; it had to stay in our half",
            beside(x, 0.0),
            beside(vx, 0.0)
        ),
        EpisodeEnd::Stopped => format!(
            "puck stopped (below {} m/s) at {}",
            rule(TASK_RULES.defend_stopped_m_s),
            place(task, x, y, vx)
        ),
        EpisodeEnd::ReachedAxis => format!(
            "puck reached the table's long axis (|y| < {} m) at {}",
            rule(TASK_RULES.prepare_axis_m),
            place(task, x, y, vx)
        ),
        EpisodeEnd::Horizon if task == Task::Hit => format!(
            "time was up after {steps} steps, without a goal: puck at x = {} m, y = {} m, {} m/s",
            about(x),
            about(y),
            about(speed)
        ),
        EpisodeEnd::Horizon => format!(
            "time was up after {steps} steps: puck at {}",
            place(task, x, y, vx)
        ),
    }
}

fn left_the_table(task: Task, x: f64, y: f64, speed: f64) -> String {
    let goal = TABLE.goal_width_m / 2.0;
    let y_text = about(y);
    if speed > TASK_RULES.lost_speed_m_s {
        return format!(
            "puck was lost: its speed exceeded {} m/s",
            TASK_RULES.lost_speed_m_s
        );
    }
    if x > TABLE.half_length_m() && y.abs() < goal {
        let slow = task == Task::Hit && speed < TASK_RULES.hit_min_goal_speed_m_s;
        let verdict = match (task, slow) {
            (Task::Hit, false) => "goal",
            (Task::Hit, true) => "no goal, since it was too slow",
            _ => "puck left through the opponent's goal",
        };
        return format!(
            "{verdict}: puck passed the line x = {} m at y = {y_text} m, inside ±{} m, with {} m/s",
            rule(TABLE.half_length_m()),
            rule(goal),
            about(speed)
        );
    }
    if x < -TABLE.half_length_m() && y.abs() < goal {
        return format!(
            "own goal: puck passed x = {} m at y = {y_text} m",
            rule(-TABLE.half_length_m())
        );
    }
    if x.abs() > TABLE.half_length_m() {
        return format!(
            "puck left the table beside the goal: x = {} m, y = {} m, outside ±{} m",
            about(x),
            beside(y, goal.copysign(y)),
            rule(goal)
        );
    }
    format!(
        "puck left the table over a long side: x = {} m, y = {y_text} m",
        about(x)
    )
}

/// Where the puck is, against where it should be (`defend`, `prepare`), and what else would keep it from counting.
fn place(task: Task, x: f64, y: f64, vx: f64) -> String {
    let [from, to] = TASK_RULES.success_x_m;
    let inside = |within: bool| if within { "inside" } else { "outside" };
    let nearest = if (x - from).abs() < (x - to).abs() {
        from
    } else {
        to
    };
    let mut text = format!(
        "x = {} m, {} {} … {}",
        beside(x, nearest),
        inside(from < x && x <= to),
        rule(from),
        rule(to)
    );
    if task == Task::Prepare && y.abs() >= PLAYABLE_Y_M {
        text += &format!(
            "; y = {} m, outside ±{} m",
            beside(y, PLAYABLE_Y_M.copysign(y)),
            rule(PLAYABLE_Y_M)
        );
    }
    if vx >= TASK_RULES.success_vx_m_s {
        text += &format!(
            "; vx = {} m/s, not below {}",
            beside(vx, TASK_RULES.success_vx_m_s),
            rule(TASK_RULES.success_vx_m_s)
        );
    }
    text
}

/// With two decimals, or with as many more as leave it on its side of a bound.
fn beside(value: f64, bound: f64) -> String {
    let side = value.partial_cmp(&bound);
    let told = |decimals: &usize| {
        let rounded: Option<f64> = format!("{value:.decimals$}").parse().ok();
        rounded.and_then(|rounded| rounded.partial_cmp(&bound)) == side
    };
    let decimals = (2..17).find(told).unwrap_or(17);
    signed(&format!("{value:.decimals$}"))
}

fn about(value: f64) -> String {
    signed(&format!("{value:.2}"))
}

/// A number of the rules, to a hundredth of a millimetre.
fn rule(value: f64) -> String {
    signed(&((value * 1e5).round() / 1e5).to_string())
}

/// With a proper minus sign, which nothing that is rounded to zero has.
fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests;
