//! `faceoff runtimes`: prints the runtimes, packages and limits of agents on a server.

use super::{output::print, server::ServerArgs};
use clap::Args;
use faceoff_api::views::runtimes::RuntimesView;
use faceoff_types::{AgentLimits, RuntimeContent, RuntimeInventory};

/// Shows the environment of agents on the server: runtimes with their packages, and the limits of each stage and
/// tournament.
#[derive(Debug, Args)]
pub struct RuntimesCommand {
    #[command(flatten)]
    server: ServerArgs,
}

impl RuntimesCommand {
    /// Requests the runtimes and prints them.
    ///
    /// # Errors
    /// If the server cannot be reached.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let offered = self.server.client_with_optional_token()?.runtimes().await?;
            print(self.server.json, &offered, runtimes_text)
        })
    }
}

fn runtimes_text(offered: &RuntimesView) -> String {
    let mut lines: Vec<String> = offered.runtimes.iter().map(runtime_line).collect();
    let machine = &offered.machine;
    lines.push(format!(
        "agents run on {} ({}) with {}, without GPU and network",
        machine.architecture,
        machine.cpu_model.as_deref().unwrap_or("unknown CPU"),
        match machine.cpus_per_agent {
            1 => "1 CPU".to_owned(),
            cpus => format!("{cpus} CPUs"),
        }
    ));
    // Name, runtimes and limits of each stage and tournament.
    let mut contests: Vec<_> = offered
        .stages
        .iter()
        .map(|stage| (stage.name.as_str(), &stage.runtimes, &stage.limits))
        .collect();
    let tournaments = offered.tournaments.iter();
    contests.extend(
        tournaments.map(|contest| (contest.name.as_str(), &contest.runtimes, &contest.limits)),
    );
    if contests.is_empty() {
        lines.push(format!("limits: {}", limits_text(&offered.limits)));
    }
    for (name, runtimes, limits) in contests {
        let runtimes = if runtimes.is_empty() {
            "none".to_owned()
        } else {
            runtimes.join(", ")
        };
        lines.push(format!("{name} allows {runtimes}: {}", limits_text(limits)));
    }
    lines.join("\n")
}

fn runtime_line(runtime: &RuntimeInventory) -> String {
    let libc = |libc: &Option<String>| match libc {
        Some(version) => format!("glibc {version}"),
        None => "a C library of unknown version".to_owned(),
    };
    let content = match &runtime.content {
        RuntimeContent::Python(python) => {
            let packages = python.packages.iter();
            let packages: Vec<_> = packages
                .map(|(name, version)| format!("{name} {version}"))
                .collect();
            let unusable = python.unusable_packages.iter();
            let unusable: String = unusable
                .map(|(name, reason)| format!("; {name} cannot be imported: {reason}"))
                .collect();
            format!(
                "{} {}, {}; {}{unusable}",
                python.implementation,
                python.version,
                libc(&python.libc),
                if packages.is_empty() {
                    "the standard library".to_owned()
                } else {
                    packages.join(", ")
                }
            )
        }
        RuntimeContent::Native { libc: version } => {
            format!("programs and shared libraries; {}", libc(version))
        }
        RuntimeContent::Image => "container images, which contain their own files".to_owned(),
        RuntimeContent::Failed { reason } => reason.clone(),
    };
    format!("{:<12} {content}", runtime.name)
}

fn limits_text(limits: &AgentLimits) -> String {
    format!(
        "{} CPU, {} MiB of memory, {} processes; {} s to start, {} s per step; bundles up to {} MiB, {} MiB unpacked, {} files",
        limits.resources.cpus,
        limits.resources.memory_bytes >> 20,
        limits.resources.pids,
        limits.time.startup_s,
        limits.time.step_s,
        limits.bundle.packed_bytes >> 20,
        limits.bundle.unpacked_bytes >> 20,
        limits.bundle.files
    )
}
