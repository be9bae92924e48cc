//! Sandbox. (contract stub)
#![expect(missing_docs, clippy::unimplemented, unused_variables, reason = "contract stub")]
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, path::PathBuf, time::{Duration, Instant}};
use faceoff_types::AgentFaultKind;

/// What an agent process tree may use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    pub memory_bytes: u64, pub pids: u32, pub scratch_bytes: u64, pub open_files: u32, pub file_size_bytes: u64,
    /// CPUs (1.0 = one CPU) by cgroup quota
    pub cpus: f64,
    pub stderr_tail_bytes: u64,
}
impl Default for Limits { fn default() -> Self { unimplemented!() } }

/// A runtime the organiser offers (agent.toml `runtime`): read-only host paths visible inside, and PATH.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Runtime { pub read_only_paths: Vec<PathBuf>, pub path: String }

/// What is not enforced because the organiser said so. Empty = everything.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layer { Namespaces, Seccomp, CgroupMemory, CgroupPids, CgroupCpu, Rlimits }

/// Which isolation to apply.
#[derive(Debug, Clone, PartialEq)]
pub enum Isolation {
    /// all layers but the ones named
    Sandboxed { given_up: Vec<Layer> },
    /// a developer's own agent: no namespaces, no seccomp, no cgroup; still own process group, deadlines, reaping
    None,
}

/// One feature of the host and what it means.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HostFeature { pub layer: Layer, pub available: bool, pub found: String, pub cure: Option<String> }
/// Probes the host for real (starts a probe process). Used by doctor and at start-up.
pub fn probe_host() -> Vec<HostFeature> { unimplemented!() }

#[derive(Debug, Clone)]
pub struct SpawnSpec {
    /// unpacked bundle folder, mounted read-only at /agent (the working directory)
    pub bundle_dir: PathBuf,
    pub command: Vec<String>,
    pub env: BTreeMap<String, String>,
    pub runtime: Runtime,
    pub limits: Limits,
    pub isolation: Isolation,
    /// CPU numbers the agent may run on; empty = any
    pub cpus: Vec<usize>,
}

/// Our fault: the sandbox could not be set up or observed.
#[derive(Debug, thiserror::Error)]
pub enum SandboxError {
    #[error("{what}: {source}")]
    Io { what: String, source: std::io::Error },
    #[error("this host cannot provide {layer:?}: {why}")]
    Unavailable { layer: Layer, why: String },
}

#[derive(Debug)]
pub enum SpawnError { Agent(AgentFaultKind), Platform(SandboxError) }

/// Outcome of waiting for a line.
#[derive(Debug)]
pub enum ReadLine {
    /// without the newline
    Line { bytes: Vec<u8>, at: Instant },
    TooLong { head: Vec<u8> },
    TimedOut,
    /// end of output; the exit status follows from `end()`
    Closed,
}

/// A running agent. Dropping it kills and reaps the whole tree and removes cgroup and scratch.
#[derive(Debug)]
pub struct AgentProcess;
impl AgentProcess {
    pub fn spawn(spec: &SpawnSpec) -> Result<Self, SpawnError> { unimplemented!() }
    /// Writes all of `line` (which ends in \n) before the deadline; a closed pipe or a full pipe is the agent's doing.
    pub fn write_line(&mut self, line: &[u8], deadline: Instant) -> Result<Instant, WriteError> { unimplemented!() }
    pub fn read_line(&mut self, max_bytes: usize, deadline: Instant) -> Result<ReadLine, SandboxError> { unimplemented!() }
    /// Is there unread output already (an answer before the question)?
    pub fn has_pending_output(&mut self) -> Result<bool, SandboxError> { unimplemented!() }
    /// Why it ended, if it has ended by itself: exit, signal, or limit (memory: OOM kill seen by the cgroup).
    pub fn diagnose_end(&mut self, wait: Duration) -> Option<AgentFaultKind> { unimplemented!() }
    /// Last bytes of standard error, lossy UTF-8.
    pub fn stderr_tail(&self) -> String { unimplemented!() }
    /// CPU time of the whole tree so far, seconds; None where the host does not tell.
    pub fn cpu_time_s(&self) -> Option<f64> { unimplemented!() }
    /// Waits up to `grace` for exit, then kills the tree; always reaps.
    pub fn finish(self, grace: Duration) -> Result<Usage, SandboxError> { unimplemented!() }
}
#[derive(Debug, Clone, Default)]
pub struct Usage { pub peak_memory_bytes: Option<u64>, pub cpu_time_s: Option<f64>, pub stderr_tail: String, pub exit: Option<AgentFaultKind> }
#[derive(Debug)]
pub enum WriteError { Closed, TimedOut, Platform(SandboxError) }
