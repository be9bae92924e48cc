//! `faceoff sim`: the simulator alone, for comparison with other simulators and for measuring it.

mod bench;
mod scenario;
mod trace;

use clap::{Args, Subcommand};

/// Simulate open loop, or measure the simulator.
#[derive(Debug, Args)]
pub struct SimCommand {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Read one scenario (JSON) from standard input, write its states as JSON lines
    ///
    /// Input: {"puck": [x, y, yaw, vx, vy, yaw rate], "duration_ms": 160} and optionally "task",
    /// "profile", "seed", "robots", "joints", "interpolation", "actions", "mallet" and "every_ms".
    /// SI units, table frame.
    Trace,
    /// Measure control steps and substeps per second on one core: a held arm, no agent process
    Bench(bench::BenchArgs),
}

impl SimCommand {
    /// Runs the simulator.
    ///
    /// # Errors
    /// If the scenario is not one, naming the field and what was expected; if reading or writing
    /// fails.
    pub fn run(self) -> anyhow::Result<()> {
        match self.what {
            What::Trace => trace::run(),
            What::Bench(args) => args.run(),
        }
    }
}
