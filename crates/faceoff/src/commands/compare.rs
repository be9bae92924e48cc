//! `faceoff compare`: two evaluations on the same episodes, with the tests that say whether their
//! difference is more than luck.

mod table;

use super::{ca_file::CaFile, server::Found};
use anyhow::Context;
use clap::Args;
use faceoff_api::requests::ComparisonQuery;
use faceoff_dataset::Dataset;
use faceoff_scoring::{Comparison, EpisodeSummary, Played, WhoSolved};
use faceoff_types::{EpisodeOutcome, EvaluationId, Profile, Task};
use faceoff_wire::dataset::DatasetManifest;
use serde::Serialize;
use std::{collections::BTreeMap, path::Path};

/// Compares two evaluations that played the same episodes: which of them each solved, McNemar's exact
/// test, and the difference with its 95 % interval, by task and overall.
#[derive(Debug, Args)]
pub struct CompareCommand {
    /// A dataset.zip, an unpacked dataset, or the folder of `faceoff eval --out`; with --server the id
    /// of an evaluation
    a: String,
    /// The same, of the other evaluation
    b: String,
    /// Compare two evaluations of this server, by their ids
    #[arg(long, value_name = "URL")]
    server: Option<String>,
    #[command(flatten)]
    ca: CaFile,
    /// Also list by task which episodes only A, only B, both and neither solved
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
    episodes: Option<BTreeMap<Task, WhoSolved>>,
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
    /// If an evaluation cannot be read, or the two did not play the same episodes; the error names the
    /// field that differs.
    pub fn run(self) -> anyhow::Result<()> {
        match &self.server {
            Some(server) => super::block_on(self.on_server(server)),
            None => self.locally(),
        }
    }

    fn locally(&self) -> anyhow::Result<()> {
        let (a, b) = (open(&self.a)?, open(&self.b)?);
        let comparison = played(&a).compare(&played(&b)).context(
            "the two did not play the same episodes; give both evaluations the same --seed, \
             --mismatch-seed, --profile, --task and --episodes",
        )?;
        let episodes = match self.episodes {
            true => Some(played(&a).who_solved(&played(&b))?),
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
        print!("{}", table::of(&comparison));
        if let Some(episodes) = &episodes {
            print!("{}", table::by_whom(episodes));
        }
        Ok(())
    }

    async fn on_server(&self, server: &str) -> anyhow::Result<()> {
        let id = |text: &str| -> anyhow::Result<EvaluationId> {
            text.parse().with_context(|| {
                format!("{text:?}: expected the id of an evaluation, as with --server")
            })
        };
        // Who has signed in there may compare what is not everybody's yet.
        let client = Found::of(Some(server), None, self.ca.path())?.client()?;
        let wanted = ComparisonQuery {
            episodes: self.episodes,
        };
        let view = client.compare(id(&self.a)?, id(&self.b)?, wanted).await?;
        if self.json {
            return print_json(&view);
        }
        println!("A: {} ({})", view.a.team, view.a.evaluation);
        println!("B: {} ({})", view.b.team, view.b.evaluation);
        let comparison = Comparison {
            tasks: view.tasks,
            overall: view.overall,
        };
        print!("{}", table::of(&comparison));
        if let Some(episodes) = &view.episodes {
            print!("{}", table::by_whom(episodes));
        }
        Ok(())
    }
}

/// What a comparison needs of a dataset.
struct Evaluation {
    manifest: DatasetManifest,
    summary: EpisodeSummary,
}

fn open(path: &str) -> anyhow::Result<Evaluation> {
    let read = || -> anyhow::Result<Evaluation> {
        let dataset = Dataset::open_unread(Path::new(path))?;
        let episodes = dataset.episodes()?.into_iter();
        let outcomes: Vec<EpisodeOutcome> = episodes.map(|record| record.outcome).collect();
        Ok(Evaluation {
            summary: EpisodeSummary::of(&outcomes, &dataset.manifest().variation.tier_bounds)?,
            manifest: dataset.manifest().clone(),
        })
    };
    read().with_context(|| format!("reading the evaluation {path}"))
}

fn played(Evaluation { manifest, summary }: &Evaluation) -> Played<'_> {
    Played {
        ruleset: &manifest.ruleset,
        profile: manifest.profile,
        variation: &manifest.variation,
        seed: manifest.seed,
        mismatch_seed: manifest.mismatch_seed,
        summary,
    }
}

fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    println!(
        "{}",
        serde_json::to_string_pretty(value).context("writing JSON")?
    );
    Ok(())
}
