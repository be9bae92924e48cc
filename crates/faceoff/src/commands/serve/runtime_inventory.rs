//! Inventory of the *runtimes*, the environments that agents run in, e.g. a Python with packages. It is taken once while the
//! server starts.

use crate::{config::Config, machine};
use anyhow::Context as _;
use faceoff_http::AgentResources;
use faceoff_runner::{AgentEnvironment, take_inventory};
use faceoff_types::{AgentLimits, RuntimeContent};
use faceoff_worker::CpuLayout;
use std::thread;

/// The limits, machine and runtimes that the pages show for agents on this host. The inventory of runtimes is published to the
/// result later. It is taken on a thread with the caller's priority, because all
/// later agent processes inherit the priority of the first one.
///
/// # Errors
/// If the thread cannot be started.
pub fn agent_resources(config: &Config, cpus: &CpuLayout) -> anyhow::Result<AgentResources> {
    let env = AgentEnvironment {
        agent_cpus: cpus
            .slots
            .first()
            .map(|slot| slot.agent_cpus(0).to_vec())
            .unwrap_or_default(),
        ..config.agent_environment()
    };
    let limits = AgentLimits {
        bundle: config.bundle,
        resources: env.limits.clone(),
        time: env.time.clone(),
    };
    let (resources, publisher) =
        AgentResources::new(limits, machine::agent_machine(&env.agent_cpus));
    thread::Builder::new()
        .name("runtimes".to_owned())
        .spawn(move || {
            let found = take_inventory(&env);
            for runtime in &found {
                match &runtime.content {
                    RuntimeContent::Python(python) => tracing::info!(
                        runtime = runtime.name,
                        python = python.version,
                        packages = python.packages.len(),
                        "runtime available"
                    ),
                    RuntimeContent::Native { libc } => {
                        tracing::info!(runtime = runtime.name, libc, "runtime available");
                    }
                    RuntimeContent::Image => {
                        tracing::info!(runtime = runtime.name, "container images available");
                    }
                    RuntimeContent::Failed { reason } => tracing::warn!(
                        runtime = runtime.name,
                        reason,
                        "runtime does not work; run `faceoff doctor` for details"
                    ),
                }
            }
            publisher.publish(found);
        })
        .context("starting the thread that inspects the runtimes")?;
    Ok(resources)
}
