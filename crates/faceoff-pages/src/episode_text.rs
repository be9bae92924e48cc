//! Outcomes and violations of episodes as text. A *violation* is a control step or more in which the robot exceeds a safety limit.

use faceoff_replay::{
    Constraint, Contact, ContactWith, EpisodeIndexEntry, OWN_GOAL, PUCK_TOO_FAST, SLOW_GOAL,
    ViolationSummary,
    model::{PUCK, TABLE},
};
use faceoff_types::{Competition, EpisodeEnd};

pub(super) const fn constraint_label(constraint: Constraint) -> &'static str {
    match constraint {
        Constraint::Ee => "end effector",
        Constraint::Link => "elbow, wrist",
        Constraint::JointPos => "joint position",
        Constraint::JointVel => "joint velocity",
    }
}

/// A violation with its size and duration.
pub(super) fn describe_violation(
    competition: &Competition,
    violation: &ViolationSummary,
) -> String {
    let constraint = Constraint::ALL
        .into_iter()
        .find(|constraint| constraint.name() == violation.constraint);
    let excess = match constraint {
        Some(Constraint::Ee | Constraint::Link) => excess_text(1e3 * violation.max_excess, 1, "mm"),
        Some(Constraint::JointPos) => excess_text(violation.max_excess, 4, "rad"),
        Some(Constraint::JointVel) => excess_text(violation.max_excess, 3, "rad/s"),
        None => format!("up to {:.3}", violation.max_excess),
    };
    let joint = match violation.joint {
        Some(joint) => format!(" of joint {joint}"),
        None => String::new(),
    };
    format!(
        "{}{joint}: by {excess}, from step {}, for {} {}",
        competition.violation_title(violation.constraint),
        violation.from,
        violation.samples,
        if violation.samples == 1 {
            "step"
        } else {
            "steps"
        }
    )
}

/// Why an episode ended, as a plain sentence without numbers. The recorded description has the numbers.
pub(super) fn plain_end(summary: &EpisodeIndexEntry, contacts: &[Contact]) -> String {
    let task = summary.task.to_string();
    let end = summary.end.to_string();
    if summary.end == EpisodeEnd::AGENT_FAULT {
        return "A fault of the agent ended the episode.".to_owned();
    }
    let text = match (task.as_str(), end.as_str(), summary.success) {
        ("hit", _, true) => "Goal: the puck went into the opponent’s goal.",
        ("hit", "left_table", false) if summary.end_description.starts_with(SLOW_GOAL) => {
            "No goal: the puck went in, but too slowly."
        }
        ("hit", "crossed_middle", false) => return missed_shot_text(contacts),
        ("hit", "horizon", false) => "No goal before the time was up.",
        ("defend", _, true) => "Stopped: at the end the puck was where the agent can play it.",
        ("defend", "crossed_middle", false) => {
            "Not stopped: the puck was sent back across the middle."
        }
        ("defend", "stopped", false) => "The puck stopped, but in the wrong place.",
        ("defend", "horizon", false) => "Not stopped before the time was up.",
        ("prepare", _, true) => "Prepared: the puck is in a good hitting position.",
        ("prepare", "crossed_middle", false) => "Lost: the puck crossed the middle line.",
        ("prepare", "reached_axis", false) => {
            "The puck reached the middle of the table, but not where it can be hit well."
        }
        ("prepare", "horizon", false) => {
            "The puck was not in a good hitting position when the time was up."
        }
        (_, "left_table", false) if summary.end_description.starts_with(OWN_GOAL) => {
            "Own goal: the puck went into the agent’s goal."
        }
        (_, "left_table", false) if summary.end_description.starts_with(PUCK_TOO_FAST) => {
            "Lost: the puck was too fast for the simulation."
        }
        (_, "left_table", false) => "Lost: the puck left the table.",
        (_, _, true) => "Success.",
        (_, _, false) => "No success.",
    };
    text.to_owned()
}

/// Why a shot came back, from what the puck hit last in the opponent's half.
fn missed_shot_text(contacts: &[Contact]) -> String {
    let last = contacts.iter().rfind(|contact| contact.x > 0.0);
    let cause = match last.map(|contact| (contact.body, contact.x)) {
        Some((ContactWith::OpponentMallet, _)) => "the opponent returned it",
        // The puck's centre stays one radius from the rim.
        Some((ContactWith::Rim, x)) if x > TABLE.half_length_m() - 2.0 * PUCK.radius_m => {
            "it hit the rim beside the goal and came back"
        }
        Some((ContactWith::Rim, _)) => "it hit the long side of the table and came back",
        Some((ContactWith::Mallet, _)) | None => "it came back",
    };
    format!("Missed: {cause}.")
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
    /// The plain reason of an episode that did not succeed.
    fn failure(task: &str, end: &str, contacts: &[Contact]) -> String {
        let summary = serde_json::json!({
            "task": task, "episode": 0, "steps": 90, "success": false, "end": end, "why": "puck at x = 0.31 m",
        });
        plain_end(&serde_json::from_value(summary).unwrap(), contacts)
    }

    #[test]
    fn missed_shot_names_what_it_hit_last() {
        let hit = |body, x| Contact {
            t: 1.0,
            body,
            x,
            y: 0.2,
        };
        let shot = hit(ContactWith::Mallet, -0.4);
        let end = "crossed_middle";
        assert_eq!(
            failure("hit", end, &[shot, hit(ContactWith::Rim, 0.94)]),
            "Missed: it hit the rim beside the goal and came back."
        );
        assert_eq!(
            failure("hit", end, &[shot, hit(ContactWith::Rim, 0.4)]),
            "Missed: it hit the long side of the table and came back."
        );
        assert_eq!(
            failure("hit", end, &[shot, hit(ContactWith::OpponentMallet, 0.6)]),
            "Missed: the opponent returned it."
        );
        assert_eq!(failure("hit", end, &[shot]), "Missed: it came back.");
    }

    #[test]
    fn plain_reason_has_no_numbers() {
        for (task, end) in [
            ("hit", "horizon"),
            ("defend", "stopped"),
            ("prepare", "left_table"),
        ] {
            let text = failure(task, end, &[]);
            assert!(!text.contains(|c: char| c.is_ascii_digit()), "{text}");
        }
    }
}
