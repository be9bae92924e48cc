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
        Group::Ee | Group::Link => format!("{:.1} mm", 1e3 * broken.worst),
        Group::JointPos => format!("{:.4} rad", broken.worst),
        Group::JointVel => format!("{:.3} rad/s", broken.worst),
    };
    let joint = match broken.joint {
        Some(joint) => format!(" of joint {joint}"),
        None => String::new(),
    };
    format!(
        "{}{joint}: by up to {unit}, from step {} on, in {} {}",
        group_word(broken.group),
        broken.from,
        broken.samples,
        if broken.samples == 1 { "step" } else { "steps" }
    )
}
