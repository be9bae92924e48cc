use serde::{Deserialize, Serialize};

/// What an agent's process tree may use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Memory of the tree in bytes: anonymous, page cache, scratch files and swap together.
    pub memory_bytes: u64,
    /// Processes and threads alive at a time, the first one included.
    pub pids: u32,
    /// Size of the scratch folder `/tmp` in bytes; shared memory (`/dev/shm`) may be as large again.
    /// Both count as memory too.
    pub scratch_bytes: u64,
    /// Open file descriptors per process.
    pub open_files: u32,
    /// Largest single file in bytes.
    pub file_size_bytes: u64,
    /// CPU time per time: 1.0 = one CPU, enforced every 10 ms by the cgroup's quota.
    pub cpus: f64,
    /// How much of the end of standard error is kept, in bytes.
    pub stderr_tail_bytes: u64,
}

impl Default for Limits {
    /// Room for a Python agent with a small network on CPU; not for one that trains.
    fn default() -> Self {
        Self {
            memory_bytes: 2 << 30,
            pids: 128,
            scratch_bytes: 256 << 20,
            open_files: 1024,
            file_size_bytes: 256 << 20,
            cpus: 1.0,
            stderr_tail_bytes: 64 << 10,
        }
    }
}
