//! Runs one agent as an isolated child process: spawn, exchange lines, kill, measure.
//!
//! An organiser can disable each layer by name ([`Isolation`]); no layer is skipped silently. The layers:
//! bubblewrap (namespaces, read-only files, no capabilities), a seccomp filter, cgroup limits on
//! memory, processes and CPU time (v1 and v2, also side by side), and resource limits.
//! When the process that uses this crate (in messages: the *service*) is root, an agent never is: it gets a user id of its own.
//!
//! This crate does not parse an agent's output and does not decide a verdict. It never turns a platform
//! fault into an agent fault or the other way round
//! ([`SandboxError`] and [`faceoff_types::AgentFaultKind`] are different types on purpose).

pub mod affinity;
mod agent_user;
mod answered_calls;
mod bounded_log;
mod bubblewrap;
mod bubblewrap_program;
mod call_listener;
mod caller;
mod cgroup;
mod channel;
mod child_setup;
mod command_check;
mod cpu_accounting;
mod cpu_clock;
mod cpu_counters;
mod cpu_numbers;
mod cpu_view;
mod dead_services;
mod error;
mod evaluator_counters;
mod exit_cause;
mod fd_passing;
mod file_locks;
mod file_tree;
mod isolation;
mod killer;
mod launch;
mod layer_advice;
mod line_socket;
mod memory_image;
mod memory_view;
mod open_output;
mod output_check_schedule;
mod owner;
mod private_mounts;
mod private_network;
mod probe;
mod process;
mod process_tree;
mod program_file;
mod protocol_descriptors;
mod route_sockets;
mod runtime;
mod runtime_links;
mod sched_stat;
mod seccomp;
mod session_numbers;
mod spawn_spec;
mod spawner;
mod status_pipe;
mod stderr_log;
mod thread_waits;

pub use bounded_log::BoundedLog;
pub use bubblewrap::HOSTS;
pub use cpu_accounting::{CounterBaseline, CpuReading, CpuSamples, HostInterference};
pub use dead_services::remove_remains_of_dead_services;
pub use error::{SandboxError, SpawnError, WriteError};
pub use evaluator_counters::EvaluatorCounters;
pub use faceoff_types::ResourceLimits as Limits;
pub use isolation::{Isolation, Layer};
pub use killer::Killer;
pub use line_socket::ReadLine;
pub use memory_image::{MEMORY_FOLDER, MemoryImage, MemoryImageError};
pub use probe::{LayerProbe, probe_host, unavailable_layers};
pub use process::{AgentProcess, Usage};
pub use protocol_descriptors::reserve_protocol_descriptors;
pub use runtime::{Runtime, RuntimeFiles};
pub use runtime_links::HiddenTarget;
pub use spawn_spec::SpawnSpec;
pub use thread_waits::AnswerState;
