//! The sandbox, attacked by real programs (`tests/agents`) on the real host. After each test no process,
//! mount, cgroup or file may be left.
//!
//! As root every layer must be available, or the tests fail. As an ordinary user the cgroup layers may be
//! missing; the tests then print what they cannot check.
#![expect(clippy::unwrap_used, reason = "a helper that fails fails its test")]
#![expect(
    clippy::print_stdout,
    reason = "a test prints what it cannot check on this host"
)]

mod channel_blocking;
mod covert_channels;
mod cpu_count;
mod cpu_limits;
mod exit_causes;
mod file_writes;
mod harness;
mod host_counters;
mod host_visibility;
mod images;
mod killed_service;
mod network_access;
mod no_sandbox;
mod normal_operation;
mod output_floods;
mod probe;
mod process_cleanup;
mod process_limits;
mod resource_limits;
mod runtimes;
mod system_calls;
mod system_use;
