//! The cgroup of one agent: one folder (*leaf*) in each hierarchy that has a needed controller.

use super::{
    NOT_MOUNTED, files,
    freezer::Freezer,
    hierarchy::{Hierarchies, Hierarchy, Version},
    leaf::{kill_and_thaw, leaf_name, remove_leaf},
};
use crate::{
    Isolation, Layer, Limits, SandboxError,
    affinity::{self, cpu_list},
    cpu_accounting::{CpuAccounting, RunTimeFiles},
    error::IoContext,
};
use rustix::process::Pid;
use std::{
    fs::{self, File},
    io,
    os::{fd::OwnedFd, unix::fs::FileExt},
    path::{Path, PathBuf},
};

/// Period of the CPU quota, and so the longest time for which an agent over its quota is throttled: half a control step (20 ms).
const CPU_PERIOD_US: u64 = 10_000;
/// The kernel charges memory in batches, so the peak may stay this far below the limit.
const PEAK_SLACK_BYTES: u64 = 1 << 20;
/// bubblewrap's own process and the sandbox's first one are in the agent's cgroup.
const BUBBLEWRAP_PROCESSES: u64 = 2;

/// A limit that the tree reached, according to the kernel's counters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ExceededLimit {
    /// The kernel killed a process because the memory limit was reached.
    Memory { peak_bytes: Option<u64> },
    /// `refused`: number of refused processes and threads.
    Pids { refused: u64 },
}

/// The cgroup of one agent. [`AgentCgroup::remove`] or drop kills the processes in the cgroup and removes the cgroup.
#[derive(Debug)]
pub(crate) struct AgentCgroup {
    /// All leaves, one per hierarchy.
    leaves: Vec<PathBuf>,
    /// The leaf with the memory limit.
    memory: Option<(Version, PathBuf)>,
    /// The leaf with the limit of processes.
    pids: Option<PathBuf>,
    /// The leaf with the CPU quota.
    cpu: Option<(Version, PathBuf)>,
    /// The counter of the tree's CPU time.
    cpu_usage: Option<(Version, File)>,
    /// Accounting of the run time of other processes on the agent's CPUs; `None` if the host has no such counters.
    pub(crate) cpu_accounting: Option<CpuAccounting>,
    /// Does a cpuset confine the tree to its CPUs, whatever affinity it requests?
    pub(crate) confines_cpus: bool,
    /// `None` if the host has no usable freezer.
    freezer: Option<Freezer>,
}

impl AgentCgroup {
    /// Creates the cgroup with the limits that `isolation` enforces; `None` if it enforces none.
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
        let enforced: Vec<_> = layers
            .into_iter()
            .filter(|(layer, _)| isolation.enforces(*layer))
            .collect();
        if enforced.is_empty() {
            return Ok(None);
        }
        let hierarchies = Hierarchies::read()?;
        let mut group = Self {
            leaves: Vec::new(),
            memory: None,
            pids: None,
            cpu: None,
            cpu_usage: None,
            cpu_accounting: None,
            confines_cpus: false,
            freezer: None,
        };
        // Controllers that share a v2 hierarchy are enabled together.
        let all_controllers: Vec<&str> =
            enforced.iter().map(|(_, controller)| *controller).collect();
        let name = leaf_name();
        for (layer, controller) in enforced {
            let unavailable = |reason: String| SandboxError::Unavailable { layer, reason };
            let hierarchy = hierarchies
                .find(controller)
                .ok_or_else(|| unavailable(format!("{NOT_MOUNTED} {controller}")))?;
            let shared_controllers: Vec<&str> = if hierarchy.version == Version::V2 {
                all_controllers
                    .iter()
                    .copied()
                    .filter(|name| hierarchies.find(name).as_ref() == Some(&hierarchy))
                    .collect()
            } else {
                vec![controller]
            };
            let leaf = group
                .create_leaf(&hierarchy, &shared_controllers, &name)
                .map_err(|error| {
                    unavailable(format!(
                        "cannot make a cgroup in {}: {error}",
                        hierarchy.service_dir.display()
                    ))
                })?;
            group
                .set_limit(layer, hierarchy.version, &leaf, limits)
                .map_err(|error| unavailable(error.to_string()))?;
        }
        group.open_cpu_counters(&hierarchies, &name, cpus);
        if !cpus.is_empty() {
            group.confines_cpus = group.confine_cpus(&hierarchies, &name, cpus);
        }
        group.freezer = group.make_freezer(&hierarchies, &name);
        Ok(Some(group))
    }

    fn make_freezer(&mut self, hierarchies: &Hierarchies, name: &str) -> Option<Freezer> {
        let hierarchy = hierarchies.find("freezer")?;
        let controllers: &[&str] = match hierarchy.version {
            Version::V1 => &["freezer"],
            Version::V2 => &[],
        };
        let leaf = self.create_leaf(&hierarchy, controllers, name).ok()?;
        let cpu = self
            .cpu
            .as_ref()
            .map(|(version, leaf)| (*version, leaf.as_path()));
        Freezer::open(hierarchy.version, &leaf, cpu)
    }

    /// Freezes and thaws the tree; `None` if the host has no usable freezer.
    pub(crate) fn freezer(&self) -> Option<&Freezer> {
        self.freezer.as_ref()
    }

    /// Creates the agent's leaf in a hierarchy if it is missing.
    fn create_leaf(
        &mut self,
        hierarchy: &Hierarchy,
        controllers: &[&str],
        name: &str,
    ) -> io::Result<PathBuf> {
        // Another process of Faceoff in the same cgroup may remove the empty parent folder between the two calls.
        for _ in 0..8 {
            let leaf = hierarchy.create_agents_folder(controllers)?.join(name);
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
            "another service keeps removing the folder for agents",
        ))
    }

    /// Writes the limit of `layer` into the leaf.
    fn set_limit(
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
                // Without swap accounting this file is missing; then the tree must not swap at all.
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
                    (u64::from(limits.pids) + BUBBLEWRAP_PROCESSES).to_string(),
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

    /// Opens the files with the counters of the tree's CPU time and of all other CPU time, if the host has them.
    fn open_cpu_counters(&mut self, hierarchies: &Hierarchies, name: &str, cpus: &[usize]) {
        let Some(hierarchy) = hierarchies
            .find("cpuacct")
            .or_else(|| hierarchies.find("cpu"))
        else {
            return;
        };
        let (controllers, file): (&[&str], _) = match hierarchy.version {
            Version::V1 => (&["cpuacct"], "cpuacct.usage"),
            Version::V2 => (&[], "cpu.stat"),
        };
        let Ok(leaf) = self.create_leaf(&hierarchy, controllers, name) else {
            return;
        };
        let open = |path: PathBuf| File::open(path).ok();
        self.cpu_usage = open(leaf.join(file)).map(|file| (hierarchy.version, file));
        let cpus = if cpus.is_empty() {
            affinity::process_cpus().unwrap_or_default()
        } else {
            cpus.to_vec()
        };
        let run_time = match hierarchy.version {
            Version::V1 => {
                const USAGE_PER_CPU: &str = "cpuacct.usage_percpu";
                open(hierarchy.mount_point.join(USAGE_PER_CPU))
                    .zip(open(leaf.join(USAGE_PER_CPU)))
                    .map(|(all, agent)| RunTimeFiles::PerCpu { all, agent })
            }
            Version::V2 => open(leaf.join(file)).map(|agent| RunTimeFiles::Whole { agent }),
        };
        let cpu_stat_path = self.cpu.as_ref().map(|(_, leaf)| leaf.join("cpu.stat"));
        self.cpu_accounting = run_time
            .filter(|_| !cpus.is_empty())
            .map(|run_time| CpuAccounting {
                cpus,
                run_time,
                throttled: cpu_stat_path.and_then(open),
            });
    }

    /// Confines the tree to `cpus` by a cpuset; returns whether the host offers one.
    fn confine_cpus(&mut self, hierarchies: &Hierarchies, name: &str, cpus: &[usize]) -> bool {
        let first_new_leaf = self.leaves.len();
        let is_confined = self.set_cpus(hierarchies, name, cpus).is_some();
        if !is_confined {
            // No process can enter an incomplete cpuset.
            for leaf in self.leaves.drain(first_new_leaf..) {
                remove_leaf(&leaf);
            }
        }
        is_confined
    }

    fn set_cpus(&mut self, hierarchies: &Hierarchies, name: &str, cpus: &[usize]) -> Option<()> {
        let hierarchy = hierarchies.find("cpuset")?;
        let leaf = self.create_leaf(&hierarchy, &["cpuset"], name).ok()?;
        if hierarchy.version == Version::V1 {
            let memory_nodes = files::read(&leaf.parent()?.join("cpuset.mems")).ok()?;
            files::write(&leaf.join("cpuset.mems"), memory_nodes.trim()).ok()?;
        }
        files::write(&leaf.join("cpuset.cpus"), &cpu_list(cpus)).ok()
    }

    /// The `cgroup.procs` files: a process enters the cgroup by writing `0` to each.
    pub(crate) fn procs_files(&self) -> Result<Vec<OwnedFd>, SandboxError> {
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

    /// CPU time of all processes that ever ran in the cgroup, in seconds.
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

    /// Peak memory, in bytes.
    pub(crate) fn peak_memory_bytes(&self) -> Option<u64> {
        let (version, leaf) = self.memory.as_ref()?;
        files::read_number(&leaf.join(match version {
            Version::V1 => "memory.max_usage_in_bytes",
            Version::V2 => "memory.peak",
        }))
    }

    /// The limit that the tree reached, memory first. If the whole host runs out of memory, a kill is not the tree's
    /// fault, so its own limit must have been reached as well.
    pub(crate) fn exceeded_limit(&self) -> Option<ExceededLimit> {
        if let Some((version, leaf)) = &self.memory {
            let was_killed_at_limit = match version {
                Version::V1 => {
                    let killed = files::read_keyed(&leaf.join("memory.oom_control"), "oom_kill");
                    // Recent kernels leave `failcnt` at zero, but all report the peak.
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
            if was_killed_at_limit {
                return Some(ExceededLimit::Memory {
                    peak_bytes: self.peak_memory_bytes(),
                });
            }
        }
        let refused = files::read_keyed(&self.pids.as_ref()?.join("pids.events"), "max")?;
        (refused > 0).then_some(ExceededLimit::Pids { refused })
    }

    /// All processes in the cgroup, including bubblewrap's own.
    pub(crate) fn processes(&self) -> Vec<Pid> {
        let pids = self
            .leaves
            .first()
            .map(|leaf| files::processes(leaf))
            .unwrap_or_default();
        pids.into_iter().filter_map(Pid::from_raw).collect()
    }

    /// The agent's leaves, one per hierarchy.
    pub(crate) fn leaves(&self) -> &[PathBuf] {
        &self.leaves
    }

    /// Kills the remaining processes in the cgroup and removes the cgroup.
    pub(crate) fn remove(&mut self) {
        (self.cpu_usage, self.cpu_accounting) = (None, None);
        self.freezer = None;
        let leaves = std::mem::take(&mut self.leaves);
        // Kill and thaw in all hierarchies before waiting in one: the tree may be frozen in another hierarchy than
        // the one that lists its processes.
        for leaf in &leaves {
            kill_and_thaw(leaf);
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
