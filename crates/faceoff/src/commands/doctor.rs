//! `faceoff doctor`: what this host offers to agents and their sandbox, what is missing, and the cure.

mod checked;
mod elsewhere;
mod permissions;
mod printed;
mod times;

use crate::{
    config::{Config, RuntimeConfig},
    descriptors::Descriptors,
};
use anyhow::{Context as _, bail};
use checked::Checked;
use clap::Args;
use faceoff_runner::inventory;
use faceoff_sandbox::{
    HostFeature, Isolation, Layer, MEMORY, MemoryImage, NoImage, Runtime, probe_host,
};
use faceoff_store::Room;
use faceoff_types::{RuntimeContent, RuntimeInventory};
use serde::Serialize;
use std::{io::Write as _, path::PathBuf};

/// Checks what this host offers and what is missing.
#[derive(Debug, Args)]
pub struct DoctorCommand {
    /// Configuration file [default: faceoff.toml in the working folder, if there is one]
    #[arg(long, value_name = "FILE", env = "FACEOFF_CONFIG")]
    config: Option<PathBuf>,
    /// Where NATS is, to ask whether a worker of this host would get work; replaces nats.url of the configuration
    #[arg(long, value_name = "URL")]
    nats: Option<String>,
    /// What that worker would be called [default: the host's name]
    #[arg(long)]
    name: Option<String>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

/// Packages that are worth a word.
const KNOWN_PACKAGES: [&str; 4] = ["numpy", "scipy", "onnxruntime", "torch"];

/// Everything that was found.
#[derive(Debug, Serialize)]
struct Findings {
    /// Can agents run here, with what the configuration gives up given up?
    ok: bool,
    features: Vec<Feature>,
    runtimes: Vec<RuntimeFound>,
    in_memory: InMemory,
    cpus: Cpus,
    descriptors: DescriptorsFound,
    disks: Vec<DiskFound>,
    host: Vec<Checked>,
    /// Would a worker of this host get work? Empty where no NATS is named.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    nats: Vec<Checked>,
}

/// The disk of a folder that `serve` writes to.
#[derive(Debug, Serialize)]
struct DiskFound {
    /// As configured; it need not exist yet.
    folder: PathBuf,
    /// `None`: the disk cannot be asked.
    free_bytes: Option<u64>,
    found: String,
    cure: Option<String>,
}

/// How `serve` would divide the descriptors that it gets from this shell.
#[derive(Debug, Serialize)]
struct DescriptorsFound {
    /// `None`: too few.
    divided: Option<Descriptors>,
    found: String,
    cure: Option<String>,
}

/// Will the runtimes' files be kept in memory, where they tell no agent what another has read?
#[derive(Debug, Serialize)]
struct InMemory {
    available: bool,
    found: String,
    cure: Option<String>,
}

#[derive(Debug, Serialize)]
struct Feature {
    #[serde(flatten)]
    host: HostFeature,
    /// Named in `[sandbox] given_up`.
    given_up: bool,
}

#[derive(Debug, Serialize)]
struct RuntimeFound {
    name: String,
    available: bool,
    found: String,
    cure: Option<String>,
}

#[derive(Debug, Serialize)]
struct Cpus {
    /// CPUs this process may use.
    usable: usize,
    /// Worker slots, as configured or by the number of CPUs.
    slots: usize,
    /// CPUs that agents are bound to; empty = all.
    agent_cpus: Vec<usize>,
    /// What keeps computation times from being fair, if anything.
    advice: Option<String>,
}

impl DoctorCommand {
    /// Probes the host and prints what was found.
    ///
    /// # Errors
    /// If a layer of the sandbox is missing that the configuration does not give up; if the
    /// configuration cannot be read.
    pub fn run(self) -> anyhow::Result<()> {
        let mut config = Config::load(self.config.as_deref())?;
        config.reach_nats(self.nats)?;
        let mut findings = Findings::gather(&config);
        findings.nats = elsewhere::ask(&config, self.name)?;
        let mut out = std::io::stdout().lock();
        if self.json {
            serde_json::to_writer_pretty(&mut out, &findings).context("standard output")?;
            writeln!(out)?;
        } else {
            findings.print(&mut out)?;
        }
        let missing: Vec<_> = missing(&findings.features).map(Layer::as_str).collect();
        if !missing.is_empty() {
            bail!(
                "agents cannot run here: {} missing; see the cures above, or name what you do without \
                 in the configuration: [sandbox] given_up = {missing:?}",
                missing.join(", ")
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
            .map(|host| Feature {
                given_up: given_up.contains(&host.layer),
                host,
            })
            .collect();
        let ok = missing(&features).next().is_none();
        Self {
            ok,
            runtimes: runtimes(config, &features),
            features,
            in_memory: in_memory(config),
            cpus: cpus(config),
            descriptors: descriptors(config),
            disks: disks(config),
            host: host(config),
            nats: Vec::new(),
        }
    }
}

/// Layers that are neither there nor given up.
fn missing(features: &[Feature]) -> impl Iterator<Item = Layer> {
    features
        .iter()
        .filter(|feature| !feature.host.available && !feature.given_up)
        .map(|feature| feature.host.layer)
}

/// Each is asked inside the sandbox, as far as this host has one.
fn runtimes(config: &Config, features: &[Feature]) -> Vec<RuntimeFound> {
    let mut env = config.agent_environment();
    let lacking = features.iter().filter(|feature| !feature.host.available);
    env.isolation = Isolation::Sandboxed {
        given_up: lacking.map(|feature| feature.host.layer).collect(),
    };
    let mut found: Vec<_> = inventory(&env)
        .into_iter()
        .map(|RuntimeInventory { name, content }| RuntimeFound {
            available: !matches!(content, RuntimeContent::Broken { .. }),
            found: describe(&content, env.runtimes.get(&name)),
            cure: cure(config, &name, &content),
            name,
        })
        .collect();
    if !env.runtimes.contains_key("python3") {
        found.push(RuntimeFound {
            name: "python3".into(),
            available: false,
            found: "no python3 in the usual places".into(),
            cure: Some("apt-get install python3".into()),
        });
    }
    found
}

fn in_memory(config: &Config) -> InMemory {
    let runtimes = config.agent_environment().runtimes;
    match MemoryImage::size(&runtimes, config.sandbox.resident_bytes) {
        Ok(bytes) => InMemory {
            available: true,
            found: format!(
                "{} MiB of files are kept in memory while serving",
                bytes >> 20
            ),
            cure: None,
        },
        Err(why) => InMemory {
            available: false,
            found: format!("{why}: an agent may learn what others have read of them"),
            cure: Some(match why {
                NoImage::NoRoom { bytes, .. } => {
                    let mib = (bytes >> 20).next_multiple_of(100) + 100;
                    format!(
                        "offer smaller runtimes, or have a larger {MEMORY}: mount -o remount,size={mib}m {MEMORY}; \
                         in Docker: docker run --shm-size {mib}m"
                    )
                }
                NoImage::TooLarge { .. } | NoImage::Failed(_) => {
                    "offer smaller runtimes, or raise sandbox.resident_bytes".to_owned()
                }
            }),
        },
    }
}

fn describe(content: &RuntimeContent, runtime: Option<&Runtime>) -> String {
    match content {
        RuntimeContent::Python(python) => {
            let interpreter = runtime.and_then(Runtime::interpreter);
            let place = interpreter.map(|path| format!(" at {}", path.display()));
            let named = |name: &&str| python.packages.contains_key(*name);
            let known: Vec<_> = KNOWN_PACKAGES
                .iter()
                .filter(|name| named(name))
                .map(|name| format!("{name} {}", python.packages[*name]))
                .collect();
            let more = python.packages.len() - known.len();
            format!(
                "{} {}{}; {}{more} other packages",
                python.implementation,
                python.version,
                place.unwrap_or_default(),
                known
                    .iter()
                    .map(|one| format!("{one}, "))
                    .collect::<String>(),
            )
        }
        RuntimeContent::Native { libc } => format!(
            "{} host paths, read-only; C library {}",
            runtime.map_or(0, |runtime| runtime.read_only_paths.len()),
            libc.as_deref().unwrap_or("of no known version")
        ),
        RuntimeContent::Image => "container images, which bring their own files".to_owned(),
        RuntimeContent::Broken { why } => why.clone(),
    }
}

fn cure(config: &Config, name: &str, content: &RuntimeContent) -> Option<String> {
    let RuntimeContent::Broken { .. } = content else {
        return None;
    };
    Some(match config.runtimes.get(name) {
        Some(RuntimeConfig::Folder(folder)) => {
            format!("make it again: docker/runtime.sh {}", folder.display())
        }
        Some(RuntimeConfig::Paths { .. }) => {
            format!("correct read_only_paths of [runtimes.{name}] in the configuration")
        }
        None => "see what is missing of the sandbox above".to_owned(),
    })
}

fn cpus(config: &Config) -> Cpus {
    let usable = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let slots = config.slots();
    let fitting = Config::slots_on(usable);
    // An agent and the simulator that waits for it take turns, but two agents on one CPU disturb each
    // other's computation times, and requests disturb a simulator's.
    let advice = (slots > fitting).then(|| {
        let what = if slots * 2 > usable {
            "disturb each other's computation times"
        } else {
            "leave none to the server's own work, which then gives way on the simulators'"
        };
        format!("{slots} slots on {usable} CPUs {what}; set workers.slots = {fitting}")
    });
    Cpus {
        usable,
        slots,
        agent_cpus: config.workers.agent_cpus.clone(),
        advice,
    }
}

fn descriptors(config: &Config) -> DescriptorsFound {
    let wanted = config.connections.limits();
    match Descriptors::divide(Descriptors::available(), config.slots(), &wanted) {
        Ok(divided) => {
            let Descriptors {
                limit,
                reserved,
                connections,
                per_address,
            } = divided;
            let cure = (connections < wanted.open).then(|| {
                format!(
                    "for all {} of connections.most raise the limit: ulimit -n, or LimitNOFILE= of systemd",
                    wanted.open
                )
            });
            DescriptorsFound {
                divided: Some(divided),
                found: format!(
                    "{limit} at most, {reserved} of them for evaluations: {connections} connections, \
                     {per_address} of one address"
                ),
                cure,
            }
        }
        Err(error) => DescriptorsFound {
            divided: None,
            found: error.to_string(),
            cure: None,
        },
    }
}

fn host(config: &Config) -> Vec<Checked> {
    let (data_dir, now) = (&config.server.data_dir, jiff::Timestamp::now());
    vec![
        times::clock(data_dir, now),
        times::zone(&config.evaluation.zone, now),
        permissions::permissions(data_dir),
    ]
}

fn disks(config: &Config) -> Vec<DiskFound> {
    let mut folders = vec![config.server.data_dir.clone(), config.scratch_dir()];
    folders.dedup_by(|second, first| second.starts_with(first));
    folders
        .into_iter()
        .map(|folder| disk(folder, config.server.min_free_bytes))
        .collect()
}

fn disk(folder: PathBuf, min_free_bytes: u64) -> DiskFound {
    let absolute = std::path::absolute(&folder).unwrap_or_else(|_| folder.clone());
    let existing = absolute.ancestors().find(|folder| folder.exists());
    let asked = existing.map(|folder| (folder, rustix::fs::statvfs(folder)));
    let Some((existing, Ok(disk))) = asked else {
        return DiskFound {
            folder,
            free_bytes: None,
            found: "its disk cannot be asked".into(),
            cure: Some("correct data_dir and scratch_dir of the configuration".into()),
        };
    };
    let free_bytes = disk.f_bavail.saturating_mul(disk.f_frsize);
    let room = Room::new(vec![existing.to_owned()], min_free_bytes);
    let cure = room.is_short().then(|| {
        "the queue would pause and uploads be refused: make room, or lower server.min_free_bytes"
            .to_owned()
    });
    DiskFound {
        folder,
        free_bytes: Some(free_bytes),
        found: format!(
            "{} MiB free, {} MiB of them to stay so",
            free_bytes >> 20,
            min_free_bytes >> 20
        ),
        cure,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn findings(available: bool, given_up: bool) -> Findings {
        let host = HostFeature {
            layer: Layer::CgroupMemory,
            available,
            found: "what was seen".into(),
            cure: (!available).then(|| "what to type".into()),
        };
        Findings {
            ok: available || given_up,
            features: vec![Feature { host, given_up }],
            runtimes: Vec::new(),
            in_memory: in_memory(&Config::default()),
            cpus: cpus(&Config::default()),
            descriptors: descriptors(&Config::default()),
            disks: disks(&Config::default()),
            host: Vec::new(),
            nats: Vec::new(),
        }
    }

    #[test]
    fn a_disk_with_less_than_is_to_be_kept_free_is_shown_with_its_cure() {
        let folder = std::env::temp_dir().join("not/yet/made");
        let roomy = disk(folder.clone(), 1);
        assert!(
            roomy.free_bytes.is_some() && roomy.cure.is_none(),
            "{roomy:?}"
        );
        let short = disk(folder, u64::MAX);
        assert_eq!(short.free_bytes.is_some(), roomy.free_bytes.is_some());
        assert!(
            short
                .cure
                .expect("it is short")
                .contains("server.min_free_bytes")
        );
    }

    #[test]
    fn a_missing_layer_is_shown_with_its_cure_and_a_given_up_one_is_not_missing() {
        let found = findings(false, false);
        assert_eq!(
            missing(&found.features).collect::<Vec<_>>(),
            [Layer::CgroupMemory]
        );
        let mut text = Vec::new();
        found.print(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert!(
            text.contains("MISSING   cgroup-memory  what was seen"),
            "{text}"
        );
        assert!(text.contains("-> what to type"), "{text}");
        // What helps against several stands once.
        let mut several = findings(false, false);
        several.features.extend(found.features);
        let mut text = Vec::new();
        several.print(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert_eq!(text.matches("MISSING").count(), 2, "{text}");
        assert_eq!(text.matches("-> what to type").count(), 1, "{text}");
        assert_eq!(missing(&findings(false, true).features).count(), 0);
        assert_eq!(missing(&findings(true, false).features).count(), 0);
    }
}
