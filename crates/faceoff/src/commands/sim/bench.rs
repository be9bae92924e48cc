//! `faceoff sim bench`: how fast the simulator is on one core.

use anyhow::{Result, ensure};
use clap::Args;
use faceoff_sim::{
    Episode, Interpolation, JOINTS, PerturbationSettings, Plant, SUBSTEPS, robot::model::INITIAL_Q,
};
use faceoff_types::{Profile, Seed, Task};
use std::{
    hint::black_box,
    io::Write as _,
    time::{Duration, Instant},
};

/// Measure the simulator on one core: controller, constraints and observation included.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// hit (two robots), defend or prepare.
    #[arg(long)]
    task: Task,
    /// Episodes of at most 500 control steps.
    #[arg(long, default_value_t = 20)]
    episodes: u32,
    /// Perturbations.
    #[arg(long, default_value_t = Profile::Ideal)]
    profile: Profile,
    /// Seed of the episodes.
    #[arg(long, default_value = "0")]
    seed: Seed,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

impl BenchArgs {
    /// Plays the episodes with an agent that holds still and prints the speed.
    pub fn run(self) -> Result<()> {
        ensure!(self.episodes > 0, "--episodes: expected at least 1, got 0");
        let settings = PerturbationSettings::default();
        let plant = match self.profile {
            Profile::Ideal => Plant::nominal(),
            _ => Plant::mismatched(&settings, self.seed.model_mismatch()),
        };
        let mut hold = [0.0; 2 * JOINTS];
        hold[..JOINTS].copy_from_slice(&INITIAL_Q);
        let (mut steps, mut time) = (0u64, Duration::ZERO);
        for index in 0..self.episodes {
            let start = Instant::now();
            let mut episode = Episode::new(
                self.task,
                Interpolation::Cubic,
                self.profile.factors(),
                &settings,
                &plant,
                self.seed.episode(self.task, index),
            );
            while episode.step(black_box(&hold)).end.is_none() {
                black_box(episode.observation());
            }
            time += start.elapsed();
            steps += u64::from(episode.steps());
        }
        let seconds = time.as_secs_f64();
        let steps_per_s = steps as f64 / seconds;
        let substeps_per_s = steps_per_s * SUBSTEPS as f64;
        let mut out = std::io::stdout().lock();
        if self.json {
            let report = serde_json::json!({
                "task": self.task,
                "profile": self.profile,
                "episodes": self.episodes,
                "control_steps": steps,
                "seconds": seconds,
                "control_steps_per_s": steps_per_s,
                "substeps_per_s": substeps_per_s,
            });
            writeln!(out, "{report}")?;
        } else {
            writeln!(
                out,
                "{} ({}): {} episodes, {steps} control steps in {seconds:.3} s: \
                 {steps_per_s:.0} control steps/s, {substeps_per_s:.0} substeps/s",
                self.task, self.profile, self.episodes
            )?;
        }
        Ok(())
    }
}
