//! How episodes ended and what they broke, in words.

use faceoff_replay::{Broken, Group};
use faceoff_types::EpisodeEnd;

/// The words for how an episode ended.
pub(super) const fn end_word(end: EpisodeEnd) -> &'static str {
    match end {
        EpisodeEnd::Horizon => "time was up",
        EpisodeEnd::LeftTable => "puck left the table",
        EpisodeEnd::CrossedMiddle => "puck crossed the middle",
        EpisodeEnd::Stopped => "puck stopped",
        EpisodeEnd::ReachedAxis => "puck reached the long axis",
        EpisodeEnd::AgentFault => "fault of the agent",
    }
}

/// The words for a group of constraints.
pub(super) const fn group_word(group: Group) -> &'static str {
    match group {
        Group::Ee => "end effector",
        Group::Link => "elbow, wrist",
        Group::JointPos => "joint position",
        Group::JointVel => "joint velocity",
    }
}

/// What was broken, by how much and from when on.
pub(super) fn in_words(broken: &Broken) -> String {
    let unit = match broken.group {
        Group::Ee | Group::Link => at_most(1e3 * broken.worst, 1, "mm"),
        Group::JointPos => at_most(broken.worst, 4, "rad"),
        Group::JointVel => at_most(broken.worst, 3, "rad/s"),
    };
    let joint = match broken.joint {
        Some(joint) => format!(" of joint {joint}"),
        None => String::new(),
    };
    format!(
        "{}{joint}: by {unit}, from step {} on, in {} {}",
        group_word(broken.group),
        broken.from,
        broken.samples,
        if broken.samples == 1 { "step" } else { "steps" }
    )
}

/// The largest value; never as nothing.
fn at_most(worst: f64, decimals: usize, unit: &str) -> String {
    let text = format!("{worst:.decimals$}");
    if text.chars().all(|c| matches!(c, '0' | '.')) {
        let least = 0.1_f64.powi(i32::try_from(decimals).unwrap_or(1));
        format!("less than {least:.decimals$} {unit}")
    } else {
        format!("up to {text} {unit}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_broken_was_broken_by_something() {
        assert_eq!(at_most(0.0004, 3, "rad/s"), "less than 0.001 rad/s");
        assert_eq!(at_most(0.0006, 3, "rad/s"), "up to 0.001 rad/s");
        assert_eq!(at_most(12.34, 1, "mm"), "up to 12.3 mm");
    }
}
