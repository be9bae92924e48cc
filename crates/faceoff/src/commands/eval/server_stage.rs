//! `faceoff eval --like-server`: rules, limits and runtimes of a server's stage, and how this machine differs.

use super::differences;
use crate::competition::competition;
use crate::{client::Client, commands::block_on, config::Config, machine};
use anyhow::{Context, anyhow, bail, ensure};
use faceoff_api::views::{
    runtimes::{RuntimesView, StageResources},
    stage::{PhaseView, StageView},
};
use faceoff_runner::{AgentEnvironment, take_inventory};
use faceoff_types::IMAGE_RUNTIME;
use std::path::Path;

/// A stage of a server with its rules and limits.
#[derive(Debug)]
pub(super) struct ServerStage {
    url: String,
    /// Runtimes and machine of the server.
    server: RuntimesView,
    stage: StageView,
    /// Runtimes and limits of agents in the stage.
    resources: StageResources,
}

impl ServerStage {
    /// Requests a stage by name or id; without `stage`, the only open one, or the only upcoming one.
    ///
    /// # Errors
    /// If the server does not answer, uses another ruleset than this program, or has no such stage.
    pub fn fetch(url: &str, ca_file: Option<&Path>, stage: Option<&str>) -> anyhow::Result<Self> {
        let client = Client::new(url, None, ca_file)?;
        let own = competition().ruleset();
        let context = || format!("cannot evaluate like the server at {url}");
        block_on(async {
            let server = client.runtimes().await?;
            // Checked before the stages are read, whose rules another version cannot parse.
            ensure!(
                server.ruleset == own.as_str(),
                "it uses the ruleset {}, this program {own}; use the server's version of faceoff",
                server.ruleset
            );
            let stages = client.stages().await?;
            Self::select(url, server, stages, stage)
        })
        .with_context(context)
    }

    fn select(
        url: &str,
        server: RuntimesView,
        stages: Vec<StageView>,
        name_or_id: Option<&str>,
    ) -> anyhow::Result<Self> {
        let mut stage = select_stage(stages, &server.stages, name_or_id)?;
        let (ruleset, own) = (stage.rules.rules.ruleset, competition().ruleset());
        ensure!(
            ruleset == own,
            "its stage “{}” still uses the ruleset {ruleset}, this program {own}; name another stage (--stage), or use \
            a version of faceoff with {ruleset}",
            stage.name
        );
        let rules = &mut stage.rules.rules;
        competition()
            .check_and_normalise_rules(rules)
            .map_err(|error| anyhow!("its stage “{}” has invalid rules: {error}", stage.name))?;
        let resources = server.stages.iter().find(|listed| listed.id == stage.id);
        let resources = resources.cloned().with_context(|| {
            format!(
                "its stage “{}” is closed and has no limits any more",
                stage.name
            )
        })?;
        Ok(Self {
            url: url.to_owned(),
            server,
            stage,
            resources,
        })
    }

    pub const fn stage(&self) -> &StageView {
        &self.stage
    }

    /// Replaces the rules and limits of the configuration by the stage's. The rules' *variation* has the stage's deviations from
    /// the ruleset: weights, tier bounds, perturbations. Runtimes and layers of the sandbox remain those of this machine.
    pub fn apply(&self, config: &mut Config) {
        let limits = &self.resources.limits;
        config.bundle = limits.bundle;
        config.limits = limits.resources.clone();
        config.time = limits.time.clone();
        let rules = &self.stage.rules.rules;
        config.evaluation.max_faults = rules.max_faults;
        config.evaluation.weights = competition().weights(&rules.variation);
        config.evaluation.tier_bounds = competition().tier_bounds(&rules.variation);
        config.evaluation.perturbations = rules.variation.perturbations.clone();
    }

    /// Refuses a bundle whose runtime the stage does not allow or this machine does not offer.
    pub fn check_runtime(&self, runtime: &str, env: &AgentEnvironment) -> anyhow::Result<()> {
        if !self.resources.runtimes.iter().any(|name| name == runtime) {
            bail!(
                "agent.toml names the runtime {runtime}, but the stage “{}” of {} allows {}",
                self.stage.name,
                self.url,
                self.resources.runtimes.join(", ")
            );
        }
        ensure!(
            runtime != IMAGE_RUNTIME || env.supports_images(),
            "the agent is a container image, but this machine does not run images: its configuration disables them \
            (sandbox.images) or gives up the namespaces"
        );
        ensure!(
            env.runtime_names().iter().any(|name| name == runtime),
            "agent.toml names the runtime {runtime}, which the server offers but this machine does not: build it \
            (docker/runtime.sh FOLDER) and name it in a configuration (--config): [runtimes.{runtime}] folder = \"FOLDER\""
        );
        Ok(())
    }

    /// Stage, limits and differences of this machine, line by line. `disabled_layers`: the layers (single protections) of the sandbox
    /// that are not used on this machine.
    pub fn report(
        &self,
        runtime: &str,
        env: &AgentEnvironment,
        disabled_layers: &[String],
    ) -> Vec<String> {
        let rules = &self.stage.rules;
        let limits = &self.resources.limits;
        let mut lines = vec![
            format!(
                "like {}: stage “{}”, revision {}, {}",
                self.url, self.stage.name, rules.revision, rules.rules.ruleset
            ),
            format!(
                "limits   {} CPU, {} MiB of memory, {} processes, {} s to start, {} s per step",
                limits.resources.cpus,
                limits.resources.memory_bytes >> 20,
                limits.resources.pids,
                limits.time.startup_s,
                limits.time.step_s
            ),
        ];
        let local_env = AgentEnvironment {
            runtimes: env
                .runtimes
                .iter()
                .filter(|(name, _)| *name == runtime)
                .map(|(name, runtime)| (name.clone(), runtime.clone()))
                .collect(),
            images: env.images && runtime == IMAGE_RUNTIME,
            ..env.clone()
        };
        let servers_runtime = self
            .server
            .runtimes
            .iter()
            .find(|offered| offered.name == runtime);
        let mut differences = match (take_inventory(&local_env).first(), servers_runtime) {
            (Some(local), Some(server)) => differences::compare_runtimes(local, server),
            _ => Vec::new(),
        };
        let machine = machine::agent_machine(&env.agent_cpus);
        differences.extend(differences::compare_machines(
            &machine,
            &self.server.machine,
        ));
        if !disabled_layers.is_empty() {
            differences.push(format!(
                "this machine does not use {}, so not all limits are enforced",
                disabled_layers.join(", ")
            ));
        }
        if differences.is_empty() {
            lines.push("no differences found".to_owned());
        }
        lines.extend(
            differences
                .into_iter()
                .map(|difference| format!("differs  {difference}")),
        );
        lines
    }
}

/// The stage of this name or id; without one, the only open stage, or the only upcoming one.
fn select_stage(
    stages: Vec<StageView>,
    resources: &[StageResources],
    name_or_id: Option<&str>,
) -> anyhow::Result<StageView> {
    let names = |stages: &[StageView]| -> Vec<String> {
        stages
            .iter()
            .map(|stage| format!("“{}”", stage.name))
            .collect()
    };
    let all = names(&stages).join(", ");
    if let Some(name_or_id) = name_or_id {
        let matches = |stage: &StageView| {
            stage.name.as_str().eq_ignore_ascii_case(name_or_id)
                || stage.id.to_string() == name_or_id
        };
        return stages
            .into_iter()
            .find(matches)
            .with_context(|| format!("it has no stage “{name_or_id}”; it has {all}"));
    }
    // The server lists resources of stages that are not closed.
    let not_closed: Vec<_> = stages
        .into_iter()
        .filter(|stage| resources.iter().any(|listed| listed.id == stage.id))
        .collect();
    for phase in [PhaseView::Open, PhaseView::Upcoming] {
        let candidates: Vec<_> = not_closed
            .iter()
            .filter(|stage| stage.phase == phase)
            .cloned()
            .collect();
        match &candidates[..] {
            [] => {}
            [stage] => return Ok(stage.clone()),
            several => bail!(
                "it has several stages: name one of {} (--stage)",
                names(several).join(", ")
            ),
        }
    }
    bail!("all its stages are closed ({all}) and have no limits any more")
}
