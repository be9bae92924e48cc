//! Runs one agent as a child process that can do nothing but think: spawn, talk in lines, kill, measure.
//!
//! The layers, each of which an organiser may give up by name ([`Isolation`]), none silently:
//! bubblewrap (namespaces, read-only files, no capabilities), a seccomp filter, cgroup limits on
//! memory, processes and CPU time (v1 and v2, also side by side), and resource limits.
//! When the service is root, an agent never is: it gets a user id of its own.
//!
//! What this crate refuses to do: it does not parse what an agent says, it decides no verdict, and it
//! never turns a failure of the host into a fault of the agent or the other way round
//! ([`SandboxError`] and [`faceoff_types::AgentFaultKind`] are different types on purpose).

pub mod affinity;
mod agent_user;
mod bubblewrap;
mod cgroup;
mod channel;
mod child_setup;
mod command_check;
mod cpu_clock;
mod cpu_counters;
mod cpu_evidence;
mod cpu_view;
mod cpu_waits;
mod end;
mod error;
mod isolation;
mod killer;
mod line_socket;
mod memory_image;
mod next_look;
mod output_holders;
mod own_wait;
mod owner;
mod passed_files;
mod prepared;
mod private_mounts;
mod probe;
mod process;
mod process_tree;
mod runtime;
mod sched_stat;
mod seccomp;
mod spawn_spec;
mod spawner;
mod status_pipe;
mod stderr_tail;
mod sweep;

pub use cpu_evidence::{CpuReading, Glance, Looks, Taken};
pub use cpu_waits::AnswerState;
pub use error::{SandboxError, SpawnError, WriteError};
pub use faceoff_types::ResourceLimits as Limits;
pub use isolation::{Isolation, Layer};
pub use killer::Killer;
pub use line_socket::ReadLine;
pub use memory_image::{MEMORY, MemoryImage, NoImage};
pub use own_wait::OwnWait;
pub use probe::{HostFeature, probe_host};
pub use process::{AgentProcess, Usage};
pub use runtime::{Runtime, RuntimeFiles};
pub use spawn_spec::SpawnSpec;
pub use sweep::sweep_stale;
