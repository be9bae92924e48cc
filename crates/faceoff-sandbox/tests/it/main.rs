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

mod network_access;
mod process_cleanup;
mod cpu_count;
mod no_sandbox;
mod exit_causes;
mod output_floods;
mod harness;
mod resource_limits;
mod channel_blocking;
mod images;
mod killed_service;
mod host_visibility;
mod cpu_limits;
mod process_limits;
mod covert_channels;
mod probe;
mod runtimes;
mod system_calls;
mod normal_operation;
mod file_writes;
