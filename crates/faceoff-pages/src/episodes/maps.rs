//! Start positions and violations of episodes on the table.

use crate::{
    episode_text::constraint_label,
    format,
    table_drawing::{self, Dot, Position},
    violation_map::ViolationMarks,
};
use faceoff_replay::{Constraint, EpisodeIndexEntry};
use faceoff_types::Task;

/// Largest number of marks of a map that are links: beyond, they would overlap, and make the page large.
const MAX_LINKS: usize = 300;

const ALL_LINKS: &str = "A click on a mark opens the replay.";
const TOO_MANY_LINKS: &str = "Select fewer episodes to open replays from here.";

/// A link to the replay of an episode, around its mark on a map.
pub(super) struct EpisodeLink {
    /// Address relative to the page.
    pub(super) address: String,
    pub(super) name: String,
    pub(super) dot: Dot,
}

impl EpisodeLink {
    fn new(summary: &EpisodeIndexEntry, position: Position, mark: &str) -> Self {
        let EpisodeIndexEntry { task, episode, .. } = summary;
        Self {
            address: format!("episodes/{task}/{episode}"),
            name: format!("{task} {episode}: {mark}"),
            dot: Dot::at(position),
        }
    }
}

/// Start positions of the puck in the episodes of a task: solved ones as dots, others as crosses.
pub(super) struct StartMap {
    pub(super) task: Task,
    /// SVG path of the dots.
    pub(super) solved: String,
    /// SVG path of the crosses.
    pub(super) failed: String,
    pub(super) solved_count: usize,
    pub(super) failed_count: usize,
    pub(super) links: Vec<EpisodeLink>,
    /// Which marks are links.
    pub(super) note: &'static str,
    /// Success rates by the position across the table and the speed of the puck at the start.
    pub(super) tables: Vec<SuccessTable>,
}

/// Success rates by ranges of a value at the start of an episode.
pub(super) struct SuccessTable {
    pub(super) id: String,
    pub(super) caption: &'static str,
    /// Name of the value, for the head of the first column.
    pub(super) value: &'static str,
    pub(super) rows: Vec<SuccessRow>,
}

/// Solved episodes of a range.
pub(super) struct SuccessRow {
    pub(super) range: String,
    pub(super) solved: usize,
    pub(super) total: usize,
    pub(super) percent: String,
}

impl StartMap {
    pub(super) fn new(task: Task, summaries: &[&EpisodeIndexEntry]) -> Option<Self> {
        let summaries: Vec<&EpisodeIndexEntry> = summaries
            .iter()
            .copied()
            .filter(|summary| summary.task == task && summary.has_clips())
            .collect();
        if summaries.is_empty() {
            return None;
        }
        let start_positions = |success: bool| -> Vec<Position> {
            let episodes = summaries
                .iter()
                .filter(|summary| summary.success == success);
            episodes
                .filter_map(|summary| summary.puck_at_start)
                .map(|[x, y, ..]| [x, y])
                .collect()
        };
        let (solved, failed) = (start_positions(true), start_positions(false));
        // Without a link per mark, failed episodes come first.
        let links_all = solved.len() + failed.len() <= MAX_LINKS;
        let links_failed = failed.len() <= MAX_LINKS;
        let linked = summaries.iter().filter(|summary| match summary.success {
            true => links_all,
            false => links_failed,
        });
        let links = linked.filter_map(|summary| {
            let [x, y, ..] = summary.puck_at_start?;
            let outcome = match summary.success {
                true => "solved",
                false => "not solved",
            };
            Some(EpisodeLink::new(summary, [x, y], outcome))
        });
        Some(Self {
            task,
            solved: table_drawing::dots(&solved),
            failed: table_drawing::crosses(&failed),
            solved_count: solved.len(),
            failed_count: failed.len(),
            links: links.collect(),
            note: match (links_all, links_failed) {
                (true, _) => ALL_LINKS,
                (false, true) => "A click on a cross opens the replay.",
                (false, false) => TOO_MANY_LINKS,
            },
            tables: [
                SuccessTable {
                    id: format!("across-{task}"),
                    caption: "Success by start position across the table",
                    value: "y",
                    rows: success_by(&summaries, |[_, y, ..]| y, "m", 0.2),
                },
                SuccessTable {
                    id: format!("speed-{task}"),
                    caption: "Success by speed of the puck at the start",
                    value: "Speed",
                    rows: success_by(&summaries, speed, "m/s", 0.5),
                },
            ]
            .into_iter()
            .filter(|table| !table.rows.is_empty())
            .collect(),
        })
    }
}

/// Speed of the puck at the start, m/s. `hypot` is avoided: it differs between C libraries.
fn speed([_, _, vx, vy]: [f64; 4]) -> f64 {
    (vx * vx + vy * vy).sqrt()
}

/// Success by ranges of a value, each `width` wide. Empty ranges are omitted; a single range gives no rows.
fn success_by(
    summaries: &[&EpisodeIndexEntry],
    value: impl Fn([f64; 4]) -> f64,
    unit: &str,
    width: f64,
) -> Vec<SuccessRow> {
    let range_index = |summary: &EpisodeIndexEntry| {
        (value(summary.puck_at_start.unwrap_or_default()) / width).floor()
    };
    let mut range_indices: Vec<f64> = summaries
        .iter()
        .map(|summary| range_index(summary))
        .collect();
    range_indices.sort_by(f64::total_cmp);
    range_indices.dedup();
    if range_indices.len() < 2 {
        return Vec::new();
    }
    range_indices
        .into_iter()
        .map(|index| {
            let episodes: Vec<_> = summaries
                .iter()
                .filter(|summary| range_index(summary).total_cmp(&index).is_eq())
                .collect();
            let solved = episodes.iter().filter(|summary| summary.success).count();
            SuccessRow {
                range: format!(
                    "{} … {} {unit}",
                    format::signed(index * width).trim_start_matches('+'),
                    format::signed((index + 1.0) * width).trim_start_matches('+'),
                ),
                solved,
                total: episodes.len(),
                percent: format::percent(solved, episodes.len()),
            }
        })
        .collect()
}

/// First violations of episodes, by position on the table and by joint.
pub(super) struct ViolationMap {
    pub(super) marks: Vec<ViolationMarks>,
    pub(super) links: Vec<EpisodeLink>,
    /// Whether marks are links.
    pub(super) note: &'static str,
    pub(super) joints: Vec<Joint>,
    /// Number of episodes with a violation.
    pub(super) episodes: usize,
}

/// Numbers of episodes whose first violation of a joint limit was at this joint.
pub(super) struct Joint {
    pub(super) joint: u32,
    /// Violations of the position limit.
    pub(super) position: usize,
    /// Violations of the velocity limit.
    pub(super) velocity: usize,
}

impl ViolationMap {
    pub(super) fn new(summaries: &[&EpisodeIndexEntry]) -> Self {
        let violations = || summaries.iter().flat_map(|summary| &summary.violations);
        let marks = ViolationMarks::by_constraint(|constraint| {
            let matching =
                violations().filter(|violation| violation.constraint == constraint.name());
            matching.filter_map(|violation| violation.at).collect()
        });
        let links = summaries.iter().flat_map(|summary| {
            let violations = summary.violations.iter();
            violations.filter_map(|violation| {
                let mut constraints = Constraint::ALL.into_iter();
                let constraint =
                    constraints.find(|constraint| constraint.name() == violation.constraint)?;
                Some(EpisodeLink::new(
                    summary,
                    violation.at?,
                    constraint_label(constraint),
                ))
            })
        });
        let mut links: Vec<_> = links.take(MAX_LINKS + 1).collect();
        let note = match links.len() {
            0..=MAX_LINKS => ALL_LINKS,
            _ => TOO_MANY_LINKS,
        };
        if links.len() > MAX_LINKS {
            links.clear();
        }
        let count = |constraint: Constraint, joint| {
            let matching = violations().filter(|violation| {
                violation.constraint == constraint.name() && violation.joint == Some(joint)
            });
            matching.count()
        };
        let joints = (1..=7)
            .map(|joint| Joint {
                joint,
                position: count(Constraint::JointPos, joint),
                velocity: count(Constraint::JointVel, joint),
            })
            .filter(|joint| joint.position + joint.velocity > 0)
            .collect();
        Self {
            marks,
            links,
            note,
            joints,
            episodes: summaries
                .iter()
                .filter(|summary| !summary.violations.is_empty())
                .count(),
        }
    }
}
