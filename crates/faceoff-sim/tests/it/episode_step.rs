//! Episodes that are stepped at once, with SIMD instructions, have the same bits as those that are stepped alone, with every instruction
//! set. `ActivePerturbations` are those of an episode, such as noise. The *universal joint* is the two hinges on which the mallet hangs.

use faceoff_sim::AirHockeyTask;
use faceoff_sim::episode::ends::CROSSED_MIDDLE;
use faceoff_sim::{
    ActivePerturbations, Bounds, Episode, Interpolation, JOINTS, Perturbation,
    PerturbationSettings, Plant, SimdLevel, StepOutcome, golden::scripted_action, model::INITIAL_Q,
    step_episodes, step_episodes_on,
};
use faceoff_types::{ACTION_LIMIT, EpisodeEnd, Seed};

/// All instruction sets of this machine.
fn simd_levels() -> Vec<SimdLevel> {
    [Some(SimdLevel::PLAIN), SimdLevel::avx()]
        .into_iter()
        .flatten()
        .collect()
}

/// Narrow bounds of the simulation, so that worlds *diverge* (stop, since their state would leave the bounds). The ruleset's bounds are ten
/// times as wide.
const NARROW: Bounds = Bounds {
    joint_rad_s: 100.0,
    ..Bounds::WIDE
};

/// Behaviour of an agent.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Habit {
    /// Moves the mallet through the puck.
    Strikes,
    /// Holds its initial position.
    Holds,
    /// Drives its joints against their stops, the ends of their range.
    DrivesToStops,
    /// Commands extreme numbers from this step on, so that the world diverges.
    DivergesFrom(u32),
}

/// An episode with its agent.
#[derive(Clone)]
struct EpisodeWithAgent {
    episode: Episode,
    habit: Habit,
    interpolation: Interpolation,
}

impl EpisodeWithAgent {
    /// `number` is both the seed and the index of the episode.
    fn new(
        task: AirHockeyTask,
        number: u32,
        active_perturbations: ActivePerturbations,
        habit: Habit,
    ) -> Self {
        let settings = PerturbationSettings::default();
        let seed = Seed::from_number(u64::from(number));
        let plant =
            Plant::for_perturbations(active_perturbations, &settings, seed.model_mismatch());
        let interpolation = match habit {
            Habit::Strikes => Interpolation::Cubic,
            Habit::Holds => Interpolation::Quintic,
            Habit::DrivesToStops => Interpolation::Linear,
            Habit::DivergesFrom(_) => Interpolation::Trajectory,
        };
        let seed = seed.episode(task, number);
        let episode = Episode::new(
            task,
            interpolation,
            active_perturbations,
            &settings,
            &plant,
            seed,
        );
        Self {
            episode: episode.with_bounds(NARROW),
            habit,
            interpolation,
        }
    }

    fn action(&self) -> Vec<f64> {
        let step = self.episode.steps();
        let held = self.interpolation.hold_position(&INITIAL_Q);
        let held = held[..self.interpolation.len()].to_vec();
        match self.habit {
            Habit::Strikes => scripted_action(self.episode.observation(), step).to_vec(),
            Habit::DrivesToStops => held
                .iter()
                .enumerate()
                .map(|(i, q)| {
                    if i < JOINTS {
                        q + 0.2 * f64::from(step)
                    } else {
                        *q
                    }
                })
                .collect(),
            Habit::DivergesFrom(first_step) if step >= first_step => {
                let velocities = &self.episode.observation()[13..20];
                let pushed = |i: usize| ACTION_LIMIT.copysign(velocities[i % JOINTS]);
                (0..held.len()).map(pushed).collect()
            }
            Habit::Holds | Habit::DivergesFrom(_) => held,
        }
    }
}

/// The whole visible state of an episode, numbers as bits.
fn snapshot(episode: &Episode) -> (Vec<u64>, String) {
    let state = episode.state();
    let world = episode.world();
    let mut numbers = episode.observation().to_vec();
    numbers.extend(state.puck);
    numbers.extend(state.q.iter().chain(&state.dq).chain(&state.dq_filtered));
    numbers.extend(state.universal.iter().chain(&state.ee));
    for robot in 0..world.robots() {
        numbers.extend(world.torques(robot));
        numbers.extend(world.universal(robot));
        numbers.extend(world.joint_velocities(robot));
        // The position before the last substep (1 ms of physics), which the opponent observes.
        numbers.extend(world.end_effector_before(robot));
    }
    let rest = format!("{:?} {:?}", episode.divergence(), episode.violations());
    (numbers.iter().map(|x| x.to_bits()).collect(), rest)
}

/// Runs all episodes to their ends, at once and each alone, and compares them after each step; returns the reasons of their ends.
fn compare_with_alone(simd_level: SimdLevel, plays: Vec<EpisodeWithAgent>) -> Vec<EpisodeEnd> {
    let mut ends = vec![];
    // Each episode twice: the first is stepped at once with the others, the second alone.
    let mut pairs: Vec<(EpisodeWithAgent, EpisodeWithAgent)> =
        plays.into_iter().map(|p| (p.clone(), p)).collect();
    while !pairs.is_empty() {
        let actions: Vec<Vec<f64>> = pairs.iter().map(|(play, _)| play.action()).collect();
        let actions: Vec<&[f64]> = actions.iter().map(Vec::as_slice).collect();
        let alone: Vec<StepOutcome> = pairs
            .iter_mut()
            .zip(&actions)
            .map(|((_, play), action)| play.episode.step(action))
            .collect();
        // The buffer for the outcomes starts with wrong ones, which the step must replace.
        let mut at_once = alone.clone();
        at_once.rotate_left(1);
        let mut episodes: Vec<&mut Episode> = pairs
            .iter_mut()
            .map(|(play, _)| &mut play.episode)
            .collect();
        step_episodes_on(simd_level, &mut episodes, &actions, &mut at_once);
        for ((grouped, single), (grouped_outcome, single_outcome)) in
            pairs.iter().zip(at_once.iter().zip(&alone))
        {
            let label = format!(
                "{simd_level:?}, {:?}, step {}",
                grouped.habit,
                grouped.episode.steps()
            );
            assert_eq!(grouped_outcome, single_outcome, "{label}");
            assert!(
                snapshot(&grouped.episode) == snapshot(&single.episode),
                "{label}"
            );
        }
        let mut ended = alone.iter().map(|outcome| outcome.end);
        pairs.retain(|_| match ended.next().flatten() {
            Some(end) => {
                ends.push(end);
                false
            }
            None => true,
        });
    }
    ends
}

#[test]
fn episodes_with_contacts_are_the_same_at_once() {
    let singles =
        Perturbation::EVALUATION.map(|perturbation| ActivePerturbations::NONE.with(perturbation));
    for simd_level in simd_levels() {
        for active_perturbations in [ActivePerturbations::NONE, ActivePerturbations::EVALUATION]
            .into_iter()
            .chain(singles)
        {
            // 13 episodes fill some groups of lanes, and the last ones partly.
            let plays = (0..13).map(|number| {
                let task = AirHockeyTask::ALL[number as usize % 3];
                EpisodeWithAgent::new(task, number, active_perturbations, Habit::Strikes)
            });
            let ends = compare_with_alone(simd_level, plays.collect());
            assert!(
                ends.contains(&CROSSED_MIDDLE),
                "{active_perturbations:?}: {ends:?}"
            );
        }
    }
}

#[test]
fn diverging_world_does_not_change_the_others() {
    for simd_level in simd_levels() {
        let habits = [
            Habit::Holds,
            Habit::DivergesFrom(7),
            Habit::DrivesToStops,
            Habit::DivergesFrom(3),
            Habit::Strikes,
        ];
        let plays = (0..15).map(|number| {
            let habit = habits[number as usize % habits.len()];
            let task = AirHockeyTask::ALL[number as usize / habits.len()];
            EpisodeWithAgent::new(task, number, ActivePerturbations::EVALUATION, habit)
        });
        let ends = compare_with_alone(simd_level, plays.collect());
        assert!(ends.contains(&EpisodeEnd::AGENT_FAULT), "{ends:?}");
        assert!(ends.contains(&EpisodeEnd::HORIZON), "{ends:?}");
    }
}

#[test]
fn step_accepts_any_number_of_worlds() {
    for count in 0..6 {
        let held = Interpolation::Quintic.hold_position(&INITIAL_Q);
        let action = &held[..Interpolation::Quintic.len()];
        let holding = |number| {
            EpisodeWithAgent::new(
                AirHockeyTask::Prepare,
                number,
                ActivePerturbations::NONE,
                Habit::Holds,
            )
            .episode
        };
        let mut episodes: Vec<Episode> = (0..count).map(holding).collect();
        let mut outcomes = vec![holding(0).step(action); count as usize];
        let mut all: Vec<&mut Episode> = episodes.iter_mut().collect();
        step_episodes(&mut all, &vec![action; count as usize], &mut outcomes);
        assert!(episodes.iter().all(|episode| episode.steps() == 1));
    }
}

#[test]
#[should_panic(expected = "expected an action for each episode")]
fn missing_action_panics() {
    let mut episode = EpisodeWithAgent::new(
        AirHockeyTask::Defend,
        0,
        ActivePerturbations::NONE,
        Habit::Holds,
    )
    .episode;
    step_episodes(&mut [&mut episode], &[], &mut []);
}
