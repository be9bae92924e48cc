//! The summary of an episode in a world other than air hockey, of which there are no clips.

use crate::clip_index::{EpisodeIndexEntry, TimeBins, ViolationSummary};
use faceoff_episode::StepRow;
use faceoff_types::{Competition, EpisodeOutcome, escape_unprintable};

/// An episode of which only the summary is recorded, so far.
#[derive(Debug, Default)]
pub(crate) struct SummaryRecording {
    violations: Vec<ViolationSummary>,
    /// Computation times, s.
    times_s: Vec<f64>,
}

impl SummaryRecording {
    pub fn step(&mut self, row: &StepRow<'_>, competition: &Competition) {
        let sample = row.step + 1;
        let limits = competition
            .recording
            .limits
            .iter()
            .zip(row.world.constraint_values());
        for (name, value) in limits.filter(|(_, value)| **value > 0.0) {
            let known = self
                .violations
                .iter_mut()
                .find(|known| known.constraint == *name);
            if let Some(violation) = known {
                violation.samples += 1;
                violation.max_excess = violation.max_excess.max(*value);
            } else {
                let begun = ViolationSummary::begin(*name, sample, *value);
                self.violations.push(begun);
            }
        }
        self.times_s.push(row.timing.computation_time_s);
    }

    /// The summary for the index. Adds the computation times to `times`.
    pub fn end(
        self,
        outcome: &EpisodeOutcome,
        competition: &Competition,
        times: &mut TimeBins,
    ) -> EpisodeIndexEntry {
        let step_s = competition.duration_s(outcome.task, 1);
        let late = self.times_s.iter().filter(|time_s| **time_s > step_s);
        let late_answers = u32::try_from(late.count()).unwrap_or(u32::MAX);
        self.times_s.iter().for_each(|time_s| times.add(*time_s));
        let end = competition.ends.iter().find(|info| info.end == outcome.end);
        let description = match (&outcome.fault, end) {
            (Some(fault), _) => format!("the agent's fault ended the episode: {}", fault.fault),
            (None, Some(info)) => info.title.clone(),
            (None, None) => outcome.end.to_string(),
        };
        EpisodeIndexEntry {
            task: outcome.task,
            episode: outcome.episode,
            steps: outcome.steps,
            success: outcome.success,
            end: outcome.end,
            end_description: escape_unprintable(&description).into_owned(),
            puck_at_start: None,
            puck_at_end: None,
            violations: self.violations,
            longest_s: Some(self.times_s.iter().copied().fold(0.0, f64::max)),
            late_answers,
        }
    }
}
