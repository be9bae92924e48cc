//! Outcomes and violations of episodes as text. A *violation* is a control step or more in which the robot exceeds a safety limit.

use faceoff_replay::{Group, ViolationSummary};
use faceoff_types::Competition;

pub(super) const fn group_label(group: Group) -> &'static str {
    match group {
        Group::Ee => "end effector",
        Group::Link => "elbow, wrist",
        Group::JointPos => "joint position",
        Group::JointVel => "joint velocity",
    }
}

/// A violation with its size and duration.
pub(super) fn describe_violation(
    competition: &Competition,
    violation: &ViolationSummary,
) -> String {
    let group = Group::ALL
        .into_iter()
        .find(|group| group.name() == violation.group);
    let excess = match group {
        Some(Group::Ee | Group::Link) => excess_text(1e3 * violation.worst, 1, "mm"),
        Some(Group::JointPos) => excess_text(violation.worst, 4, "rad"),
        Some(Group::JointVel) => excess_text(violation.worst, 3, "rad/s"),
        None => format!("up to {:.3}", violation.worst),
    };
    let joint = match violation.joint {
        Some(joint) => format!(" of joint {joint}"),
        None => String::new(),
    };
    format!(
        "{}{joint}: by {excess}, from step {}, for {} {}",
        competition.violation_title(violation.group),
        violation.from,
        violation.samples,
        if violation.samples == 1 {
            "step"
        } else {
            "steps"
        }
    )
}

/// The largest excess; small values are never shown as zero.
fn excess_text(worst: f64, decimals: usize, unit: &str) -> String {
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
    fn small_excess_is_not_shown_as_zero() {
        assert_eq!(excess_text(0.0004, 3, "rad/s"), "less than 0.001 rad/s");
        assert_eq!(excess_text(0.0006, 3, "rad/s"), "up to 0.001 rad/s");
        assert_eq!(excess_text(12.34, 1, "mm"), "up to 12.3 mm");
    }
}
