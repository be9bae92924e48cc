use super::{archive::played_as, files::OUTCOME_FILE, recording::GameRecording, replay::Replay};
use crate::{
    error::DatasetError,
    files::RESULTS_FILE,
    score::json_file,
    simulator::simulator_id,
    verify::{VerifyError, compare},
};
use faceoff_scoring::tournament::{GameScore, score_game};
use faceoff_types::Ruleset;

/// What was found to be identical.
#[derive(Debug, Clone, PartialEq)]
pub struct VerifiedGame {
    pub rallies: u32,
    /// Control steps simulated again.
    pub steps: u32,
    /// The score, computed again.
    pub score: GameScore,
}

/// Simulates a game again from its seed and recorded answers, late ones and faults included, and compares
/// every recorded number bit for bit; then scores it again. Times, faults' words and logs cannot be simulated;
/// what follows from them is computed again. `progress` is told of control steps as they are played.
///
/// # Errors
/// [`VerifyError::Differs`] with the first difference in order of play; else why nothing could be compared.
pub fn verify_game(
    recording: &GameRecording,
    progress: &dyn Fn(u64),
) -> Result<VerifiedGame, VerifyError> {
    made_here(recording)?;
    let played = Replay::open(recording)?.play(progress)?;
    let manifest = recording.manifest();
    let score = score_game(
        &played_as(&manifest.spec, &manifest.agents),
        &played.outcome,
        &played.answer_times_s,
    );
    for (name, expected) in [
        (OUTCOME_FILE, json_file(&played.outcome)),
        (RESULTS_FILE, json_file(&score)),
    ] {
        let expected = expected.map_err(DatasetError::unreadable(name))?;
        if let Some(difference) = compare::json(name, &recording.bytes(name)?, &expected) {
            return Err(difference.into());
        }
    }
    Ok(VerifiedGame {
        rallies: played.outcome.rallies,
        steps: played.outcome.steps,
        score,
    })
}

/// Only the same rules and the same simulator can make the states again, and only magnitudes that a world can
/// have.
fn made_here(recording: &GameRecording) -> Result<(), DatasetError> {
    let (manifest, here) = (recording.manifest(), simulator_id());
    let ruleset = manifest.spec.ruleset;
    if !ruleset.has_games() {
        let with_games = Ruleset::ALL.into_iter().filter(|one| one.has_games());
        let names: Vec<_> = with_games.map(Ruleset::as_str).collect();
        return Err(DatasetError::Foreign(format!(
            "the game says {ruleset}; games are played by {} alone",
            names.join(" and ")
        )));
    }
    manifest
        .spec
        .perturbations
        .check()
        .map_err(|error| DatasetError::Foreign(format!("perturbations.{error}")))?;
    if &manifest.simulator != here {
        return Err(DatasetError::Foreign(format!(
            "the game was simulated by version {} (fingerprint {}), this is version {} (fingerprint {}): \
             verify it with the version that made it",
            manifest.simulator.version,
            manifest.simulator.fingerprint,
            here.version,
            here.fingerprint
        )));
    }
    Ok(())
}
