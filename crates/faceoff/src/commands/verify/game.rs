//! Verification of games.

use super::{
    failure::{Failure, check_hash},
    hash_text::hash_text,
};
use anyhow::Context;
use faceoff_dataset::{
    DatasetError,
    game::{GameRecording, VerifiedGame, verify_game},
};
use faceoff_scoring::tournament::GameScore;
use faceoff_types::GameLimits;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::{path::Path, time::Instant};

/// Output of `--json` for a game.
#[derive(Debug, Serialize)]
pub(super) struct SimulatedGame {
    rallies: u32,
    steps: u32,
    seconds: f64,
    /// The archive's hash; `null` for an unpacked folder.
    blake3: Option<String>,
    result: GameScore,
}

/// Verifies a game, with a progress bar if standard error is a terminal. `blake3` is the published hash of the
/// archive.
pub(super) fn verify(path: &Path, blake3: Option<&blake3::Hash>) -> Result<SimulatedGame, Failure> {
    let recording = GameRecording::open(path)?;
    let archive_hash = recording.archive()?.map(|digest| digest.blake3);
    check_hash(blake3, archive_hash.as_deref())?;
    let bar = ProgressBar::new(u64::from(recording.manifest().spec.steps)).with_style(
        ProgressStyle::with_template("{bar:40} {pos}/{len} steps, {per_sec}, {eta} left")
            .context("the progress bar's template")
            .map_err(Failure::Local)?,
    );
    let start = Instant::now();
    let verified = verify_game(&recording, &|steps| bar.inc(steps));
    bar.finish_and_clear();
    let VerifiedGame {
        rallies,
        steps,
        score,
    } = verified?;
    Ok(SimulatedGame {
        rallies,
        steps,
        seconds: start.elapsed().as_secs_f64(),
        blake3: archive_hash,
        result: score,
    })
}

pub(super) fn describe(path: &Path, simulated: &SimulatedGame) -> String {
    let SimulatedGame {
        rallies,
        steps,
        seconds,
        blake3,
        result,
    } = simulated;
    let hash = hash_text(blake3.as_ref());
    let [first, second] = &result.sides;
    let limits = if result.limits == GameLimits::default() {
        String::new()
    } else {
        let limits = &result.limits;
        format!(
            "; with custom limits: answers accepted up to {} s, {} faults allowed, {} s in total",
            limits.max_answer_s, limits.max_faults, limits.total_s
        )
    };
    format!(
        "verified {}: a game of {rallies} rallies, {steps} control steps, every state and score identical \
         ({} {} : {} {}, penalty points {:.1} and {:.1}); {seconds:.1} s{hash}{limits}",
        path.display(),
        first.agent,
        first.score,
        second.score,
        second.agent,
        first.penalty_points,
        second.penalty_points,
    )
}

/// Refuses `--secret` for a game, whose seed is not checked against the season's secret.
pub(super) fn refuse_secret(has_secret: bool) -> Result<(), Failure> {
    if has_secret {
        return Err(Failure::from(DatasetError::Foreign(
            "--secret checks the seeds of an evaluation; leave it out for a game".to_owned(),
        )));
    }
    Ok(())
}
