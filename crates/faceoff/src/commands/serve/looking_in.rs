//! What the runtimes hold, looked up once while the server starts.

use crate::{config::Config, machine};
use anyhow::Context as _;
use faceoff_http::Offer;
use faceoff_runner::{AgentEnvironment, inventory};
use faceoff_types::{AgentLimits, RuntimeContent};
use faceoff_worker::CpuLayout;
use std::thread;

/// What agents find here. Their runtimes are asked on a thread of the calling one's priority: the first agent that is
/// started hands its own on to all others.
///
/// # Errors
/// If there is no thread left.
pub fn offer(config: &Config, cpus: &CpuLayout) -> anyhow::Result<Offer> {
    let env = AgentEnvironment {
        agent_cpus: cpus
            .slots
            .first()
            .map(|slot| slot.of_agent(0).to_vec())
            .unwrap_or_default(),
        ..config.agent_environment()
    };
    let limits = AgentLimits {
        bundle: config.bundle,
        resources: env.limits.clone(),
        time: env.time.clone(),
    };
    let (offer, teller) = Offer::new(limits, machine::of_agents(&env.agent_cpus));
    thread::Builder::new()
        .name("runtimes".to_owned())
        .spawn(move || {
            let found = inventory(&env);
            for runtime in &found {
                match &runtime.content {
                    RuntimeContent::Python(python) => tracing::info!(
                        runtime = runtime.name,
                        python = python.version,
                        packages = python.packages.len(),
                        "a runtime is offered"
                    ),
                    RuntimeContent::Native { libc } => {
                        tracing::info!(runtime = runtime.name, libc, "a runtime is offered");
                    }
                    RuntimeContent::Image => {
                        tracing::info!(runtime = runtime.name, "container images are run");
                    }
                    RuntimeContent::Broken { why } => tracing::warn!(
                        runtime = runtime.name,
                        why,
                        "a runtime does not work; `faceoff doctor` tells more"
                    ),
                }
            }
            teller.tell(found);
        })
        .context("starting the thread that looks into the runtimes")?;
    Ok(offer)
}
