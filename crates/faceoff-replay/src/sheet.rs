//! A line for each episode of an evaluation.

use crate::{error::ReplayError, group::Group};
use faceoff_episode::why_it_ended;
use faceoff_types::{EpisodeEnd, Task};
use flate2::{Compression, read::GzDecoder, write::GzEncoder};
use serde::{Deserialize, Serialize};
use std::{
    collections::{BTreeMap, BTreeSet},
    io::{self, Read},
};

const SHEET_FORMAT: &str = "faceoff-sheet/1";
const MAX_BYTES: u64 = 256 << 20;

/// What is told of each episode without its samples, in order of task and episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sheet {
    format: String,
    pub episodes: Vec<EpisodeLine>,
    /// Computation times of all answered steps.
    pub times: BTreeMap<Task, TimeBins>,
}

impl Default for Sheet {
    fn default() -> Self {
        Self {
            format: SHEET_FORMAT.to_owned(),
            episodes: Vec::new(),
            times: BTreeMap::new(),
        }
    }
}

/// An episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct EpisodeLine {
    /// The task.
    pub task: Task,
    /// Index within the evaluation.
    pub episode: u32,
    /// Control steps played.
    pub steps: u32,
    /// Did it count?
    pub success: bool,
    /// How it ended.
    pub end: EpisodeEnd,
    /// Why, in words.
    pub why: String,
    /// The puck's true place and velocity at the start: x, y (m), vx, vy (m/s), table frame.
    pub start: [f64; 4],
    /// The same at the end.
    pub last: [f64; 4],
    /// The constraints that were broken, each group once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub broken: Vec<Broken>,
    /// The longest computation time, s; for whoever gets the dataset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longest_s: Option<f64>,
    /// Answers that took more than a control step, if any did; for whoever gets the dataset.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub late: u32,
}

impl EpisodeLine {
    /// Leaves what everybody may know: what exactly an agent did wrong, and how long it took, are for whoever gets the dataset.
    pub fn make_public(&mut self) {
        if self.end == EpisodeEnd::AgentFault {
            self.why = why_it_ended(self.task, self.end, &[0.0; 6], self.steps, None);
        }
        self.longest_s = None;
        self.late = 0;
    }
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks for a reference"
)]
const fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// A group of constraints that an episode broke.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Broken {
    /// Which.
    pub group: Group,
    /// The first sample at which it was: the state after so many control steps.
    pub from: u32,
    /// At how many samples.
    pub samples: u32,
    /// By how much at most: rad, rad/s or m.
    pub worst: f64,
    /// Where the end effector was at the first: x, y (m), table frame.
    pub at: [f64; 2],
    /// The joint that was farthest beyond its limit at the first, from 1; of joint positions and velocities.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<u32>,
}

/// How many steps took how long: ten bins to a power of ten.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TimeBins(Vec<u64>);

/// Where the first bin begins, s; what is shorter is in it.
const FIRST_BIN_S: f64 = 1e-5;

impl TimeBins {
    pub fn add(&mut self, time_s: f64) {
        let tenths = 10.0 * (time_s / FIRST_BIN_S).log10();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "cut to 0 … 99 before"
        )]
        let bin = tenths.floor().clamp(0.0, 99.0) as usize;
        if self.0.len() <= bin {
            self.0.resize(bin + 1, 0);
        }
        self.0[bin] += 1;
    }

    /// The bins from the shortest time on: from and to, s, and how many steps are in it.
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
        for (own, others) in self.0.iter_mut().zip(&other.0) {
            *own += others;
        }
    }
}

impl Sheet {
    #[must_use]
    pub fn line(&self, task: Task, episode: u32) -> Option<&EpisodeLine> {
        let found = self
            .episodes
            .binary_search_by_key(&(task, episode), |line| (line.task, line.episode));
        found.ok().map(|index| &self.episodes[index])
    }

    /// The episodes of both that another evaluation of the same ones ended otherwise.
    #[must_use]
    pub fn ended_otherwise(&self, other: &Self) -> BTreeSet<(Task, u32)> {
        let of_both = self.episodes.iter().filter_map(|line| {
            let others = other.line(line.task, line.episode)?;
            let is_same = (line.success, line.end) == (others.success, others.end);
            (!is_same).then_some((line.task, line.episode))
        });
        of_both.collect()
    }

    /// Adds another shard's lines.
    pub(crate) fn merge(&mut self, other: Self) {
        self.episodes.extend(other.episodes);
        self.episodes.sort_by_key(|line| (line.task, line.episode));
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
            .map_err(|error| ReplayError::unreadable("the sheet of episodes", error))?;
        let sheet: Self = serde_json::from_slice(&bytes)
            .map_err(|error| ReplayError::unreadable("the sheet of episodes", error))?;
        if sheet.format == SHEET_FORMAT {
            Ok(sheet)
        } else {
            Err(ReplayError::unreadable(
                "the sheet of episodes",
                format!("its format is {:?}", sheet.format),
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_counted_where_they_belong() {
        let mut times = TimeBins::default();
        for time_s in [0.0, 1e-6, 0.0009, 0.021, 1e9] {
            times.add(time_s);
        }
        let filled: Vec<(f64, f64, u64)> =
            times.bins().filter(|(_, _, count)| *count > 0).collect();
        assert_eq!(filled[0].2, 2, "what is shorter is in the first");
        for ((from, to, _), time_s) in filled[1..3].iter().zip([0.0009, 0.021]) {
            assert!(*from <= time_s && time_s < *to, "{from} … {to}");
        }
        assert_eq!(times.bins().map(|(_, _, count)| count).sum::<u64>(), 5);
    }
}
