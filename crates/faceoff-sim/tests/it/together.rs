//! Episodes stepped together have the bits that they have alone, by every path.

use faceoff_sim::{
    Bounds, Episode, Interpolation, JOINTS, LanePath, PerturbationSettings, Plant, StepOutcome,
    golden::strike, model::INITIAL_Q, step_together, step_together_by,
};
use faceoff_types::{ACTION_LIMIT, EpisodeEnd, Factor, Factors, Seed, Task};

/// Without AVX there is one path less to test.
fn paths() -> Vec<LanePath> {
    [Some(LanePath::PLAIN), LanePath::avx()]
        .into_iter()
        .flatten()
        .collect()
}

/// The ruleset's own bounds are ten times as wide.
const NARROW: Bounds = Bounds {
    joint_rad_s: 100.0,
    ..Bounds::WIDE
};

/// What an agent does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Habit {
    Strikes,
    Holds,
    /// Drives its joints against their stops.
    Leans,
    /// Wants the world to break, from a step on.
    Breaks(u32),
}

/// An episode with its agent.
#[derive(Clone)]
struct Play {
    episode: Episode,
    habit: Habit,
    interpolation: Interpolation,
}

impl Play {
    fn new(task: Task, number: u32, factors: Factors, habit: Habit) -> Self {
        let settings = PerturbationSettings::default();
        let seed = Seed::from_number(u64::from(number));
        let plant = Plant::under(factors, &settings, seed.model_mismatch());
        let interpolation = match habit {
            Habit::Strikes => Interpolation::Cubic,
            Habit::Holds => Interpolation::Quintic,
            Habit::Leans => Interpolation::Linear,
            Habit::Breaks(_) => Interpolation::Trajectory,
        };
        let seed = seed.episode(task, number);
        let episode = Episode::new(task, interpolation, factors, &settings, &plant, seed);
        Self {
            episode: episode.within(NARROW),
            habit,
            interpolation,
        }
    }

    fn action(&self) -> Vec<f64> {
        let step = self.episode.steps();
        let held = self.interpolation.hold_position(&INITIAL_Q);
        let held = held[..self.interpolation.len()].to_vec();
        match self.habit {
            Habit::Strikes => strike(self.episode.observation(), step).to_vec(),
            Habit::Leans => held
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
            Habit::Breaks(from) if step >= from => {
                let velocities = &self.episode.observation()[13..20];
                let pushed = |i: usize| ACTION_LIMIT.copysign(velocities[i % JOINTS]);
                (0..held.len()).map(pushed).collect()
            }
            Habit::Holds | Habit::Breaks(_) => held,
        }
    }
}

/// Everything that can be seen of an episode, as bits where it is a number.
fn seen(episode: &Episode) -> (Vec<u64>, String) {
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
        numbers.extend(world.end_effector_before(robot));
    }
    let rest = format!("{:?} {:?}", episode.divergence(), episode.violations());
    (numbers.iter().map(|x| x.to_bits()).collect(), rest)
}

/// Plays all to their ends, together and each alone; what each ended as.
fn compare(path: LanePath, plays: Vec<Play>) -> Vec<EpisodeEnd> {
    let mut ends = vec![];
    let mut pairs: Vec<(Play, Play)> = plays.into_iter().map(|p| (p.clone(), p)).collect();
    while !pairs.is_empty() {
        let actions: Vec<Vec<f64>> = pairs.iter().map(|(play, _)| play.action()).collect();
        let actions: Vec<&[f64]> = actions.iter().map(Vec::as_slice).collect();
        let alone: Vec<StepOutcome> = pairs
            .iter_mut()
            .zip(&actions)
            .map(|((_, play), action)| play.episode.step(action))
            .collect();
        let mut together = alone.clone();
        together.rotate_left(1);
        let mut episodes: Vec<&mut Episode> = pairs
            .iter_mut()
            .map(|(play, _)| &mut play.episode)
            .collect();
        step_together_by(path, &mut episodes, &actions, &mut together);
        for ((ours, theirs), (a, b)) in pairs.iter().zip(together.iter().zip(&alone)) {
            let what = format!("{path:?}, {:?}, step {}", ours.habit, ours.episode.steps());
            assert_eq!(a, b, "{what}");
            assert!(seen(&ours.episode) == seen(&theirs.episode), "{what}");
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
fn episodes_that_meet_the_puck_are_the_same_together() {
    let singles = Factor::ALL.map(|factor| Factors::NONE.with(factor));
    for path in paths() {
        for factors in [Factors::NONE, Factors::ALL].into_iter().chain(singles) {
            // Seven arms of `hit` and ten others: sets that are full and sets that are not.
            let plays = (0..13).map(|number| {
                let task = Task::ALL[number as usize % 3];
                Play::new(task, number, factors, Habit::Strikes)
            });
            let ends = compare(path, plays.collect());
            let some = |end: EpisodeEnd| ends.contains(&end);
            assert!(some(EpisodeEnd::CrossedMiddle), "{factors:?}: {ends:?}");
        }
    }
}

#[test]
fn a_world_that_diverges_leaves_the_others_as_they_are() {
    for path in paths() {
        let habits = [
            Habit::Holds,
            Habit::Breaks(7),
            Habit::Leans,
            Habit::Breaks(3),
            Habit::Strikes,
        ];
        let plays = (0..15).map(|number| {
            let habit = habits[number as usize % habits.len()];
            let task = Task::ALL[number as usize / habits.len()];
            Play::new(task, number, Factors::ALL, habit)
        });
        let ends = compare(path, plays.collect());
        assert!(ends.contains(&EpisodeEnd::AgentFault), "{ends:?}");
        assert!(ends.contains(&EpisodeEnd::Horizon), "{ends:?}");
    }
}

#[test]
fn any_number_of_worlds_may_be_stepped() {
    for count in 0..6 {
        let held = Interpolation::Quintic.hold_position(&INITIAL_Q);
        let action = &held[..Interpolation::Quintic.len()];
        let play = |number| Play::new(Task::Prepare, number, Factors::NONE, Habit::Holds).episode;
        let mut episodes: Vec<Episode> = (0..count).map(play).collect();
        let mut outcomes = vec![play(0).step(action); count as usize];
        let mut all: Vec<&mut Episode> = episodes.iter_mut().collect();
        step_together(&mut all, &vec![action; count as usize], &mut outcomes);
        assert!(episodes.iter().all(|episode| episode.steps() == 1));
    }
}

#[test]
#[should_panic(expected = "expected an action for each episode")]
fn a_missing_action_is_refused() {
    let mut episode = Play::new(Task::Defend, 0, Factors::NONE, Habit::Holds).episode;
    step_together(&mut [&mut episode], &[], &mut []);
}
