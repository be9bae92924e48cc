//! Verifies what a shard has recorded before anything is made of it.

use super::{difference::Difference, error::VerifyError, feed::Feed, replay::Replay};
use crate::{
    dataset::Columns,
    error::{DatasetError, RecordingError},
    files::EPISODES_FILE,
    shard_folder::ShardRecording,
};
use arrow_array::RecordBatch;
use faceoff_episode::Arena;
use faceoff_types::EpisodeOutcome;
use faceoff_wire::job::ShardSpec;
use std::path::Path;

/// Reads the recording of a shard in the folder `dir`, and simulates the episodes of `sample` again: every number of theirs must be what
/// the simulation gives, bit for bit. All others must be there, whole, in order, and end as `outcomes` say. Of the recording, `spec` is what
/// was ordered.
///
/// What only an agent could tell is believed: its actions, times and faults. So a recording that somebody made up of another agent's actions
/// is not found out by this.
///
/// # Errors
/// [`VerifyError::Differs`] with the first difference; [`VerifyError::Recording`] and [`VerifyError::Dataset`] if it is damaged,
/// incomplete, or not of this order.
pub fn verify_shard(
    dir: &Path,
    spec: &ShardSpec,
    outcomes: &[EpisodeOutcome],
    sample: &[u32],
) -> Result<(), VerifyError> {
    let recording = ShardRecording::open(dir)?;
    let unusable = |what: &str| RecordingError::Unusable(what.to_owned());
    if recording.spec != *spec {
        return Err(unusable("the recording is of other episodes than the order").into());
    }
    if recording.report.outcomes != outcomes {
        return Err(unusable("the recording and the report tell of other outcomes").into());
    }
    let arena = Arena::with_ruleset(
        spec.ruleset,
        spec.profile,
        &spec.perturbations,
        spec.seed,
        spec.mismatch_seed,
    );
    let replay = Replay::new(spec.ruleset, arena);
    let (episodes, steps) = (recording.episodes.path(), recording.steps.path());
    let mut feed = Feed::of_shard(spec, outcomes.len(), episodes, steps)?;
    for outcome in outcomes {
        // One at a time: the steps of a whole shard need not be in memory.
        let read = feed.next_episodes(1);
        read.then?;
        let Some(recorded) = read.read.first() else {
            return Err(unusable("the recording lacks an episode").into());
        };
        ended_so(&recorded.row, outcome)?;
        if sample.contains(&outcome.episode) {
            replay.episode(recorded)?;
        }
    }
    // Nothing may follow.
    feed.next_episodes(1).then
}

/// Does an episode's row tell of this outcome? Its times are the steps' to tell.
fn ended_so(row: &RecordBatch, outcome: &EpisodeOutcome) -> Result<(), VerifyError> {
    let recorded = Columns(row).record(0);
    let mut recorded = recorded
        .map_err(DatasetError::unreadable(EPISODES_FILE))?
        .outcome;
    recorded.computation_time = outcome.computation_time;
    if recorded == *outcome {
        return Ok(());
    }
    Err(Difference {
        file: EPISODES_FILE,
        task: Some(outcome.task),
        episode: Some(outcome.episode),
        rally: None,
        step: None,
        field: "outcome".to_owned(),
        recorded: format!("{} after {} steps", recorded.end.as_str(), recorded.steps),
        expected: format!(
            "{} after {} steps, as reported",
            outcome.end.as_str(),
            outcome.steps
        ),
    }
    .into())
}
