//! The index of the episodes in a pack of clips (a clip is the recording of an episode for replays): a summary of each episode
//! with its start, its end and its violations.

use crate::error::ReplayError;
use faceoff_types::{EpisodeEnd, Task, TaskMap, ViolationName};
use flate2::{Compression, read::GzDecoder, write::GzEncoder};
use serde::{Deserialize, Serialize};
use std::{
    collections::HashSet,
    io::{self, Read},
};

/// Name and version of the index's layout.
const INDEX_FORMAT: &str = "faceoff-sheet/1";
/// The public description of the end of an episode that a fault of the agent ended; the details are the team's.
const AGENT_FAULT_TEXT: &str = "a fault of the agent ended the episode";
/// Maximum uncompressed size of an index.
const MAX_BYTES: u64 = 256 << 20;

/// A summary of each episode, in the order of tasks and episodes, and histograms of computation times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClipIndex {
    format: String,
    pub episodes: Vec<EpisodeIndexEntry>,
    /// Histogram of computation times of all answered steps, by task.
    pub times: TaskMap<TimeBins>,
}

impl Default for ClipIndex {
    fn default() -> Self {
        Self {
            format: INDEX_FORMAT.to_owned(),
            episodes: Vec::new(),
            times: TaskMap::new(),
        }
    }
}

/// The entry of an episode: its start, its end and its violations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[cfg_attr(feature = "openapi", schema(as = EpisodeLine))]
pub struct EpisodeIndexEntry {
    /// The task.
    pub task: Task,
    /// Index of the episode within the evaluation.
    pub episode: u32,
    /// Control steps played.
    pub steps: u32,
    /// Was the episode a success?
    pub success: bool,
    /// How the episode ended.
    pub end: EpisodeEnd,
    /// Description of the end.
    #[serde(rename = "why")]
    pub end_description: String,
    /// True position and velocity of the puck at the start: x, y (m), vx, vy (m/s), table frame. Absent in other worlds than air
    /// hockey, whose episodes have no clips.
    #[serde(default, rename = "start", skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(nullable = false))]
    pub puck_at_start: Option<[f64; 4]>,
    /// True position and velocity of the puck at the end: x, y (m), vx, vy (m/s), table frame.
    #[serde(default, rename = "last", skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(nullable = false))]
    pub puck_at_end: Option<[f64; 4]>,
    /// Violations, one entry per kind.
    #[serde(default, rename = "broken", skip_serializing_if = "Vec::is_empty")]
    pub violations: Vec<ViolationSummary>,
    /// Longest computation time, s; only visible to those with access to the dataset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longest_s: Option<f64>,
    /// Number of answers that took longer than a control step; only visible to those with access to the dataset.
    #[serde(default, rename = "late", skip_serializing_if = "is_zero")]
    pub late_answers: u32,
}

impl EpisodeIndexEntry {
    /// Has the episode clips, so that it can be replayed?
    #[must_use]
    pub const fn has_clips(&self) -> bool {
        self.puck_at_start.is_some()
    }

    /// Removes what only those with access to the dataset may see: details of faults, and computation times.
    pub fn make_public(&mut self) {
        if self.end == EpisodeEnd::AGENT_FAULT {
            self.end_description = AGENT_FAULT_TEXT.to_owned();
        }
        self.longest_s = None;
        self.late_answers = 0;
    }
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks for a reference"
)]
const fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// The violations of one kind in an episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ViolationSummary {
    /// The kind of violation.
    #[serde(rename = "group")]
    pub constraint: ViolationName,
    /// The first sample with a violation. Sample k is the state after k control steps.
    pub from: u32,
    /// Number of samples with a violation.
    pub samples: u32,
    /// Largest excess over the limit, such as rad, rad/s or m.
    #[serde(rename = "worst")]
    pub max_excess: f64,
    /// Position of the end effector at the first sample: x, y (m), table frame; in air hockey.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(nullable = false))]
    pub at: Option<[f64; 2]>,
    /// For joint positions and velocities: the joint that exceeded its limit most at the first sample, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<u32>,
}

impl ViolationSummary {
    /// The first sample with a violation; where it happened is not known.
    #[must_use]
    pub const fn begin(constraint: ViolationName, from: u32, max_excess: f64) -> Self {
        Self {
            constraint,
            from,
            samples: 1,
            max_excess,
            at: None,
            joint: None,
        }
    }
}

/// A histogram of computation times, with ten bins per power of ten.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TimeBins(Vec<u64>);

/// Lower edge of the first bin, s; shorter times are also in it.
const FIRST_BIN_S: f64 = 1e-5;

impl TimeBins {
    pub fn add(&mut self, time_s: f64) {
        let tenths = 10.0 * (time_s / FIRST_BIN_S).log10();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to 0 … 99 before"
        )]
        let bin = tenths.floor().clamp(0.0, 99.0) as usize;
        if self.0.len() <= bin {
            self.0.resize(bin + 1, 0);
        }
        self.0[bin] += 1;
    }

    /// The bins from the shortest time on: lower and upper edge (s), and the number of steps.
    pub fn bins(&self) -> impl Iterator<Item = (f64, f64, u64)> + '_ {
        let edge = |bin: usize| {
            let tenths = u32::try_from(bin).map_or(0.0, f64::from);
            FIRST_BIN_S * 10_f64.powf(tenths / 10.0)
        };
        let counted = self.0.iter().enumerate();
        counted.map(move |(bin, count)| (edge(bin), edge(bin + 1), *count))
    }

    fn merge(&mut self, other: &Self) {
        if self.0.len() < other.0.len() {
            self.0.resize(other.0.len(), 0);
        }
        for (count, other_count) in self.0.iter_mut().zip(&other.0) {
            *count += other_count;
        }
    }
}

impl ClipIndex {
    /// The summary of an episode; `None` if the index has no such episode.
    #[must_use]
    pub fn summary(&self, task: Task, episode: u32) -> Option<&EpisodeIndexEntry> {
        let mut summaries = &self.episodes[..];
        // The summaries of a task follow each other.
        while let Some(first) = summaries.first() {
            let (of_task, others) =
                summaries.split_at(summaries.partition_point(|summary| summary.task == first.task));
            if first.task == task {
                let found = of_task.binary_search_by_key(&episode, |summary| summary.episode);
                return found.ok().map(|index| &of_task[index]);
            }
            summaries = others;
        }
        None
    }

    /// The episodes in both indices that ended differently.
    #[must_use]
    pub fn differing_ends(&self, other: &Self) -> HashSet<(Task, u32)> {
        let differing = self.episodes.iter().filter_map(|summary| {
            let other_summary = other.summary(summary.task, summary.episode)?;
            let is_same =
                (summary.success, summary.end) == (other_summary.success, other_summary.end);
            (!is_same).then_some((summary.task, summary.episode))
        });
        differing.collect()
    }

    /// Adds the summaries of another shard (a range of episodes of one task). A task that is new follows the others.
    pub(crate) fn merge(&mut self, other: Self) {
        self.episodes.extend(other.episodes);
        let mut order = TaskMap::new();
        for summary in &self.episodes {
            let next = order.len();
            order.entry(summary.task).or_insert(next);
        }
        self.episodes
            .sort_by_key(|summary| (order.get(&summary.task).copied(), summary.episode));
        for (task, times) in &other.times {
            self.times.entry(*task).or_default().merge(times);
        }
    }

    pub(crate) fn compressed(&self) -> Result<Vec<u8>, ReplayError> {
        let mut gzip = GzEncoder::new(Vec::new(), Compression::new(6));
        serde_json::to_writer(&mut gzip, self).map_err(io::Error::other)?;
        Ok(gzip.finish()?)
    }

    pub(crate) fn read(compressed: &[u8]) -> Result<Self, ReplayError> {
        let mut bytes = Vec::new();
        GzDecoder::new(compressed)
            .take(MAX_BYTES)
            .read_to_end(&mut bytes)
            .map_err(|error| ReplayError::unreadable("the index of episodes", error))?;
        let index: Self = serde_json::from_slice(&bytes)
            .map_err(|error| ReplayError::unreadable("the index of episodes", error))?;
        if index.format == INDEX_FORMAT {
            Ok(index)
        } else {
            Err(ReplayError::unreadable(
                "the index of episodes",
                format!("its format is {:?}", index.format),
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_counted_in_their_bins() {
        let mut times = TimeBins::default();
        for time_s in [0.0, 1e-6, 0.0009, 0.021, 1e9] {
            times.add(time_s);
        }
        let filled: Vec<(f64, f64, u64)> =
            times.bins().filter(|(_, _, count)| *count > 0).collect();
        assert_eq!(filled[0].2, 2, "shorter times are in the first bin");
        for ((from, to, _), time_s) in filled[1..3].iter().zip([0.0009, 0.021]) {
            assert!(*from <= time_s && time_s < *to, "{from} … {to}");
        }
        assert_eq!(times.bins().map(|(_, _, count)| count).sum::<u64>(), 5);
    }
}
