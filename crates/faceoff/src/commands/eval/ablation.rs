//! `faceoff eval --ablation`: the same episodes without perturbations, with each one alone, and with all. Each of these sets of
//! perturbations is a *profile*.

use super::{
    files::{ABLATION, write_json},
    profile_run::{EvalSetup, run_profile},
};
use crate::commands::{output::print, table_cells::percent_interval};
use crate::competition::competition;
use anyhow::Context;
use faceoff_scoring::{EpisodeSummary, ProfileEffect};
use faceoff_types::{ProfileMap, Ruleset, Seed, TaskMap};
use serde::Serialize;
use std::path::Path;

/// `ablation.json`.
#[derive(Debug, Serialize)]
struct AblationFile {
    ruleset: Ruleset,
    seed: Seed,
    agent: String,
    tasks: TaskMap<Vec<ProfileEffect>>,
}

/// Runs each profile of the ablation into a folder of its name and compares them. Returns the number of agent faults.
pub(super) fn run(setup: &EvalSetup, out: &Path, json: bool) -> anyhow::Result<usize> {
    let mut faults = 0;
    let mut runs = ProfileMap::new();
    for profile in competition().ablation_profiles() {
        let outcome = run_profile(setup, profile, &out.join(profile.as_str()))
            .with_context(|| format!("profile {profile}"))?;
        faults += outcome.faults.len();
        let summary = EpisodeSummary::from_outcomes(
            competition(),
            &outcome.outcomes,
            &setup.tasks,
            competition().tier_bounds(&setup.variation),
        );
        runs.insert(profile, summary.context("comparing the profiles")?);
    }
    let tasks = faceoff_scoring::ablation(&runs, competition().ideal_profile)
        .context("comparing the profiles")?;
    let agent = setup.bundle.manifest.name.clone();
    let text = table(&agent, setup.seed, &tasks);
    let path = out.join(ABLATION);
    let file = AblationFile {
        ruleset: competition().ruleset(),
        seed: setup.seed,
        agent,
        tasks,
    };
    write_json(&path, &file)?;
    print(json, &file, |_| format!("{text}\n{}", path.display()))?;
    Ok(faults)
}

/// The comparison as text.
fn table(agent: &str, seed: Seed, tasks: &TaskMap<Vec<ProfileEffect>>) -> String {
    let mut lines = vec![format!(
        "{agent}: ablation ({}), seed {seed}\n",
        competition().ruleset()
    )];
    lines.push(format!(
        "{:<8} {:<17} {:>8} {:>8} {:>17} {:>9} {:>5} {:>6} {:>7} {:>8}",
        "task",
        "profile",
        "episodes",
        "success",
        "95 % interval",
        "to ideal",
        "lost",
        "gained",
        "p",
        "penalty"
    ));
    for (task, effects) in tasks {
        for effect in effects {
            lines.push(format!(
                "{task:<8} {:<17} {:>8} {:>6.1} % {:>17} {:>9} {:>5} {:>6} {:>7.4} {:>8.1}",
                effect.profile,
                effect.episodes,
                100.0 * effect.success_rate,
                percent_interval(effect.success_ci95),
                format!("{:+.1}", 100.0 * effect.difference),
                effect.lost,
                effect.gained,
                effect.p_value,
                effect.penalty_points,
            ));
        }
    }
    lines.push(
        "\nto ideal: difference in percentage points; lost, gained: episodes that succeed only in the ideal profile, \
        only in this one; p: McNemar's exact test"
            .to_owned(),
    );
    lines.join("\n") + "\n"
}
