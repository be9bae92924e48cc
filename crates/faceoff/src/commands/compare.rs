//! `faceoff compare`: compares two evaluations on the same episodes and tests whether their difference is
//! statistically significant.

mod table;

use super::{
    ca_file::CaFile, output::print_json, resource_references::find_evaluation, server::Connection,
};
use crate::competition::competition;
use anyhow::{Context, ensure};
use clap::Args;
use faceoff_api::requests::ComparisonQuery;
use faceoff_dataset::Dataset;
use faceoff_scoring::{ComparedEvaluation, Comparison, EpisodeSummary, SolvedEpisodes};
use faceoff_types::{EpisodeOutcome, Profile, TaskMap, TaskWeights};
use faceoff_wire::dataset::DatasetManifest;
use serde::Serialize;
use std::path::Path;

/// Compares two evaluations on the same episodes: solved episodes, McNemar's exact test, and the difference
/// with its 95 % interval, by task and overall.
#[derive(Debug, Args)]
pub struct CompareCommand {
    /// A dataset.zip, an unpacked dataset, or the folder of `faceoff eval --out`; with --server, an
    /// evaluation of that server: its id, `latest`, or "TEAM DAY"
    a: String,
    /// The other evaluation, given in the same way
    b: String,
    /// Compare two evaluations of this server, by their ids or "TEAM DAY"
    #[arg(long, value_name = "URL")]
    server: Option<String>,
    #[command(flatten)]
    ca: CaFile,
    /// Also list the episodes that only A, only B, both or neither solved, by task
    #[arg(long)]
    episodes: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// A local comparison, as `--json` prints it.
#[derive(Serialize)]
struct LocalView<'a> {
    a: LocalSide<'a>,
    b: LocalSide<'a>,
    ruleset: &'a str,
    profile: Profile,
    #[serde(flatten)]
    comparison: &'a Comparison,
    #[serde(skip_serializing_if = "Option::is_none")]
    episodes: Option<TaskMap<SolvedEpisodes>>,
}

#[derive(Serialize)]
struct LocalSide<'a> {
    path: &'a str,
    agent: &'a str,
}

impl CompareCommand {
    /// Compares and prints.
    ///
    /// # Errors
    /// If an evaluation cannot be read, or their episodes differ; the error names the field that differs.
    pub fn run(self) -> anyhow::Result<()> {
        match &self.server {
            Some(server) => super::block_on(self.compare_on_server(server)),
            None => self.compare_files(),
        }
    }

    fn compare_files(&self) -> anyhow::Result<()> {
        let evaluations = [Evaluation::read(&self.a)?, Evaluation::read(&self.b)?];
        let [first, second] = &evaluations;
        let shared = first.shared_episodes(second);
        ensure!(
            !shared.is_empty(),
            "the two evaluations have no task in common"
        );
        if evaluations
            .iter()
            .any(|one| one.manifest.episodes != shared)
        {
            eprintln!("{}", shared_note(&shared));
        }
        let (a, b) = (first.part(&shared)?, second.part(&shared)?);
        let comparison = comparison_input(&a).compare(&comparison_input(&b)).context(
            "the two evaluations have different episodes; run both with the same --seed, --mismatch-seed and --profile",
        )?;
        let episodes = match self.episodes {
            true => Some(comparison_input(&a).solved_episodes(&comparison_input(&b))?),
            false => None,
        };
        if self.json {
            return print_json(&LocalView {
                a: LocalSide {
                    path: &self.a,
                    agent: &a.manifest.agent,
                },
                b: LocalSide {
                    path: &self.b,
                    agent: &b.manifest.agent,
                },
                ruleset: &a.manifest.ruleset,
                profile: a.manifest.profile,
                comparison: &comparison,
                episodes,
            });
        }
        println!("A: {} ({})", a.manifest.agent, self.a);
        println!("B: {} ({})", b.manifest.agent, self.b);
        print!("{}", table::comparison_table(&comparison));
        if let Some(episodes) = &episodes {
            print!("{}", table::episode_lists(episodes));
        }
        Ok(())
    }

    async fn compare_on_server(&self, server: &str) -> anyhow::Result<()> {
        // The token of a login also allows comparisons of results that are not public yet.
        let client = Connection::resolve(Some(server), None, self.ca.path())?.client()?;
        let a = find_evaluation(&client, &self.a).await?;
        let b = find_evaluation(&client, &self.b).await?;
        let query = ComparisonQuery {
            episodes: self.episodes,
        };
        let view = client.compare(a, b, query).await?;
        if self.json {
            return print_json(&view);
        }
        println!("A: {} ({})", view.a.team, view.a.evaluation);
        println!("B: {} ({})", view.b.team, view.b.evaluation);
        let comparison = Comparison {
            tasks: view.tasks,
            overall: view.overall,
        };
        print!("{}", table::comparison_table(&comparison));
        if let Some(episodes) = &view.episodes {
            print!("{}", table::episode_lists(episodes));
        }
        Ok(())
    }
}

/// The parts of a dataset that a comparison needs.
struct Evaluation {
    manifest: DatasetManifest,
    outcomes: Vec<EpisodeOutcome>,
}

/// An evaluation, limited to the episodes that another one has, too.
struct SharedPart<'a> {
    manifest: &'a DatasetManifest,
    weights: TaskWeights,
    summary: EpisodeSummary,
}

impl Evaluation {
    fn read(path: &str) -> anyhow::Result<Self> {
        let read = || -> anyhow::Result<Self> {
            let dataset = Dataset::open_lazily(Path::new(path), competition())?;
            let episodes = dataset.episodes()?.into_iter();
            Ok(Self {
                outcomes: episodes.map(|record| record.outcome).collect(),
                manifest: dataset.manifest().clone(),
            })
        };
        read().with_context(|| format!("reading the evaluation {path}"))
    }

    /// The number of episodes of each task that both have: with the same seed, the first ones of both are the same.
    fn shared_episodes(&self, other: &Self) -> TaskMap<u32> {
        let episodes = self.manifest.episodes.iter();
        let shared = episodes.filter_map(|(task, count)| {
            let other_count = other.manifest.episodes.get(task)?;
            Some((*task, *count.min(other_count)))
        });
        shared.filter(|(_, count)| *count > 0).collect()
    }

    fn part(&self, episodes: &TaskMap<u32>) -> anyhow::Result<SharedPart<'_>> {
        let is_shared = |outcome: &&EpisodeOutcome| {
            let count = episodes.get(&outcome.task);
            count.is_some_and(|count| outcome.episode < *count)
        };
        let outcomes: Vec<EpisodeOutcome> =
            self.outcomes.iter().filter(is_shared).cloned().collect();
        Ok(SharedPart {
            weights: competition().weights(&self.manifest.variation),
            summary: EpisodeSummary::from_outcomes(
                competition(),
                &outcomes,
                &competition().tasks_in_order(episodes)?,
                competition().tier_bounds(&self.manifest.variation),
            )?,
            manifest: &self.manifest,
        })
    }
}

/// Says which episodes are compared if one evaluation has more than the other.
fn shared_note(shared: &TaskMap<u32>) -> String {
    let counts = shared.iter();
    let counts: Vec<String> = counts
        .map(|(task, count)| format!("{count} of {task}"))
        .collect();
    format!(
        "note: one evaluation has more episodes than the other; compared are the first ones, which both have: {}",
        counts.join(", ")
    )
}

/// An evaluation with everything that has to be equal in both. `seed` draws the episodes, `mismatch_seed` the robot's deviation
/// from its model.
fn comparison_input<'a>(part: &'a SharedPart<'a>) -> ComparedEvaluation<'a> {
    let SharedPart {
        manifest,
        weights,
        summary,
    } = part;
    ComparedEvaluation {
        ruleset: &manifest.ruleset,
        profile: manifest.profile,
        variation: &manifest.variation,
        weights,
        seed: manifest.seed,
        mismatch_seed: manifest.mismatch_seed,
        summary,
    }
}
