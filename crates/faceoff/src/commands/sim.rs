//! `faceoff sim`: the simulator alone, for comparisons, exports and measurements. In a *control step* an agent acts once; it is
//! divided into *substeps* of the physics.

mod bench;
mod constraints;
mod export;
mod golden;
mod kinematics;
mod scenario;
mod trace;

use clap::{Args, Subcommand};

/// Runs the simulator alone: open-loop simulation, model export, benchmark and golden hashes.
#[derive(Debug, Args)]
pub struct SimCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Read one scenario (JSON) from standard input, write its states as JSON lines
    ///
    /// Input: {"puck": [x, y, yaw, vx, vy, yaw rate], "duration_ms": 160}, and optionally "task",
    /// "profile", "seed", "robots", "joints", "interpolation", "actions", "mallet" and "every_ms".
    /// SI units, table frame.
    Trace,
    /// Read poses from standard input, write positions, Jacobian, mass matrix and bias, one JSON object per line
    ///
    /// Input, one line per pose: {"q": [7 joint positions]} and optionally "dq": [7 joint velocities], or 9 numbers
    /// with the universal joint. By default, the universal joint keeps the mallet upright, at rest. SI units, base
    /// frame of the robot. The output has the controller's model, and the simulated one under "plant".
    Kinematics,
    /// Write the ideal model of robot, table and puck for other programs: URDF, MJCF, Python
    Export(export::ExportArgs),
    /// Run the golden episodes and games and write their hashes, which are equal in every build of a ruleset
    ///
    /// The expected hashes are in tests/golden/simulator.txt of the sources.
    Golden,
    /// Measure control steps and substeps per second on one core, with an arm that holds still and no agent process
    Bench(bench::BenchArgs),
}

impl SimCommand {
    /// Runs the simulator.
    ///
    /// # Errors
    /// If a scenario or a pose is invalid (the error names the field and what was expected), or reading or writing
    /// fails.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::Trace => trace::run(),
            Action::Kinematics => kinematics::run(),
            Action::Export(args) => args.run(),
            Action::Golden => golden::run(),
            Action::Bench(args) => args.run(),
        }
    }
}
