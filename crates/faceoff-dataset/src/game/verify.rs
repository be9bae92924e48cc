//! Verification of a game: simulates it again from its recording and compares every number.

use super::{
    archive::game_settings, conditions::simulator_id, files::OUTCOME_FILE,
    recording::GameRecording, replay::GameReplay,
};
use crate::{
    error::DatasetError,
    files::RESULTS_FILE,
    score::json_file,
    verify::{VerifyError, compare},
};
use faceoff_scoring::tournament::{GameScore, score_game};
use faceoff_sim::AirHockeyRuleset;

/// A game that was verified: the simulation gives the same numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct VerifiedGame {
    pub rallies: u32,
    /// Control steps simulated again.
    pub steps: u32,
    /// The recomputed score.
    pub score: GameScore,
}

/// Simulates a game again from its seed and its recorded answers (late ones and faults included), compares every recorded
/// number bit for bit, and then scores the game again. Times, texts of faults and logs cannot be simulated; values that
/// follow from them are recomputed. `progress` receives numbers of simulated control steps.
///
/// # Errors
/// [`VerifyError::Differs`] with the first difference in order of play, or the reason why the game cannot be verified.
pub fn verify_game(
    recording: &GameRecording,
    progress: &dyn Fn(u64),
) -> Result<VerifiedGame, VerifyError> {
    check_reproducible(recording)?;
    let simulated = GameReplay::open(recording)?.play(progress)?;
    let manifest = recording.manifest();
    let score = score_game(
        &game_settings(&manifest.spec, &manifest.agents),
        &simulated.outcome,
        &simulated.answer_times_s,
    );
    for (name, expected) in [
        (OUTCOME_FILE, json_file(&simulated.outcome)),
        (RESULTS_FILE, json_file(&score)),
    ] {
        let expected = expected.map_err(DatasetError::unreadable(name))?;
        if let Some(difference) = compare::json_difference(name, &recording.bytes(name)?, &expected)
        {
            return Err(difference.into());
        }
    }
    Ok(VerifiedGame {
        rallies: simulated.outcome.rallies,
        steps: simulated.outcome.steps,
        score,
    })
}

/// Checks that this version can reproduce the states: same ruleset, same simulator, valid magnitudes.
fn check_reproducible(recording: &GameRecording) -> Result<(), DatasetError> {
    let (manifest, current) = (recording.manifest(), simulator_id());
    let simulator = faceoff_airhockey::simulator();
    let competition = simulator.competition();
    let ruleset = manifest.spec.ruleset;
    competition
        .find_ruleset(ruleset.as_str())
        .map_err(|unknown| DatasetError::Foreign(unknown.to_string()))?;
    if !AirHockeyRuleset::find(ruleset).is_some_and(AirHockeyRuleset::has_games) {
        let with_games = AirHockeyRuleset::ALL
            .into_iter()
            .filter(|ruleset| ruleset.has_games());
        let names: Vec<_> = with_games
            .map(|ruleset| ruleset.name().to_string())
            .collect();
        return Err(DatasetError::Foreign(format!(
            "the game states {ruleset}; only {} have games",
            names.join(" and ")
        )));
    }
    let mut magnitudes = manifest.spec.perturbations.clone();
    competition
        .check_magnitudes(&mut magnitudes)
        .map_err(|error| DatasetError::Foreign(format!("perturbations.{error}")))?;
    if manifest.simulator != current {
        return Err(DatasetError::Foreign(format!(
            "the game was simulated by version {} (fingerprint {}), this is version {} (fingerprint {}): \
             verify it with the version that made it",
            manifest.simulator.version,
            manifest.simulator.fingerprint,
            current.version,
            current.fingerprint
        )));
    }
    Ok(())
}
