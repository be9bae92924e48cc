//! `--like-server`: the rules, limits and runtimes of a server, and what this machine has otherwise.

use super::differences;
use crate::{client::Client, commands::block_on, config::Config, machine};
use anyhow::{Context, bail, ensure};
use faceoff_api::views::{
    runtimes::{RuntimesView, StageOffer},
    stage::{PhaseView, StageView},
};
use faceoff_runner::{AgentEnvironment, inventory};
use faceoff_types::{IMAGE_RUNTIME, RULESET, Ruleset};
use std::path::Path;

/// A stage of a server, as it plays.
#[derive(Debug)]
pub(super) struct LikeServer {
    url: String,
    server: RuntimesView,
    stage: StageView,
    offer: StageOffer,
}

impl LikeServer {
    /// Asks the server; `stage` names one, and may be left out where there is one to choose.
    ///
    /// # Errors
    /// If it does not answer, plays by other rules than this program knows, or has no such stage.
    pub fn ask(url: &str, ca_file: Option<&Path>, stage: Option<&str>) -> anyhow::Result<Self> {
        let client = Client::new(url, None, ca_file)?;
        let cannot = || format!("cannot evaluate like the server at {url}");
        block_on(async {
            let server = client.runtimes().await?;
            // Before the stages, whose rules another version would not understand.
            ensure!(
                server.ruleset == RULESET,
                "it plays by {}, and this program by {RULESET}; use the server's version of faceoff",
                server.ruleset
            );
            let stages = client.stages().await?;
            Self::of(url, server, stages, stage)
        })
        .with_context(cannot)
    }

    fn of(
        url: &str,
        server: RuntimesView,
        stages: Vec<StageView>,
        wanted: Option<&str>,
    ) -> anyhow::Result<Self> {
        let stage = chosen(stages, &server.stages, wanted)?;
        let ruleset = stage.rules.rules.ruleset;
        ensure!(
            ruleset == Ruleset::CURRENT,
            "its stage “{}” still plays by {ruleset}, and this program by {RULESET}; name another stage (--stage), or use \
             a version of faceoff that plays by {ruleset}",
            stage.name
        );
        let offer = server.stages.iter().find(|offer| offer.id == stage.id);
        let offer = offer.cloned().with_context(|| {
            format!(
                "its stage “{}” is over: it tells no limits any more",
                stage.name
            )
        })?;
        Ok(Self {
            url: url.to_owned(),
            server,
            stage,
            offer,
        })
    }

    /// The stage and its rules.
    pub const fn stage(&self) -> &StageView {
        &self.stage
    }

    /// Puts the stage's rules and limits in the place of this machine's. Runtimes and layers of the sandbox stay: they
    /// are what this machine has.
    pub fn apply(&self, config: &mut Config) {
        let limits = &self.offer.limits;
        config.bundle = limits.bundle;
        config.limits = limits.resources.clone();
        config.time = limits.time.clone();
        let rules = &self.stage.rules.rules;
        config.evaluation.max_faults = rules.max_faults;
        config.evaluation.weights = rules.variation.weights;
        config.evaluation.tier_bounds = rules.variation.tier_bounds;
        config.evaluation.perturbations = Some(rules.variation.perturbations.clone());
    }

    /// Refuses a bundle whose runtime the stage does not take, or that this machine does not offer.
    pub fn check_runtime(&self, runtime: &str, env: &AgentEnvironment) -> anyhow::Result<()> {
        if !self.offer.runtimes.iter().any(|name| name == runtime) {
            bail!(
                "agent.toml names the runtime {runtime}, and the stage “{}” of {} takes {}",
                self.stage.name,
                self.url,
                self.offer.runtimes.join(", ")
            );
        }
        ensure!(
            runtime != IMAGE_RUNTIME || env.runs_images(),
            "the agent is a container image, and this machine runs none: its configuration says so (sandbox.images), or \
             gives the namespaces up"
        );
        ensure!(
            env.offered().iter().any(|name| name == runtime),
            "agent.toml names the runtime {runtime}, which the server offers and this machine does not: make it \
             (docker/runtime.sh FOLDER) and name it in a configuration (--config): [runtimes.{runtime}] folder = \"FOLDER\""
        );
        Ok(())
    }

    /// What is played and by which limits, and what is otherwise here, line by line.
    pub fn told(&self, runtime: &str, env: &AgentEnvironment, given_up: &[String]) -> Vec<String> {
        let rules = &self.stage.rules;
        let limits = &self.offer.limits;
        let mut lines = vec![
            format!(
                "like {}: stage “{}”, revision {}, {}",
                self.url, self.stage.name, rules.revision, rules.rules.ruleset
            ),
            format!(
                "limits   {} CPU, {} MiB of memory, {} processes, {} s to start, {} s a step",
                limits.resources.cpus,
                limits.resources.memory_bytes >> 20,
                limits.resources.pids,
                limits.time.startup_s,
                limits.time.step_s
            ),
        ];
        let here = AgentEnvironment {
            runtimes: env
                .runtimes
                .iter()
                .filter(|(name, _)| *name == runtime)
                .map(|(name, runtime)| (name.clone(), runtime.clone()))
                .collect(),
            images: env.images && runtime == IMAGE_RUNTIME,
            ..env.clone()
        };
        let there = self.server.runtimes.iter().find(|one| one.name == runtime);
        let mut differences = match (inventory(&here).first(), there) {
            (Some(here), Some(there)) => differences::of_runtimes(here, there),
            _ => Vec::new(),
        };
        let machine = machine::of_agents(&env.agent_cpus);
        differences.extend(differences::of_machines(&machine, &self.server.machine));
        if !given_up.is_empty() {
            differences.push(format!(
                "this machine does without {}, so not all limits are enforced",
                given_up.join(", ")
            ));
        }
        if differences.is_empty() {
            lines.push("nothing that can be compared differs".to_owned());
        }
        lines.extend(differences.into_iter().map(|one| format!("differs  {one}")));
        lines
    }
}

/// The stage that is meant: the one that is named, or the only one that is open, or to open.
fn chosen(
    stages: Vec<StageView>,
    offers: &[StageOffer],
    wanted: Option<&str>,
) -> anyhow::Result<StageView> {
    let names = |stages: &[StageView]| -> Vec<String> {
        stages
            .iter()
            .map(|stage| format!("“{}”", stage.name))
            .collect()
    };
    let all = names(&stages).join(", ");
    if let Some(wanted) = wanted {
        let is_it = |stage: &StageView| {
            stage.name.as_str().eq_ignore_ascii_case(wanted) || stage.id.to_string() == wanted
        };
        return stages
            .into_iter()
            .find(is_it)
            .with_context(|| format!("it has no stage “{wanted}”; it has {all}"));
    }
    let not_over: Vec<_> = stages
        .into_iter()
        .filter(|stage| offers.iter().any(|offer| offer.id == stage.id))
        .collect();
    for phase in [PhaseView::Open, PhaseView::Upcoming] {
        let there: Vec<_> = not_over
            .iter()
            .filter(|stage| stage.phase == phase)
            .cloned()
            .collect();
        match &there[..] {
            [] => {}
            [one] => return Ok(one.clone()),
            more => bail!(
                "it has several stages: name one of {} (--stage)",
                names(more).join(", ")
            ),
        }
    }
    bail!("all its stages are over ({all}): it tells no limits any more")
}
