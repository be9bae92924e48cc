//! The cgroup of one agent, in every hierarchy that is needed.

use super::{
    files,
    freezer::Freezer,
    hierarchy::{Hierarchies, Home, Version},
    leaf::{end_all, leaf_name, remove_leaf},
};
use crate::{
    Isolation, Layer, Limits, SandboxError,
    affinity::{self, cpu_list},
    cpu_evidence::{CpuEvidence, RunTime},
    error::IoContext,
};
use rustix::process::Pid;
use std::{
    fs::{self, File},
    io,
    os::{fd::OwnedFd, unix::fs::FileExt},
    path::{Path, PathBuf},
};

/// Over which the CPU quota is enforced: the longest that an agent over its quota is held up is this,
/// half a control step.
const CPU_PERIOD_US: u64 = 10_000;
/// The kernel charges memory in batches, so the peak may stay this far below the limit.
const PEAK_SLACK_BYTES: u64 = 1 << 20;
/// bubblewrap's own process is in the agent's cgroup.
const OUR_PROCESSES: u64 = 1;

/// A limit that the tree ran into, as the kernel counted it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum LimitHit {
    /// The kernel killed for want of memory.
    Memory { peak_bytes: Option<u64> },
    /// Processes or threads were refused this often.
    Pids { refused: u64 },
}

/// The cgroup of one agent. Removed, with whatever lives in it, by [`AgentCgroup::remove`] or drop.
#[derive(Debug)]
pub(crate) struct AgentCgroup {
    leaves: Vec<PathBuf>,
    memory: Option<(Version, PathBuf)>,
    pids: Option<PathBuf>,
    /// Where its quota is.
    cpu: Option<(Version, PathBuf)>,
    cpu_usage: Option<(Version, File)>,
    /// What else ran on its CPUs; `None` where the host does not tell.
    pub(crate) cpu_evidence: Option<CpuEvidence>,
    /// Does a cpuset hold the tree to its CPUs, whatever it asks for?
    pub(crate) holds_cpus: bool,
    /// Stops the tree and lets it go on, where the host has one.
    freezer: Option<Freezer>,
}

impl AgentCgroup {
    /// Makes the cgroup with the limits that `isolation` enforces; `None` when it enforces none.
    pub(crate) fn create(
        limits: &Limits,
        isolation: &Isolation,
        cpus: &[usize],
    ) -> Result<Option<Self>, SandboxError> {
        let layers = [
            (Layer::CgroupMemory, "memory"),
            (Layer::CgroupPids, "pids"),
            (Layer::CgroupCpu, "cpu"),
        ];
        let wanted: Vec<_> = layers
            .into_iter()
            .filter(|(layer, _)| isolation.enforces(*layer))
            .collect();
        if wanted.is_empty() {
            return Ok(None);
        }
        let hierarchies = Hierarchies::read()?;
        let mut group = Self {
            leaves: Vec::new(),
            memory: None,
            pids: None,
            cpu: None,
            cpu_usage: None,
            cpu_evidence: None,
            holds_cpus: false,
            freezer: None,
        };
        // Where a controller is known to be needed in the same v2 cgroup, all are enabled together.
        let all: Vec<&str> = wanted.iter().map(|(_, controller)| *controller).collect();
        let name = leaf_name();
        for (layer, controller) in wanted {
            let unavailable = |why: String| SandboxError::Unavailable { layer, why };
            let home = hierarchies.find(controller).ok_or_else(|| {
                unavailable(format!(
                    "no cgroup hierarchy with the controller {controller} is mounted"
                ))
            })?;
            let together: Vec<&str> = if home.version == Version::V2 {
                all.iter()
                    .copied()
                    .filter(|name| hierarchies.find(name).as_ref() == Some(&home))
                    .collect()
            } else {
                vec![controller]
            };
            let leaf = group.leaf(&home, &together, &name).map_err(|error| {
                unavailable(format!(
                    "cannot make a cgroup in {}: {error}",
                    home.own.display()
                ))
            })?;
            group
                .limit(layer, home.version, &leaf, limits)
                .map_err(|error| unavailable(error.to_string()))?;
        }
        group.measure_cpu(&hierarchies, &name, cpus);
        if !cpus.is_empty() {
            group.holds_cpus = group.hold_cpus(&hierarchies, &name, cpus);
        }
        group.freezer = group.make_freezer(&hierarchies, &name);
        Ok(Some(group))
    }

    fn make_freezer(&mut self, hierarchies: &Hierarchies, name: &str) -> Option<Freezer> {
        let home = hierarchies.find("freezer")?;
        let controllers: &[&str] = match home.version {
            Version::V1 => &["freezer"],
            Version::V2 => &[],
        };
        let leaf = self.leaf(&home, controllers, name).ok()?;
        let cpu = self
            .cpu
            .as_ref()
            .map(|(version, leaf)| (*version, leaf.as_path()));
        Freezer::open(home.version, &leaf, cpu)
    }

    /// Stops and starts the tree; `None` where the host has nothing for it.
    pub(crate) fn freezer(&self) -> Option<&Freezer> {
        self.freezer.as_ref()
    }

    /// The agent's folder below `home`, made if need be.
    fn leaf(&mut self, home: &Home, controllers: &[&str], name: &str) -> io::Result<PathBuf> {
        // Another service in the same cgroup may remove the empty folder between our two steps.
        for _ in 0..8 {
            let leaf = home.prepare_folder(controllers)?.join(name);
            match fs::create_dir(&leaf) {
                Ok(()) => self.leaves.push(leaf.clone()),
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error)
                    if error.kind() == io::ErrorKind::AlreadyExists
                        && self.leaves.contains(&leaf) => {}
                Err(error) => return Err(error),
            }
            return Ok(leaf);
        }
        Err(io::Error::other(
            "the folder for agents is being removed all the time",
        ))
    }

    fn limit(
        &mut self,
        layer: Layer,
        version: Version,
        leaf: &Path,
        limits: &Limits,
    ) -> Result<(), SandboxError> {
        let set = |file: &str, value: String| files::write(&leaf.join(file), &value);
        let memory = limits.memory_bytes.to_string();
        match (layer, version) {
            (Layer::CgroupMemory, Version::V1) => {
                set("memory.limit_in_bytes", memory.clone())?;
                // Without swap accounting the second file is missing; then the tree must not swap at all.
                if leaf.join("memory.memsw.limit_in_bytes").exists() {
                    set("memory.memsw.limit_in_bytes", memory)?;
                } else {
                    set("memory.swappiness", "0".into())?;
                }
                self.memory = Some((version, leaf.to_path_buf()));
            }
            (Layer::CgroupMemory, Version::V2) => {
                set("memory.max", memory)?;
                if leaf.join("memory.swap.max").exists() {
                    set("memory.swap.max", "0".into())?;
                }
                self.memory = Some((version, leaf.to_path_buf()));
            }
            (Layer::CgroupPids, _) => {
                set(
                    "pids.max",
                    (u64::from(limits.pids) + OUR_PROCESSES).to_string(),
                )?;
                self.pids = Some(leaf.to_path_buf());
            }
            (Layer::CgroupCpu, version) => {
                // The kernel's smallest quota is 1 ms.
                let quota_us = ((limits.cpus * CPU_PERIOD_US as f64).round() as u64).max(1000);
                match version {
                    Version::V1 => {
                        set("cpu.cfs_period_us", CPU_PERIOD_US.to_string())?;
                        set("cpu.cfs_quota_us", quota_us.to_string())?;
                    }
                    Version::V2 => set("cpu.max", format!("{quota_us} {CPU_PERIOD_US}"))?,
                }
                self.cpu = Some((version, leaf.to_path_buf()));
            }
            (Layer::Namespaces | Layer::Seccomp | Layer::Rlimits, _) => {}
        }
        Ok(())
    }

    /// Opens the files that tell the tree's CPU time and that of everything else, where they are.
    fn measure_cpu(&mut self, hierarchies: &Hierarchies, name: &str, cpus: &[usize]) {
        let Some(home) = hierarchies
            .find("cpuacct")
            .or_else(|| hierarchies.find("cpu"))
        else {
            return;
        };
        let (controllers, file): (&[&str], _) = match home.version {
            Version::V1 => (&["cpuacct"], "cpuacct.usage"),
            Version::V2 => (&[], "cpu.stat"),
        };
        let Ok(leaf) = self.leaf(&home, controllers, name) else {
            return;
        };
        let open = |path: PathBuf| File::open(path).ok();
        self.cpu_usage = open(leaf.join(file)).map(|file| (home.version, file));
        let cpus = if cpus.is_empty() {
            affinity::of_process().unwrap_or_default()
        } else {
            cpus.to_vec()
        };
        let run_time = match home.version {
            Version::V1 => {
                const EACH: &str = "cpuacct.usage_percpu";
                open(home.top.join(EACH))
                    .zip(open(leaf.join(EACH)))
                    .map(|(all, agent)| RunTime::PerCpu { all, agent })
            }
            Version::V2 => open(leaf.join(file)).map(|agent| RunTime::Whole { agent }),
        };
        let limited = self.cpu.as_ref().map(|(_, leaf)| leaf.join("cpu.stat"));
        self.cpu_evidence = run_time
            .filter(|_| !cpus.is_empty())
            .map(|run_time| CpuEvidence {
                cpus,
                run_time,
                throttled: limited.and_then(open),
            });
    }

    /// Confines the tree to `cpus` by a cpuset, where the host offers one; tells whether it does.
    fn hold_cpus(&mut self, hierarchies: &Hierarchies, name: &str, cpus: &[usize]) -> bool {
        let before = self.leaves.len();
        let held = self.set_cpus(hierarchies, name, cpus).is_some();
        if !held {
            // A half-made cpuset lets nobody in.
            for leaf in self.leaves.drain(before..) {
                remove_leaf(&leaf);
            }
        }
        held
    }

    fn set_cpus(&mut self, hierarchies: &Hierarchies, name: &str, cpus: &[usize]) -> Option<()> {
        let home = hierarchies.find("cpuset")?;
        let leaf = self.leaf(&home, &["cpuset"], name).ok()?;
        if home.version == Version::V1 {
            let memory_nodes = files::read(&leaf.parent()?.join("cpuset.mems")).ok()?;
            files::write(&leaf.join("cpuset.mems"), memory_nodes.trim()).ok()?;
        }
        files::write(&leaf.join("cpuset.cpus"), &cpu_list(cpus)).ok()
    }

    /// The files by which a process enters: it writes `0` to each.
    pub(crate) fn entrances(&self) -> Result<Vec<OwnedFd>, SandboxError> {
        self.leaves
            .iter()
            .map(|leaf| {
                let path = leaf.join("cgroup.procs");
                fs::OpenOptions::new()
                    .write(true)
                    .open(&path)
                    .map(OwnedFd::from)
                    .context(format_args!("cannot open {}", path.display()))
            })
            .collect()
    }

    /// CPU time of everything that ever ran in it, seconds.
    pub(crate) fn cpu_time_s(&self) -> Option<f64> {
        let (version, file) = self.cpu_usage.as_ref()?;
        let mut text = [0; 256];
        let count = file.read_at(&mut text, 0).ok()?;
        let text = std::str::from_utf8(&text[..count]).ok()?;
        match version {
            Version::V1 => Some(text.trim().parse::<u64>().ok()? as f64 * 1e-9),
            Version::V2 => {
                let usage = text
                    .lines()
                    .find_map(|line| line.strip_prefix("usage_usec "))?;
                Some(usage.parse::<u64>().ok()? as f64 * 1e-6)
            }
        }
    }

    /// The most memory it had at a time, bytes.
    pub(crate) fn peak_memory_bytes(&self) -> Option<u64> {
        let (version, leaf) = self.memory.as_ref()?;
        files::read_number(&leaf.join(match version {
            Version::V1 => "memory.max_usage_in_bytes",
            Version::V2 => "memory.peak",
        }))
    }

    /// The limit that the tree ran into, memory first. A kill because the whole host ran out of memory
    /// is not the tree's doing: its own limit must have been hit as well.
    pub(crate) fn limit_hit(&self) -> Option<LimitHit> {
        if let Some((version, leaf)) = &self.memory {
            let killed_and_full = match version {
                Version::V1 => {
                    let killed = files::read_keyed(&leaf.join("memory.oom_control"), "oom_kill");
                    // Recent kernels leave `failcnt` at zero; how full it was they all tell.
                    let limit = files::read_number(&leaf.join("memory.limit_in_bytes"));
                    let full = limit.zip(self.peak_memory_bytes());
                    killed.unwrap_or(0) > 0
                        && full.is_some_and(|(limit, peak)| peak + PEAK_SLACK_BYTES >= limit)
                }
                Version::V2 => {
                    let events = leaf.join("memory.events");
                    let count = |key| files::read_keyed(&events, key).unwrap_or(0);
                    count("oom_kill") > 0 && count("oom") > 0
                }
            };
            if killed_and_full {
                return Some(LimitHit::Memory {
                    peak_bytes: self.peak_memory_bytes(),
                });
            }
        }
        let refused = files::read_keyed(&self.pids.as_ref()?.join("pids.events"), "max")?;
        (refused > 0).then_some(LimitHit::Pids { refused })
    }

    /// Every process in it, bubblewrap's own included.
    pub(crate) fn processes(&self) -> Vec<Pid> {
        let pids = self
            .leaves
            .first()
            .map(|leaf| files::processes(leaf))
            .unwrap_or_default();
        pids.into_iter().filter_map(Pid::from_raw).collect()
    }

    /// Its folder in each hierarchy.
    pub(crate) fn leaves(&self) -> &[PathBuf] {
        &self.leaves
    }

    /// Kills what still lives in it and removes it.
    pub(crate) fn remove(&mut self) {
        (self.cpu_usage, self.cpu_evidence) = (None, None);
        self.freezer = None;
        let leaves = std::mem::take(&mut self.leaves);
        // All of them before one is waited for: the tree may be frozen in another than it is found in.
        for leaf in &leaves {
            end_all(leaf);
        }
        for leaf in leaves {
            remove_leaf(&leaf);
        }
    }
}

impl Drop for AgentCgroup {
    fn drop(&mut self) {
        self.remove();
    }
}
