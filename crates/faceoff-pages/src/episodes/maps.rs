//! Where episodes began, and where limits were broken.

use crate::{
    broken_places::Places,
    figures,
    table_drawing::{self, Place},
};
use faceoff_replay::{EpisodeLine, Group};
use faceoff_types::Task;

/// Where the puck was at the start of a task's episodes: solved ones as dots, others as crosses.
pub(super) struct OutcomeMap {
    pub(super) task: Task,
    pub(super) solved: String,
    pub(super) failed: String,
    pub(super) solved_count: usize,
    pub(super) failed_count: usize,
    /// The same in numbers, by where across the table the puck began and how fast it was.
    pub(super) tables: Vec<ShareTable>,
}

/// Shares by a value of the start.
pub(super) struct ShareTable {
    pub(super) id: String,
    pub(super) caption: &'static str,
    pub(super) of: &'static str,
    pub(super) shares: Vec<Share>,
}

/// How many of some episodes were solved.
pub(super) struct Share {
    pub(super) of: String,
    pub(super) solved: usize,
    pub(super) all: usize,
    pub(super) percent: String,
}

impl OutcomeMap {
    pub(super) fn of(task: Task, lines: &[&EpisodeLine]) -> Option<Self> {
        let lines: Vec<&EpisodeLine> = lines
            .iter()
            .copied()
            .filter(|line| line.task == task)
            .collect();
        if lines.is_empty() {
            return None;
        }
        let starts = |success: bool| -> Vec<Place> {
            let those = lines.iter().filter(|line| line.success == success);
            those.map(|line| [line.start[0], line.start[1]]).collect()
        };
        let (solved, failed) = (starts(true), starts(false));
        Some(Self {
            task,
            solved: table_drawing::dots(&solved),
            failed: table_drawing::crosses(&failed),
            solved_count: solved.len(),
            failed_count: failed.len(),
            tables: [
                ShareTable {
                    id: format!("across-{task}"),
                    caption: "Solved, by where across the table the puck began.",
                    of: "y",
                    shares: shares(&lines, |line| line.start[1], "m", 0.2),
                },
                ShareTable {
                    id: format!("speed-{task}"),
                    caption: "Solved, by the puck's speed at the start.",
                    of: "Speed",
                    shares: shares(&lines, speed, "m/s", 0.5),
                },
            ]
            .into_iter()
            .filter(|table| !table.shares.is_empty())
            .collect(),
        })
    }
}

/// m/s. (Not `hypot`, which is not the same function of the C library everywhere.)
fn speed(line: &EpisodeLine) -> f64 {
    let [_, _, vx, vy] = line.start;
    (vx * vx + vy * vy).sqrt()
}

/// By classes of a value, each `width` wide, that hold any episode. One class tells nothing: none then.
fn shares(
    lines: &[&EpisodeLine],
    value: impl Fn(&EpisodeLine) -> f64,
    unit: &str,
    width: f64,
) -> Vec<Share> {
    let class = |line: &EpisodeLine| (value(line) / width).floor();
    let mut classes: Vec<f64> = lines.iter().map(|line| class(line)).collect();
    classes.sort_by(f64::total_cmp);
    classes.dedup();
    if classes.len() < 2 {
        return Vec::new();
    }
    classes
        .into_iter()
        .map(|from| {
            let inside: Vec<_> = lines
                .iter()
                .filter(|line| class(line).total_cmp(&from).is_eq())
                .collect();
            let solved = inside.iter().filter(|line| line.success).count();
            Share {
                of: format!(
                    "{} … {} {unit}",
                    figures::signed(from * width).trim_start_matches('+'),
                    figures::signed((from + 1.0) * width).trim_start_matches('+'),
                ),
                solved,
                all: inside.len(),
                percent: figures::percent(solved, inside.len()),
            }
        })
        .collect()
}

/// Where on the table and at which joint limits were broken first in an episode.
pub(super) struct SafetyMap {
    pub(super) places: Vec<Places>,
    pub(super) joints: Vec<Joint>,
    pub(super) episodes: usize,
}

/// How many episodes broke a joint's limits first at that joint.
pub(super) struct Joint {
    pub(super) joint: u32,
    pub(super) position: usize,
    pub(super) velocity: usize,
}

impl SafetyMap {
    pub(super) fn of(lines: &[&EpisodeLine]) -> Self {
        let broken = || lines.iter().flat_map(|line| &line.broken);
        let places = Places::by_group(|group| {
            let those = broken().filter(|one| one.group == group);
            those.map(|one| one.at).collect()
        });
        let count = |group, joint| {
            let those = broken().filter(|one| one.group == group && one.joint == Some(joint));
            those.count()
        };
        let joints = (1..=7)
            .map(|joint| Joint {
                joint,
                position: count(Group::JointPos, joint),
                velocity: count(Group::JointVel, joint),
            })
            .filter(|joint| joint.position + joint.velocity > 0)
            .collect();
        Self {
            places,
            joints,
            episodes: lines.iter().filter(|line| !line.broken.is_empty()).count(),
        }
    }
}
