//! `faceoff sim bench`: measures the speed of the simulator on one core, in *control steps*, in which an agent acts once, and in
//! *substeps* of the physics, into which they are divided.

use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use faceoff_airhockey::SimulationSetup;
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    AirHockeyProfile, Command, Game, GameSetup, Interpolation, PerturbationSettings, Plant,
    SUBSTEPS, model::INITIAL_Q,
};
use faceoff_types::{Seed, WINDOW_STEPS};
use serde::Serialize;
use std::{
    hint::black_box,
    io::Write as _,
    time::{Duration, Instant},
};

/// Measures the simulator on one core, including controller, constraints and observation.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// hit (two robots), defend, prepare, or tournament (two robots with an agent each).
    #[arg(long)]
    task: BenchTask,
    /// Episodes of at most 500 control steps; in a tournament, windows of 500.
    #[arg(long, default_value_t = 20)]
    episodes: u32,
    /// Perturbations.
    #[arg(long, default_value_t = AirHockeyProfile::Ideal)]
    profile: AirHockeyProfile,
    /// Seed of the episodes.
    #[arg(long, default_value = "0")]
    seed: Seed,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// How the robot interpolates between the actions of the agent that holds still.
const HOLD_INTERPOLATION: Interpolation = Interpolation::Cubic;

#[derive(Debug, Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum BenchTask {
    Hit,
    Defend,
    Prepare,
    Tournament,
}

impl BenchTask {
    const fn name(self) -> &'static str {
        match self {
            Self::Hit => "hit",
            Self::Defend => "defend",
            Self::Prepare => "prepare",
            Self::Tournament => "tournament",
        }
    }

    fn task(self) -> Option<AirHockeyTask> {
        match self {
            Self::Hit => Some(AirHockeyTask::Hit),
            Self::Defend => Some(AirHockeyTask::Defend),
            Self::Prepare => Some(AirHockeyTask::Prepare),
            Self::Tournament => None,
        }
    }
}

#[derive(Debug, Serialize)]
struct Report {
    task: BenchTask,
    profile: AirHockeyProfile,
    episodes: u32,
    control_steps: u64,
    seconds: f64,
    control_steps_per_s: f64,
    substeps_per_s: f64,
}

impl BenchArgs {
    /// Runs the episodes with agents that hold still and prints the speed.
    pub fn run(self) -> Result<()> {
        ensure!(self.episodes > 0, "--episodes: expected at least 1, got 0");
        let (control_steps, time) = match self.task.task() {
            Some(task) => self.play_episodes(task),
            None => self.play_game(),
        };
        let seconds = time.as_secs_f64();
        let control_steps_per_s = control_steps as f64 / seconds;
        let report = Report {
            task: self.task,
            profile: self.profile,
            episodes: self.episodes,
            control_steps,
            seconds,
            control_steps_per_s,
            substeps_per_s: control_steps_per_s * SUBSTEPS as f64,
        };
        let mut out = std::io::stdout().lock();
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&report)?)?;
        } else {
            writeln!(
                out,
                "{} ({}): {} episodes, {control_steps} control steps in {seconds:.3} s: \
                 {control_steps_per_s:.0} control steps/s, {:.0} substeps/s",
                self.task.name(),
                self.profile,
                self.episodes,
                report.substeps_per_s
            )?;
        }
        Ok(())
    }

    /// Runs the episodes of a task; returns the number of control steps and the time they took.
    fn play_episodes(&self, task: AirHockeyTask) -> (u64, Duration) {
        let setup = SimulationSetup::new(self.profile, self.seed, self.seed.model_mismatch());
        let action = HOLD_INTERPOLATION.hold_position(&INITIAL_Q);
        let action = &action[..HOLD_INTERPOLATION.len()];
        let (mut steps, mut time) = (0, Duration::ZERO);
        for index in 0..self.episodes {
            let start = Instant::now();
            let mut episode = setup.episode(task, index, HOLD_INTERPOLATION);
            while episode.step(black_box(action)).end.is_none() {
                black_box(episode.observation());
            }
            time += start.elapsed();
            steps += u64::from(episode.steps());
        }
        (steps, time)
    }

    /// Runs a game with as many windows as there are episodes; returns as [`play_episodes`](Self::play_episodes).
    fn play_game(&self) -> (u64, Duration) {
        let (active_perturbations, settings) = (
            self.profile.active_perturbations(),
            PerturbationSettings::default(),
        );
        let setup = GameSetup {
            interpolation: [HOLD_INTERPOLATION; 2],
            active_perturbations,
            plant: Plant::for_perturbations(
                active_perturbations,
                &settings,
                self.seed.model_mismatch(),
            ),
            settings,
            seed: self.seed,
        };
        let action = HOLD_INTERPOLATION.hold_position(&INITIAL_Q);
        let action = &action[..HOLD_INTERPOLATION.len()];
        let steps = u64::from(self.episodes) * u64::from(WINDOW_STEPS);
        let start = Instant::now();
        let mut game = Game::new(setup);
        for _ in 0..steps {
            black_box(game.step([Command::Act(black_box(action)); 2]));
            black_box((game.observation(0), game.observation(1)));
        }
        (steps, start.elapsed())
    }
}
