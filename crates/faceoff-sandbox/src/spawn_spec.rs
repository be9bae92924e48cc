//! The input of the sandbox: what to start, and how.

use crate::{Isolation, Limits, Runtime};
use std::{collections::BTreeMap, path::PathBuf};

/// Program, files, limits and isolation of an agent to start.
#[derive(Debug, Clone)]
pub struct SpawnSpec {
    /// The unpacked bundle, mounted read-only at `/agent` (the working directory). A service that runs
    /// as root starts agents as another user: folders in it need mode 0755, files 0644 or 0755. Its parent
    /// folders may be closed to other users, unless the namespaces layer is disabled.
    pub bundle_dir: PathBuf,
    /// Program and arguments. A program with a slash is relative to the bundle; otherwise it is searched in
    /// the runtime's PATH.
    pub command: Vec<String>,
    /// Environment variables of the bundle; they may replace `HOME`, `PATH` and the like.
    pub env: BTreeMap<String, String>,
    /// Is the agent's standard output part of its log? Then the protocol uses the file descriptors 3 (questions) and 4 (answers), and
    /// standard input is empty.
    pub logs_output: bool,
    /// The visible files of the host; for a container image its root, whose folder `agent` is the bundle.
    pub runtime: Runtime,
    /// Resources that the process tree may use.
    pub limits: Limits,
    pub isolation: Isolation,
    /// Numbers of the CPUs on which the agent may run; empty: those of the service.
    pub cpus: Vec<usize>,
}
