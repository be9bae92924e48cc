//! `faceoff runtimes`: what agents find on a server.

use super::{output::print, server::ServerArgs};
use clap::Args;
use faceoff_api::views::runtimes::RuntimesView;
use faceoff_types::{AgentLimits, RuntimeContent, RuntimeInventory};

/// Shows what agents find on the server: runtimes with their packages, and the limits of each contest.
#[derive(Debug, Args)]
pub struct RuntimesCommand {
    #[command(flatten)]
    server: ServerArgs,
}

impl RuntimesCommand {
    /// Asks the server.
    ///
    /// # Errors
    /// If it cannot be reached.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let offered = self.server.anybody()?.runtimes().await?;
            print(self.server.json, &offered, || text(&offered))
        })
    }
}

fn text(offered: &RuntimesView) -> String {
    let mut lines: Vec<String> = offered.runtimes.iter().map(runtime).collect();
    let machine = &offered.machine;
    lines.push(format!(
        "agents run on {} ({}), on {} at a time; they have no GPU and no network",
        machine.architecture,
        machine.cpu_model.as_deref().unwrap_or("a CPU of no name"),
        match machine.cpus_per_agent {
            1 => "1 CPU".to_owned(),
            cpus => format!("{cpus} CPUs"),
        }
    ));
    let mut contests: Vec<_> = offered
        .stages
        .iter()
        .map(|one| (one.name.as_str(), &one.runtimes, &one.limits))
        .collect();
    let tournaments = offered.tournaments.iter();
    contests.extend(tournaments.map(|one| (one.name.as_str(), &one.runtimes, &one.limits)));
    if contests.is_empty() {
        lines.push(format!("limits: {}", limits(&offered.limits)));
    }
    for (name, runtimes, held_to) in contests {
        lines.push(format!(
            "{name} takes {}: {}",
            super::output::or_none(vec![runtimes.join(", ")], "none"),
            limits(held_to)
        ));
    }
    lines.join("\n")
}

fn runtime(runtime: &RuntimeInventory) -> String {
    let libc = |libc: &Option<String>| match libc {
        Some(version) => format!("glibc {version}"),
        None => "a C library that does not tell its version".to_owned(),
    };
    let found = match &runtime.content {
        RuntimeContent::Python(python) => {
            let packages = python.packages.iter();
            let packages: Vec<_> = packages
                .map(|(name, version)| format!("{name} {version}"))
                .collect();
            format!(
                "{} {}, {}; {}",
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
        RuntimeContent::Image => "container images, which bring their own files".to_owned(),
        RuntimeContent::Broken { why } => why.clone(),
    };
    format!("{:<12} {found}", runtime.name)
}

fn limits(limits: &AgentLimits) -> String {
    format!(
        "{} CPU, {} MiB of memory, {} processes; {} s to start, {} s a step; an archive of {} MiB, {} unpacked, in {} files",
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
