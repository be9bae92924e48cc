//! *Hostile* agents, which try to break the simulation by extreme commands: all numbers stay finite, and if the world *diverges* (its state
//! would leave the bounds of the simulation), the hostile agent is at fault.

use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Bounds, Command, Episode, Game, GameSetup, Interpolation, JOINTS,
    PerturbationSettings, Plant, RallyEnd, model::INITIAL_Q, stream::RandomStream,
};
use faceoff_types::{ACTION_LIMIT, EpisodeEnd, Seed};

/// Pattern of the numbers in an agent's actions.
#[derive(Debug, Clone, Copy)]
enum Habit {
    /// All numbers are the same.
    Constant,
    /// All numbers of an action are the same; the sign changes with each step.
    AlternatingSteps,
    /// The sign changes with each number and each step.
    AlternatingNumbers,
    /// Only one kind of row (position, velocity, acceleration) is large, its sign changing each step;
    /// the others hold.
    OneRow(usize),
    /// Drawn at random: signs and powers of ten, including underflow. (The variants' names seed the random numbers.)
    Drawn,
    /// Repeatedly twenty steps of rest, and one step with large numbers of alternating sign.
    Bursts,
    /// Each number has the sign of its joint's current velocity, so that motion is amplified.
    Amplifying,
}

const HABITS: [Habit; 9] = [
    Habit::Constant,
    Habit::AlternatingSteps,
    Habit::AlternatingNumbers,
    Habit::OneRow(0),
    Habit::OneRow(1),
    Habit::OneRow(2),
    Habit::Drawn,
    Habit::Bursts,
    Habit::Amplifying,
];

/// All interpolations of actions that an agent may choose in its protocol message `ready`, by their codes.
fn interpolations() -> impl Iterator<Item = Interpolation> {
    let codes = [1, 2, 3, 4, 5, -1].map(Some).into_iter().chain([None]);
    codes.map(|code| Interpolation::from_code(code).unwrap())
}

/// An action with numbers up to `size` in magnitude. `observation` is the agent's.
fn action(
    habit: Habit,
    size: f64,
    interpolation: Interpolation,
    step: u32,
    observation: &[f64],
    stream: &mut RandomStream,
) -> Vec<f64> {
    // Observed joint positions (rad) and velocities (rad/s).
    let (q, dq) = (&observation[6..13], &observation[13..20]);
    let held: [f64; JOINTS] = std::array::from_fn(|i| q[i]);
    let held = interpolation.hold_position(&held);
    let alternating = |n: usize| if n.is_multiple_of(2) { size } else { -size };
    (0..interpolation.len())
        .map(|i| {
            let number = match habit {
                Habit::Constant => size,
                Habit::AlternatingSteps => alternating(step as usize),
                Habit::AlternatingNumbers => alternating(i + step as usize),
                Habit::OneRow(row) if i / JOINTS % 3 == row => alternating(step as usize),
                Habit::OneRow(_) => held[i],
                Habit::Drawn => {
                    let exponent = stream.uniform(-330.0, 4.0).max(stream.uniform(-330.0, 4.0));
                    let sign = if stream.unit() < 0.5 { -1.0 } else { 1.0 };
                    sign * libm::pow(10.0, exponent) * size / ACTION_LIMIT
                }
                Habit::Bursts if step % 21 == 20 => alternating(i),
                Habit::Bursts => held[i],
                Habit::Amplifying => size.copysign(dq[i % JOINTS]),
            };
            assert!(number.abs() <= ACTION_LIMIT);
            number
        })
        .collect()
}

fn assert_finite(label: &str, numbers: &[f64]) {
    assert!(
        numbers.iter().all(|x| x.is_finite()),
        "{label}: {numbers:?}"
    );
}

/// Plays an episode of at most 121 steps. Checks that all numbers are finite, and that a divergence ends the episode as the agent's fault.
/// Returns whether the world diverged.
fn play_and_check(
    bounds: Bounds,
    plant: &Plant,
    task: AirHockeyTask,
    interpolation: Interpolation,
    habit: Habit,
    size: f64,
) -> bool {
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(11); // arbitrary, as all seeds in this file
    let mut episode = Episode::new(
        task,
        interpolation,
        ActivePerturbations::EVALUATION,
        &settings,
        plant,
        seed.episode(task, 0),
    )
    .with_bounds(bounds);
    let label = format!("{task}, interpolation {interpolation}, {habit:?}, {size}");
    let mut stream = RandomStream::new(&seed, &label);
    loop {
        assert_finite(&label, episode.observation());
        let step = episode.steps();
        let observation = episode.observation();
        let action = action(habit, size, interpolation, step, observation, &mut stream);
        let outcome = episode.step(&action);
        let state = episode.state();
        assert_finite(&label, episode.observation());
        assert_finite(&label, &state.puck);
        assert_finite(&label, &state.q);
        assert_finite(&label, &state.dq);
        let c = outcome.constraints;
        assert_finite(&label, &[c.joint_pos, c.joint_vel, c.ee, c.link]);
        let divergence = episode.divergence();
        assert_eq!(
            divergence.is_some(),
            outcome.end == Some(EpisodeEnd::AGENT_FAULT),
            "{label}"
        );
        if let Some(divergence) = divergence {
            assert_eq!(
                divergence.robots_at_fault,
                [true, false],
                "{label}: {divergence:?}"
            );
        }
        if outcome.end.is_some() || step >= 120 {
            return divergence.is_some();
        }
    }
}

/// Bounds that many commands exceed, so that the tests cover divergence. The ruleset's bounds are ten times as
/// wide.
const NARROW: Bounds = Bounds {
    joint_rad_s: 100.0,
    ..Bounds::WIDE
};

#[test]
fn episodes_stay_finite_for_hostile_commands() {
    let settings = PerturbationSettings::default();
    let mismatch_seed = Seed::from_number(11).model_mismatch();
    let plant = Plant::for_perturbations(ActivePerturbations::EVALUATION, &settings, mismatch_seed);
    let count = |bounds: Bounds| {
        let (mut diverged, mut played) = (0, 0);
        for task in AirHockeyTask::ALL {
            for interpolation in interpolations() {
                for habit in HABITS {
                    // The protocol's limit, and a size near the limits of joint positions and velocities.
                    for size in [ACTION_LIMIT, 30.0] {
                        if play_and_check(bounds, &plant, task, interpolation, habit, size) {
                            diverged += 1;
                        } else {
                            played += 1;
                        }
                    }
                }
            }
        }
        println!("{bounds:?}: {diverged} worlds diverged, {played} did not");
        (diverged, played)
    };
    let (diverged, played) = count(NARROW);
    // Both cases must occur, or the test proves nothing.
    assert!(diverged > 0 && played > 0);
    assert!(count(Bounds::WIDE).1 > played);
}

#[test]
fn divergence_in_a_game_names_the_hostile_robot() {
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(12);
    let plant = Plant::for_perturbations(
        ActivePerturbations::EVALUATION,
        &settings,
        seed.model_mismatch(),
    );
    let mut diverged_rallies = 0;
    for interpolation in interpolations() {
        for habit in HABITS {
            for hostile in 0..2 {
                let mut game = Game::new(GameSetup {
                    interpolation: [interpolation; 2],
                    active_perturbations: ActivePerturbations::EVALUATION,
                    plant: plant.clone(),
                    settings: settings.clone(),
                    seed,
                })
                .with_bounds(NARROW);
                let label = format!("interpolation {interpolation}, {habit:?}, robot {hostile}");
                let mut stream = RandomStream::new(&seed, &label);
                for step in 0..60 {
                    let actions = [0, 1].map(|robot| {
                        let observation = game.observation(robot);
                        if robot == hostile {
                            action(
                                habit,
                                ACTION_LIMIT,
                                interpolation,
                                step,
                                observation,
                                &mut stream,
                            )
                        } else {
                            interpolation.hold_position(&INITIAL_Q)[..interpolation.len()].to_vec()
                        }
                    });
                    let outcome = game.step(actions.each_ref().map(|a| Command::Act(a)));
                    for robot in 0..2 {
                        assert_finite(&label, game.observation(robot));
                    }
                    if let Some(RallyEnd::Diverged { by }) = outcome.rally_end {
                        assert_eq!(by, [0, 1].map(|robot| robot == hostile), "{label}");
                        assert_eq!(game.referee().score(), [0, 0], "{label}");
                        diverged_rallies += 1;
                        break;
                    }
                }
            }
        }
    }
    assert!(diverged_rallies > 0);
}

#[test]
fn diverged_world_stops() {
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(13);
    let interpolation = Interpolation::Trajectory;
    let mut episode = Episode::new(
        AirHockeyTask::Prepare,
        interpolation,
        ActivePerturbations::NONE,
        &settings,
        &Plant::nominal(),
        seed,
    )
    .with_bounds(NARROW);
    let mut stream = RandomStream::new(&seed, "unused");
    let mut step = |episode: &mut Episode| {
        let observation = episode.observation();
        let action = action(
            Habit::Amplifying,
            ACTION_LIMIT,
            interpolation,
            0,
            observation,
            &mut stream,
        );
        episode.step(&action)
    };
    while episode.divergence().is_none() {
        assert!(episode.steps() < 500, "it does not diverge");
        step(&mut episode);
    }
    let (state, divergence) = (episode.state(), episode.divergence());
    assert!(state.dq.iter().all(|dq| dq.abs() <= NARROW.joint_rad_s));
    step(&mut episode);
    assert_eq!((episode.state(), episode.divergence()), (state, divergence));
}

/// The protocol refuses NaN and infinities, but the controller must handle them too.
#[test]
fn non_finite_commands_leave_a_finite_state() {
    let settings = PerturbationSettings::default();
    for interpolation in interpolations() {
        for number in [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN,
        ] {
            let mut episode = Episode::new(
                AirHockeyTask::Hit,
                interpolation,
                ActivePerturbations::NONE,
                &settings,
                &Plant::nominal(),
                Seed::from_number(14),
            );
            let action = vec![number; interpolation.len()];
            for _ in 0..20 {
                if episode.step(&action).end.is_some() {
                    break;
                }
            }
            let state = episode.state();
            assert_finite("joints", &state.q);
            assert_finite("velocities", &state.dq);
            assert_finite("puck", &state.puck);
        }
    }
}
