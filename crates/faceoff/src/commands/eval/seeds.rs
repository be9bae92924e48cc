//! Evaluations with several seeds: one run for each, and all of them together.

use super::{
    profile_run::{EvalSetup, ProfileOutcome, run_profile},
    table::result_table,
};
use crate::{commands::output::print, commands::table_cells::percent_interval};
use faceoff_dataset::ARCHIVE_FILE;
use faceoff_scoring::wilson95;
use faceoff_types::{EvaluationResult, ParseSeedError, Profile, Seed, TaskMap};
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    str::FromStr,
};

/// A seed, as it was written.
#[derive(Debug, Clone)]
pub(super) struct NamedSeed {
    pub seed: Seed,
    text: String,
}

impl FromStr for NamedSeed {
    type Err = ParseSeedError;

    fn from_str(text: &str) -> Result<Self, ParseSeedError> {
        Ok(Self {
            seed: text.parse()?,
            text: text.to_owned(),
        })
    }
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct SeedsView<'a> {
    agent: &'a str,
    runs: Vec<RunView<'a>>,
    /// All episodes of all seeds.
    together: TaskMap<PooledRate>,
}

#[derive(Debug, Serialize)]
struct RunView<'a> {
    seed: &'a str,
    dataset: PathBuf,
    result: &'a EvaluationResult,
}

/// Successes of a task in the episodes of all seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct PooledRate {
    episodes: u32,
    successes: u32,
    success_rate: f64,
    success_ci95: [f64; 2],
}

/// Runs all episodes with each seed, each in a folder of its own below `out`, and prints the results. Returns the number of faults.
pub(super) fn run_seeds(
    setup: &mut EvalSetup,
    seeds: &[(NamedSeed, Seed)],
    profile: Profile,
    out: &Path,
    json: bool,
) -> anyhow::Result<usize> {
    let mut runs: Vec<(&str, PathBuf, ProfileOutcome)> = Vec::new();
    for (named, mismatch_seed) in seeds {
        setup.seed = named.seed;
        setup.mismatch_seed = *mismatch_seed;
        let folder = out.join(format!("seed-{}", named.text));
        let outcome = run_profile(setup, profile, &folder)?;
        runs.push((&named.text, folder, outcome));
    }
    let results: Vec<&EvaluationResult> = runs.iter().map(|(.., run)| &run.result).collect();
    let agent = &setup.bundle.manifest.name;
    let view = SeedsView {
        agent,
        together: pool(&results),
        runs: runs
            .iter()
            .map(|(seed, folder, run)| RunView {
                seed,
                dataset: folder.join(ARCHIVE_FILE),
                result: &run.result,
            })
            .collect(),
    };
    print(json, &view, |view| {
        let mut text = String::new();
        for run in &view.runs {
            text += &result_table(agent, run.result);
            text += &format!("{}\n\n", run.dataset.display());
        }
        text + &together_text(view)
    })?;
    Ok(runs.iter().map(|(.., run)| run.faults.len()).sum())
}

fn pool(results: &[&EvaluationResult]) -> TaskMap<PooledRate> {
    let tasks = results.first().map(|result| result.tasks.keys());
    let pooled = tasks.into_iter().flatten().map(|task| {
        let of_task = || results.iter().filter_map(|result| result.tasks.get(task));
        let episodes = of_task().map(|result| result.episodes).sum();
        let successes = of_task().map(|result| result.successes).sum();
        let pooled = PooledRate {
            episodes,
            successes,
            success_rate: f64::from(successes) / f64::from(episodes),
            success_ci95: wilson95(successes, episodes),
        };
        (*task, pooled)
    });
    pooled.collect()
}

fn together_text(view: &SeedsView<'_>) -> String {
    let mut lines = vec![format!("all {} seeds together", view.runs.len())];
    lines.extend(view.together.iter().map(|(task, rate)| {
        format!(
            "{task:<8} {:>8} {:>6.1} % {:>17}",
            rate.episodes,
            100.0 * rate.success_rate,
            percent_interval(rate.success_ci95)
        )
    }));
    let scores = view.runs.iter().map(|run| run.result.score);
    let scores: Vec<String> = scores.map(|score| format!("{score:.1}")).collect();
    lines.push(format!("scores by seed, %: {}", scores.join(", ")));
    lines.join("\n")
}
