//! Recorded actions of the agent `striker`, or of one that holds still, in whole episodes, and worlds that replay them.

use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Episode, Interpolation, PerturbationSettings, Plant, SimdLevel,
    StepOutcome, env_info, model::INITIAL_Q, step_episodes_on,
};
use faceoff_types::Seed;
use striker::{Agent, Policy};

/// An episode at its start, and the action of each of its control steps.
#[derive(Clone)]
pub struct RecordedEpisode {
    start: Episode,
    actions: Vec<Vec<f64>>,
}

/// Records episodes that `striker` plays to their ends.
pub fn record_striker(
    task: AirHockeyTask,
    active_perturbations: ActivePerturbations,
    episodes: u32,
) -> Vec<RecordedEpisode> {
    (0..episodes)
        .map(|number| {
            let start = start_episode(task, active_perturbations, number);
            let mut agent = striker_for(task);
            let mut episode = start.clone();
            let mut actions = vec![];
            loop {
                let rows = agent.act(episode.observation()).expect("an observation");
                actions.push(rows.concat());
                if episode.step(&rows.concat()).end.is_some() {
                    return RecordedEpisode { start, actions };
                }
            }
        })
        .collect()
}

/// Records episodes in which the arm holds still, for at most `steps` control steps.
pub fn hold_still(
    task: AirHockeyTask,
    active_perturbations: ActivePerturbations,
    steps: u32,
    episodes: u32,
) -> Vec<RecordedEpisode> {
    let held = Interpolation::Cubic.hold_position(&INITIAL_Q);
    let action = held[..Interpolation::Cubic.len()].to_vec();
    (0..episodes)
        .map(|number| {
            let start = start_episode(task, active_perturbations, number);
            let mut episode = start.clone();
            let mut actions = vec![];
            while episode.steps() < steps {
                actions.push(action.clone());
                if episode.step(&action).end.is_some() {
                    break;
                }
            }
            RecordedEpisode { start, actions }
        })
        .collect()
}

/// The episode with this index, at its start.
fn start_episode(
    task: AirHockeyTask,
    active_perturbations: ActivePerturbations,
    number: u32,
) -> Episode {
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(0);
    let plant = Plant::for_perturbations(active_perturbations, &settings, seed.model_mismatch());
    let seed = seed.episode(task, number);
    Episode::new(
        task,
        Interpolation::Cubic,
        active_perturbations,
        &settings,
        &plant,
        seed,
    )
}

/// The agent `striker` at the start of an episode of a task.
fn striker_for(task: AirHockeyTask) -> Agent {
    let env = env_info(task);
    let radius = |radius: f64| striker::RadiusInfo { radius };
    let task = match task {
        AirHockeyTask::Hit => striker::Task::Hit,
        AirHockeyTask::Defend => striker::Task::Defend,
        AirHockeyTask::Prepare => striker::Task::Prepare,
    };
    let env = striker::Env {
        dt: env.dt,
        table: striker::TableInfo {
            length: env.table_length,
            width: env.table_width,
            goal_width: env.goal_width,
        },
        puck: radius(env.puck_radius),
        mallet: radius(env.mallet_radius),
        robot: striker::RobotInfo {
            ee_desired_height: env.ee_desired_height,
            joint_pos_limit: env.joint_pos_limit,
            joint_vel_limit: env.joint_vel_limit,
            base_frame: env
                .base_frame
                .into_iter()
                .map(striker::BaseFrame::Flat)
                .collect(),
        },
    };
    let mut agent = Agent::new(task, &env);
    agent.reset();
    agent
}

/// Worlds that replay recorded episodes in order. World `w` begins with episode `w`.
#[derive(Clone)]
pub struct ReplayingWorlds<'r> {
    recorded: &'r [RecordedEpisode],
    /// The index in `recorded` of each world's current episode.
    current: Vec<usize>,
    episodes: Vec<Episode>,
    outcomes: Vec<StepOutcome>,
}

impl<'r> ReplayingWorlds<'r> {
    /// Worlds at the start of their first episode.
    pub fn new(recorded: &'r [RecordedEpisode], count: usize) -> Self {
        let current: Vec<usize> = (0..count).map(|w| w % recorded.len()).collect();
        let mut first = recorded[0].start.clone();
        let outcome = first.step(&recorded[0].actions[0]);
        Self {
            episodes: current.iter().map(|&e| recorded[e].start.clone()).collect(),
            outcomes: vec![outcome; count],
            current,
            recorded,
        }
    }

    /// A control step of all worlds: at once with the instruction set `simd_level`, or one by one (`None`).
    pub fn step(&mut self, simd_level: Option<SimdLevel>) {
        let actions = self
            .current
            .iter()
            .zip(&self.episodes)
            .map(|(&e, episode)| {
                let actions = &self.recorded[e].actions;
                actions[episode.steps() as usize].as_slice()
            });
        match simd_level {
            Some(simd_level) => {
                let actions: Vec<&[f64]> = actions.collect();
                let mut episodes: Vec<&mut Episode> = self.episodes.iter_mut().collect();
                step_episodes_on(simd_level, &mut episodes, &actions, &mut self.outcomes);
            }
            None => {
                let actions: Vec<&[f64]> = actions.collect();
                for (w, episode) in self.episodes.iter_mut().enumerate() {
                    self.outcomes[w] = episode.step(actions[w]);
                }
            }
        }
        for (w, outcome) in self.outcomes.iter().enumerate() {
            if outcome.end.is_some() {
                self.current[w] = (self.current[w] + 1) % self.recorded.len();
                self.episodes[w] = self.recorded[self.current[w]].start.clone();
            }
        }
    }
}
