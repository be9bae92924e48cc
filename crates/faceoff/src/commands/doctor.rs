//! `faceoff doctor`: checks what a host offers to agents and their sandbox, and how to fix what is missing.
//!
//! A *layer* is one protection of the sandbox, e.g. the memory limit. The configuration may *give up* layers: agents then run
//! without them. Each report says what was `found` and, as its `fix`, how to fix a problem.

mod check;
mod clock;
mod permissions;
mod report;
mod runtimes;
mod worker_admission;

use super::config_file::ConfigFile;
use crate::{config::Config, descriptors::Descriptors};
use anyhow::{Context as _, bail};
use check::Check;
use clap::Args;
use faceoff_sandbox::{
    HostFeature, Layer, MEMORY_FOLDER, MemoryImage, MemoryImageError, probe_host,
};
use faceoff_store::FreeSpace;
use runtimes::{RuntimeReport, runtime_reports};
use serde::Serialize;
use std::{io::Write as _, path::PathBuf};

/// Checks whether this host can run agents, and how to fix what is missing.
#[derive(Debug, Args)]
pub struct DoctorCommand {
    #[command(flatten)]
    config: ConfigFile,
    /// NATS server, to check whether a worker on this host would get jobs; overrides nats.url of the configuration
    #[arg(long, value_name = "URL")]
    nats: Option<String>,
    /// Name of that worker [default: the host's name]
    #[arg(long)]
    name: Option<String>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Findings {
    /// Agents can run on this host: every layer is available or given up by the configuration.
    ok: bool,
    /// The sandbox's layers.
    features: Vec<LayerReport>,
    runtimes: Vec<RuntimeReport>,
    in_memory: MemoryReport,
    cpus: CpuReport,
    descriptors: DescriptorReport,
    disks: Vec<DiskReport>,
    host: Vec<Check>,
    /// Whether a worker on this host would get jobs; empty if no NATS server is configured.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    nats: Vec<Check>,
}

/// The disk of a folder that `serve` writes to.
#[derive(Debug, Serialize)]
struct DiskReport {
    /// As configured; it may not exist yet.
    folder: PathBuf,
    /// `None`: the disk cannot be queried.
    free_bytes: Option<u64>,
    found: String,
    #[serde(rename = "cure")]
    fix: Option<String>,
}

/// How `serve` would divide the file descriptors of this shell.
#[derive(Debug, Serialize)]
struct DescriptorReport {
    /// `None`: there are too few.
    divided: Option<Descriptors>,
    found: String,
    #[serde(rename = "cure")]
    fix: Option<String>,
}

/// Whether the runtimes' files are held in memory, where their timing does not reveal what other agents have read.
#[derive(Debug, Serialize)]
struct MemoryReport {
    available: bool,
    found: String,
    #[serde(rename = "cure")]
    fix: Option<String>,
}

#[derive(Debug, Serialize)]
struct LayerReport {
    #[serde(flatten)]
    feature: HostFeature,
    /// Named in `[sandbox] given_up`.
    given_up: bool,
}

#[derive(Debug, Serialize)]
struct CpuReport {
    /// CPUs this process may use.
    usable: usize,
    /// Worker slots, configured or derived from the number of CPUs.
    slots: usize,
    /// CPUs that agents are bound to; empty: all.
    agent_cpus: Vec<usize>,
    /// Why the agents' computation times may be unfair, and what to change.
    advice: Option<String>,
}

impl DoctorCommand {
    /// Probes the host and prints the findings.
    ///
    /// # Errors
    /// If a layer of the sandbox is missing that the configuration does not give up, or the configuration cannot be
    /// read.
    pub fn run(self) -> anyhow::Result<()> {
        let mut config = self.config.load()?;
        config.override_nats_url(self.nats)?;
        let mut findings = Findings::gather(&config);
        findings.nats = worker_admission::check(&config, self.name)?;
        let mut out = std::io::stdout().lock();
        if self.json {
            serde_json::to_writer_pretty(&mut out, &findings).context("standard output")?;
            writeln!(out)?;
        } else {
            findings.print(&mut out)?;
        }
        let missing_layers: Vec<_> = missing_layers(&findings.features)
            .map(Layer::as_str)
            .collect();
        if !missing_layers.is_empty() {
            bail!(
                "agents cannot run on this host: {} missing; apply the fixes above, or give the layers up \
                in the configuration: [sandbox] given_up = {missing_layers:?}",
                missing_layers.join(", ")
            );
        }
        Ok(())
    }
}

impl Findings {
    fn gather(config: &Config) -> Self {
        let given_up = &config.sandbox.given_up;
        let features: Vec<_> = probe_host()
            .into_iter()
            .map(|feature| LayerReport {
                given_up: given_up.contains(&feature.layer),
                feature,
            })
            .collect();
        let ok = missing_layers(&features).next().is_none();
        let unavailable = features.iter().filter(|layer| !layer.feature.available);
        let unavailable = unavailable.map(|layer| layer.feature.layer).collect();
        Self {
            ok,
            runtimes: runtime_reports(config, unavailable),
            features,
            in_memory: memory_report(config),
            cpus: cpu_report(config),
            descriptors: descriptor_report(config),
            disks: disk_reports(config),
            host: host_checks(config),
            nats: Vec::new(),
        }
    }
}

/// Layers that are neither available nor given up.
fn missing_layers(features: &[LayerReport]) -> impl Iterator<Item = Layer> {
    features
        .iter()
        .filter(|layer| !layer.feature.available && !layer.given_up)
        .map(|layer| layer.feature.layer)
}

fn memory_report(config: &Config) -> MemoryReport {
    let runtimes = config.agent_environment().runtimes;
    match MemoryImage::size(&runtimes, config.sandbox.resident_bytes) {
        Ok(bytes) => MemoryReport {
            available: true,
            found: format!(
                "{} MiB of runtime files are held in memory while serving",
                bytes >> 20
            ),
            fix: None,
        },
        Err(error) => MemoryReport {
            available: false,
            found: format!(
                "{error}: without that, an agent can infer which files others have read"
            ),
            fix: Some(match error {
                MemoryImageError::NotEnoughMemory { bytes, .. } => {
                    let mib = (bytes >> 20).next_multiple_of(100) + 100;
                    format!(
                        "offer smaller runtimes, or enlarge {MEMORY_FOLDER}: mount -o remount,size={mib}m {MEMORY_FOLDER}; \
                         in Docker: docker run --shm-size {mib}m"
                    )
                }
                MemoryImageError::TooLarge { .. } | MemoryImageError::Failed(_) => {
                    "offer smaller runtimes, or raise sandbox.resident_bytes".to_owned()
                }
            }),
        },
    }
}

fn cpu_report(config: &Config) -> CpuReport {
    let usable = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let slots = config.slots();
    let recommended_slots = Config::slots_on(usable);
    // An agent and its simulator alternate on a CPU. Two agents on one CPU disturb each other's computation
    // times, and HTTP requests disturb those of a simulator.
    let advice = (slots > recommended_slots).then(|| {
        let effect = if slots * 2 > usable {
            "disturb each other's computation times"
        } else {
            "leave no CPU for the server's own work, which then runs on the simulators' CPUs"
        };
        format!("{slots} slots on {usable} CPUs {effect}; set workers.slots = {recommended_slots}")
    });
    CpuReport {
        usable,
        slots,
        agent_cpus: config.workers.agent_cpus.clone(),
        advice,
    }
}

fn descriptor_report(config: &Config) -> DescriptorReport {
    let limits = config.connections.limits();
    match Descriptors::divide(Descriptors::available(), config.slots(), &limits) {
        Ok(divided) => {
            let Descriptors {
                limit,
                reserved,
                connections,
                per_address,
            } = divided;
            let fix = (connections < limits.open).then(|| {
                format!(
                    "to allow all {} connections of connections.most, raise the limit: ulimit -n, or LimitNOFILE= of systemd",
                    limits.open
                )
            });
            DescriptorReport {
                divided: Some(divided),
                found: format!(
                    "at most {limit}, of which {reserved} for evaluations: {connections} connections, \
                    {per_address} per address"
                ),
                fix,
            }
        }
        Err(error) => DescriptorReport {
            divided: None,
            found: error.to_string(),
            fix: None,
        },
    }
}

fn host_checks(config: &Config) -> Vec<Check> {
    let (data_dir, now) = (&config.server.data_dir, jiff::Timestamp::now());
    vec![
        clock::clock(data_dir, now),
        clock::zone(&config.evaluation.zone, now),
        permissions::permissions(data_dir),
    ]
}

fn disk_reports(config: &Config) -> Vec<DiskReport> {
    let mut folders = vec![config.server.data_dir.clone(), config.scratch_dir()];
    folders.dedup_by(|second, first| second.starts_with(first));
    folders
        .into_iter()
        .map(|folder| disk_report(folder, config.server.min_free_bytes))
        .collect()
}

fn disk_report(folder: PathBuf, min_free_bytes: u64) -> DiskReport {
    let absolute = std::path::absolute(&folder).unwrap_or_else(|_| folder.clone());
    let existing = absolute.ancestors().find(|folder| folder.exists());
    let queried = existing.map(|folder| (folder, rustix::fs::statvfs(folder)));
    let Some((existing, Ok(disk))) = queried else {
        return DiskReport {
            folder,
            free_bytes: None,
            found: "its disk cannot be queried".into(),
            fix: Some("correct data_dir and scratch_dir of the configuration".into()),
        };
    };
    let free_bytes = disk.f_bavail.saturating_mul(disk.f_frsize);
    let free_space = FreeSpace::new(vec![existing.to_owned()], min_free_bytes);
    let fix = free_space.is_short().then(|| {
        "the queue would pause and uploads would be refused: free disk space, or lower server.min_free_bytes"
            .to_owned()
    });
    DiskReport {
        folder,
        free_bytes: Some(free_bytes),
        found: format!(
            "{} MiB free, {} MiB required",
            free_bytes >> 20,
            min_free_bytes >> 20
        ),
        fix,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn findings(available: bool, given_up: bool) -> Findings {
        let feature = HostFeature {
            layer: Layer::CgroupMemory,
            available,
            found: "no memory controller".into(),
            fix: (!available).then(|| "enable it".into()),
        };
        Findings {
            ok: available || given_up,
            features: vec![LayerReport { feature, given_up }],
            runtimes: Vec::new(),
            in_memory: memory_report(&Config::default()),
            cpus: cpu_report(&Config::default()),
            descriptors: descriptor_report(&Config::default()),
            disks: disk_reports(&Config::default()),
            host: Vec::new(),
            nats: Vec::new(),
        }
    }

    #[test]
    fn full_disk_is_reported_with_its_fix() {
        let folder = std::env::temp_dir().join("not/yet/made");
        let ample = disk_report(folder.clone(), 1);
        assert!(
            ample.free_bytes.is_some() && ample.fix.is_none(),
            "{ample:?}"
        );
        let full = disk_report(folder, u64::MAX);
        assert_eq!(full.free_bytes.is_some(), ample.free_bytes.is_some());
        assert!(
            full.fix
                .expect("it is full")
                .contains("server.min_free_bytes")
        );
    }

    #[test]
    fn missing_layer_is_reported_unless_given_up() {
        let found = findings(false, false);
        assert_eq!(
            missing_layers(&found.features).collect::<Vec<_>>(),
            [Layer::CgroupMemory]
        );
        let mut text = Vec::new();
        found.print(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert!(
            text.contains("MISSING   cgroup-memory  no memory controller"),
            "{text}"
        );
        assert!(text.contains("-> enable it"), "{text}");
        // A fix of several layers is printed once.
        let mut several = findings(false, false);
        several.features.extend(found.features);
        let mut text = Vec::new();
        several.print(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert_eq!(text.matches("MISSING").count(), 2, "{text}");
        assert_eq!(text.matches("-> enable it").count(), 1, "{text}");
        assert_eq!(missing_layers(&findings(false, true).features).count(), 0);
        assert_eq!(missing_layers(&findings(true, false).features).count(), 0);
    }
}
