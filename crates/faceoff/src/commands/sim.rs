//! `faceoff sim`: the simulator alone, for comparison with other simulators, for other programs, and for measuring and checking it.

mod bench;
mod export;
mod golden;
mod kinematics;
mod scenario;
mod trace;

use clap::{Args, Subcommand};

/// Simulate open loop, export the model, measure the simulator, or check its bits.
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
    /// Read poses from standard input, write positions, Jacobian, mass matrix and bias, one JSON object a line
    ///
    /// Input, a line per pose: {"q": [7]} and optionally "dq": [7]; 9 numbers with the universal joint's, which
    /// are otherwise those that keep the mallet upright, at rest. SI units, robot's base frame. The answer has
    /// the controller's model, and under "plant" what moves.
    Kinematics,
    /// Write the ideal model of robot, table and puck for other programs: URDF, MJCF, Python
    Export(export::ExportArgs),
    /// Play the golden episodes and games and write their hashes, which are equal in every build of a ruleset
    ///
    /// tests/golden/simulator.txt in the sources has the hashes as they must be.
    Golden,
    /// Measure control steps and substeps per second on one core: a held arm, no agent process
    Bench(bench::BenchArgs),
}

impl SimCommand {
    /// Runs the simulator.
    ///
    /// # Errors
    /// If a scenario or a pose is not one, naming the field and what was expected; if reading or writing
    /// fails.
    pub fn run(self) -> anyhow::Result<()> {
        match self.what {
            What::Trace => trace::run(),
            What::Kinematics => kinematics::run(),
            What::Export(args) => args.run(),
            What::Golden => golden::run(),
            What::Bench(args) => args.run(),
        }
    }
}
