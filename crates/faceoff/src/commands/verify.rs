//! `faceoff verify`: verifies that a dataset (the recording of an evaluation) or a recorded game reproduces its score. All seeds
//! of a season are derived from its *secret*, whose hash, the *commitment*, is published before the season.

mod failure;
mod game;
mod hash_text;

use crate::competition::{competition, simulator};
use crate::exit::Exit;
use anyhow::Context;
use clap::Args;
use faceoff_dataset::{
    Dataset,
    game::GameRecording,
    verify::{Difference, SeasonClaim, VerifiedDataset, VerifyError, verify},
};
use faceoff_types::{EvaluationResult, Seed, StageId};
use failure::{Failure, check_hash};
use game::SimulatedGame;
use hash_text::hash_text;
use indicatif::{ProgressBar, ProgressStyle};
use jiff::civil::Date;
use serde::Serialize;
use std::{
    num::NonZero,
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant},
};

/// Simulates a dataset or a game again from its seeds and recorded actions, and compares every state,
/// observation, constraint value and score bit for bit. Exit status 0: identical; 1: a difference;
/// 2: the dataset cannot be read or not be simulated by this version.
#[derive(Debug, Args)]
pub struct VerifyCommand {
    /// dataset.zip or game.zip, the folder it was unpacked to, or the output folder of `faceoff eval` or
    /// `faceoff play`
    dataset: PathBuf,
    /// Number of threads, without influence on the result [default: one per CPU]
    #[arg(long, value_name = "N")]
    workers: Option<NonZero<usize>>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    /// The season's published secret, 64 hexadecimal digits: also check that the seeds are derived from it
    #[arg(long, value_name = "HEX", requires = "day")]
    secret: Option<Seed>,
    /// The id of the evaluation's stage, unless the seeds of the stage do not depend on its id
    #[arg(long, value_name = "ID", requires = "secret")]
    stage: Option<StageId>,
    /// The date of the evaluation day
    #[arg(long, value_name = "YYYY-MM-DD", requires = "secret")]
    day: Option<Date>,
    /// The commitment published before the season: also check that it is the hash of the secret
    #[arg(long, value_name = "HEX", requires = "secret")]
    commitment: Option<String>,
    /// The published hash of the archive: also check that the file has it
    #[arg(long, value_name = "HEX")]
    blake3: Option<blake3::Hash>,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct Summary {
    verified: bool,
    /// The first difference.
    #[serde(skip_serializing_if = "Option::is_none")]
    difference: Option<Difference>,
    /// Reason why the dataset is not verified.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    #[serde(flatten)]
    simulated: Option<VerifiedRecording>,
}

/// The verified recording.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum VerifiedRecording {
    Evaluation(Box<SimulatedEvaluation>),
    Game(Box<SimulatedGame>),
}

#[derive(Debug, Serialize)]
struct SimulatedEvaluation {
    episodes: u32,
    steps: u64,
    seconds: f64,
    steps_per_s: f64,
    /// The seeds were checked against the season's secret.
    season: bool,
    /// The archive's hash; `null` for an unpacked folder.
    blake3: Option<String>,
    result: EvaluationResult,
}

impl VerifyCommand {
    /// Verifies the recording, prints the result and returns the exit status.
    #[must_use]
    pub fn run(self) -> Exit {
        let outcome = self.verify_recording();
        let (summary, exit) = match outcome {
            Ok(simulated) => {
                if !self.json {
                    let text = match &simulated {
                        VerifiedRecording::Evaluation(evaluation) => {
                            describe(&self.dataset, evaluation)
                        }
                        VerifiedRecording::Game(game) => game::describe(&self.dataset, game),
                    };
                    println!("{text}");
                }
                let summary = Summary {
                    verified: true,
                    difference: None,
                    error: None,
                    simulated: Some(simulated),
                };
                (summary, Exit::Done)
            }
            Err(failure) => {
                eprintln!("error: {}: {failure}", self.dataset.display());
                let exit = failure.exit();
                let summary = Summary {
                    verified: false,
                    error: Some(failure.to_string()),
                    difference: match failure {
                        Failure::Verify(VerifyError::Differs(difference)) => Some(*difference),
                        _ => None,
                    },
                    simulated: None,
                };
                (summary, exit)
            }
        };
        if self.json {
            match serde_json::to_string(&summary) {
                Ok(line) => println!("{line}"),
                Err(error) => {
                    eprintln!("error: writing the summary: {error}");
                    return Exit::Failed;
                }
            }
        }
        exit
    }

    fn verify_recording(&self) -> Result<VerifiedRecording, Failure> {
        if !GameRecording::is_at(&self.dataset)? {
            return Ok(VerifiedRecording::Evaluation(Box::new(
                self.verify_dataset()?,
            )));
        }
        game::refuse_secret(self.secret.is_some())?;
        let simulated = game::verify(&self.dataset, self.blake3.as_ref())?;
        Ok(VerifiedRecording::Game(Box::new(simulated)))
    }

    fn verify_dataset(&self) -> Result<SimulatedEvaluation, Failure> {
        let dataset = Dataset::open(&self.dataset, competition())?;
        let archive_hash = dataset.archive()?.map(|digest| digest.blake3);
        check_hash(self.blake3.as_ref(), archive_hash.as_deref())?;
        // The claim that the dataset's seeds are derived from this secret for this day.
        let claim = self.secret.zip(self.day).map(|(secret, day)| SeasonClaim {
            secret,
            commitment: self.commitment.clone(),
            stage: self.stage,
            day,
        });
        if let Some(claim) = &claim {
            claim.check(dataset.manifest()).map_err(|error| {
                if claim.stage.is_some() {
                    return Failure::from(error);
                }
                Failure::Season {
                    error,
                    hint: "; if the seeds depend on the id of the stage (see the page /season), also give --stage",
                }
            })?;
        }
        let workers = match self.workers {
            Some(workers) => workers,
            None => thread::available_parallelism()
                .context("reading the number of CPUs; use --workers")
                .map_err(Failure::Local)?,
        };
        let (verified, time) = verify_with_progress(&dataset, workers)?;
        Ok(SimulatedEvaluation {
            episodes: verified.episodes,
            steps: verified.steps,
            seconds: time.as_secs_f64(),
            steps_per_s: verified.steps as f64 / time.as_secs_f64(),
            season: claim.is_some(),
            blake3: archive_hash,
            result: verified.result,
        })
    }
}

/// Verifies a dataset, with a progress bar if standard error is a terminal. Also returns the time that the simulation took.
fn verify_with_progress(
    dataset: &Dataset,
    workers: NonZero<usize>,
) -> Result<(VerifiedDataset, Duration), Failure> {
    let episodes = dataset.manifest().episodes.values();
    let bar = ProgressBar::new(episodes.map(|count| u64::from(*count)).sum()).with_style(
        ProgressStyle::with_template("{bar:40} {pos}/{len} episodes, {per_sec}, {eta} left")
            .context("the progress bar's template")
            .map_err(Failure::Local)?,
    );
    let start = Instant::now();
    let verified = verify(dataset, simulator().as_ref(), workers, &|| bar.inc(1));
    bar.finish_and_clear();
    Ok((verified?, start.elapsed()))
}

/// Verifies a dataset with all CPUs and returns the result as one line.
///
/// # Errors
/// If the dataset cannot be read or differs from the simulation.
pub fn verified_line(path: &Path) -> anyhow::Result<String> {
    let command = VerifyCommand {
        dataset: path.to_owned(),
        workers: None,
        json: false,
        secret: None,
        stage: None,
        day: None,
        commitment: None,
        blake3: None,
    };
    let simulated = command.verify_dataset()?;
    Ok(describe(path, &simulated))
}

fn describe(path: &Path, simulated: &SimulatedEvaluation) -> String {
    let SimulatedEvaluation {
        episodes,
        steps,
        seconds,
        steps_per_s,
        season,
        blake3,
        result,
    } = simulated;
    let hash = hash_text(blake3.as_ref());
    let seeds = if *season {
        "; seeds derived from the season's secret"
    } else {
        ""
    };
    format!(
        "verified {}: {episodes} episodes, {steps} control steps, every state and score identical \
         (score {:.1} %, penalty points {:.1}){seeds}; {seconds:.1} s, {steps_per_s:.0} control \
         steps/s{hash}",
        path.display(),
        result.score,
        result.penalty_points,
    )
}
