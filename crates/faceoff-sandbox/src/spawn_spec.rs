use crate::{Isolation, Limits, Runtime};
use std::{collections::BTreeMap, path::PathBuf};

/// What to start and how.
#[derive(Debug, Clone)]
pub struct SpawnSpec {
    /// The unpacked bundle, mounted read-only at `/agent` (the working directory). A service that runs
    /// as root starts agents as another user: folders in it need mode 0755, files 0644 or 0755. The way
    /// to it may be closed to others, unless namespaces are given up.
    pub bundle_dir: PathBuf,
    /// Program and arguments. A program with a slash is relative to the bundle, else it is searched in
    /// the runtime's PATH.
    pub command: Vec<String>,
    /// Environment variables of the bundle; they come last and may replace `HOME`, `PATH` and the like.
    pub env: BTreeMap<String, String>,
    /// What of the host is visible; of a container image, its root, whose `agent` is then the bundle.
    pub runtime: Runtime,
    /// What the tree may use.
    pub limits: Limits,
    pub isolation: Isolation,
    /// CPU numbers the agent may run on; empty = those of the service.
    pub cpus: Vec<usize>,
}
