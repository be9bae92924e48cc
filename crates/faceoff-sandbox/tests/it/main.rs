//! The sandbox, attacked by real programs (`tests/agents`) on the real host. After each of them no
//! process, mount, cgroup or file may be left.
//!
//! As root every layer must be there, or the tests fail. As an ordinary user the cgroup layers may be
//! missing; what then cannot be shown is printed.
#![expect(clippy::unwrap_used, reason = "a helper that fails fails its test")]
#![expect(
    clippy::print_stdout,
    reason = "a test says what it cannot show on this host"
)]

mod calls_out;
mod clings;
mod counts_cpus;
mod developer;
mod ends;
mod floods;
mod harness;
mod hoards;
mod holds;
mod images;
mod killed_service;
mod looks_around;
mod moves_cpu;
mod multiplies;
mod notice_board;
mod probe;
mod runtimes;
mod system_calls;
mod well_behaved;
mod writes_around;
