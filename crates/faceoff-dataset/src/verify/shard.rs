//! Verifies the recording of a shard (a range of episodes of one task) from a remote worker before it is accepted.

use super::{
    difference::Difference, episode_reader::EpisodeReader, error::VerifyError, replay::Replayer,
};
use crate::{
    conditions::shard_conditions,
    dataset::Columns,
    error::{DatasetError, RecordingError},
    files::EPISODES_FILE,
    shard_folder::ShardRecording,
};
use arrow_array::RecordBatch;
use faceoff_episode::Simulator;
use faceoff_types::{Competition, EpisodeOutcome};
use faceoff_wire::job::ShardSpec;
use std::path::Path;

/// Reads the recording of a shard in the folder `dir`, and simulates the episodes of `sample` again: all their numbers
/// must equal the simulation, bit for bit. All other episodes must be complete, in order, and end as in `outcomes`.
/// `spec` is the specification of the shard's job.
///
/// Inputs from the agent are trusted: its actions, times and faults. This does not detect a recording with another
/// agent's actions.
///
/// # Errors
/// [`VerifyError::Differs`] with the first difference; [`VerifyError::Recording`] and [`VerifyError::Dataset`] if the recording
/// is damaged, incomplete, or of another job.
pub fn verify_shard(
    dir: &Path,
    spec: &ShardSpec,
    outcomes: &[EpisodeOutcome],
    sample: &[u32],
    simulator: &dyn Simulator,
) -> Result<(), VerifyError> {
    let recording = ShardRecording::open(dir, simulator)?;
    let unusable = |problem: &str| RecordingError::Unusable(problem.to_owned());
    if recording.spec != *spec {
        return Err(unusable("the recording has other episodes than the job").into());
    }
    if recording.report.outcomes != outcomes {
        return Err(unusable("the recording and the report have different outcomes").into());
    }
    let competition = simulator.competition();
    let world_factory = simulator.world_factory(&shard_conditions(spec));
    let world_factory = world_factory.map_err(|invalid| VerifyError::Job(invalid.to_string()))?;
    let ruleset = competition.find_ruleset(spec.ruleset.as_str());
    let ruleset = *ruleset.map_err(|unknown| VerifyError::Job(unknown.to_string()))?;
    let replayer = Replayer::new(ruleset, world_factory, competition);
    let (episodes, steps) = (recording.episodes.path(), recording.steps.path());
    let mut reader = EpisodeReader::open_shard(spec, outcomes.len(), episodes, steps, competition)?;
    for outcome in outcomes {
        if competition.ends.iter().all(|info| info.end != outcome.end) {
            let problem = format!("the report has the unknown end {:?}", outcome.end);
            return Err(unusable(&problem).into());
        }
        if !outcome.violations.has_kinds(competition.world_violations()) {
            return Err(unusable("the report has other kinds of violations").into());
        }
        // One at a time: the steps of a whole shard need not be in memory.
        let batch = reader.next_episodes(1);
        batch.result?;
        let Some(recorded) = batch.episodes.first() else {
            return Err(unusable("the recording lacks an episode").into());
        };
        check_outcome(&recorded.row, outcome, competition)?;
        if sample.contains(&outcome.episode) {
            replayer.episode(recorded)?;
        }
    }
    // No episode may follow.
    reader.next_episodes(1).result
}

/// Compares an episode's row with the reported outcome, without its times, which follow from the steps.
fn check_outcome(
    row: &RecordBatch,
    outcome: &EpisodeOutcome,
    competition: &Competition,
) -> Result<(), VerifyError> {
    let recorded = Columns(row).record(0, competition);
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
