//! Repeats in the simulator what recordings of the *reference* (the simulator of the 2023 Robot Air Hockey Challenge) contain: bounces,
//! impacts and whole episodes. The tests and `examples/fidelity.rs` compare the results. `docs/simulator.md` ("Compared with recordings")
//! lists the recordings. States of the puck are [x, y, yaw, vx, vy, yaw rate] in the table frame, in SI units.

use crate::reference::{array, cases, flat, max_difference, recording, rows};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Episode, Interpolation, MalletState, PerturbationSettings, Plant,
    SUBSTEPS, World,
};
use faceoff_types::Seed;

const PUCK_RADIUS_M: f64 = 0.03165;
const MALLET_RADIUS_M: f64 = 0.04815;

/// Free damping divides the puck's velocity by this number in each substep of 1 ms.
const DAMPING_DIVISOR: f64 = 1.0005;

/// Change of velocity in a control step, m/s, from which on the puck has hit something.
const SHARP_CHANGE_M_S: f64 = 0.02;

/// Simulates a puck from its state `init`, while robot 1 holds its initial pose. Returns `rows` states, one per ms.
pub fn slide(init: [f64; 6], rows: usize) -> Vec<[f64; 6]> {
    let mut world = World::with_robots(&Plant::nominal(), 1, init);
    let mut states = vec![init];
    while states.len() < rows {
        world.substep();
        states.push(world.puck().state());
    }
    states
}

/// Index of the first state whose velocity differs by more than rounding from that of a free slide: the puck has touched something.
pub fn first_touch(states: &[[f64; 6]]) -> Option<usize> {
    (1..states.len()).find(|&k| {
        let (before, after) = (states[k - 1], states[k]);
        (0..2).any(|i| (after[3 + i] - before[3 + i] / DAMPING_DIVISOR).abs() > 1e-6 + 1e-7)
    })
}

/// Linear speed of a puck, m/s.
pub fn speed(state: &[f64; 6]) -> f64 {
    state[3].hypot(state[4])
}

/// A bounce off a rim, a wall of the table (recording `rim_bounce`), as recorded and as simulated.
pub struct Bounce {
    /// Name of the series of bounces, e.g. `corner`.
    pub kind: String,
    /// States of the puck, one per ms.
    pub recorded: Vec<[f64; 6]>,
    pub simulated: Vec<[f64; 6]>,
}

impl Bounce {
    /// Index of the state that is compared: after 30 ms at a wall, otherwise 8 ms after the first touch.
    pub fn compared_row(&self) -> usize {
        match self.kind.as_str() {
            "wall" | "wall_spin" => 30,
            _ => first_touch(&self.recorded).map_or(0, |k| (k + 8).min(self.recorded.len() - 1)),
        }
    }

    /// Differences of velocity and of spin times radius, both divided by the speed before the bounce.
    pub fn errors(&self) -> (f64, f64) {
        let mut before = speed(&self.recorded[0]);
        if self.kind.starts_with("wall") {
            before = before.max(PUCK_RADIUS_M * self.recorded[0][5].abs());
        }
        let (simulated, recorded) = (
            self.simulated[self.compared_row()],
            self.recorded[self.compared_row()],
        );
        let velocity = (simulated[3] - recorded[3]).hypot(simulated[4] - recorded[4]);
        let spin = PUCK_RADIUS_M * (simulated[5] - recorded[5]).abs();
        (velocity / before, spin / before)
    }
}

/// Simulates all recorded bounces.
pub fn bounces() -> Vec<Bounce> {
    let replay = |case: &serde_json::Value| {
        let recorded: Vec<[f64; 6]> = rows(&case["state"]);
        Bounce {
            kind: case["kind"].as_str().unwrap().to_owned(),
            simulated: slide(array(&case["init"]), recorded.len()),
            recorded,
        }
    };
    cases("rim_bounce").iter().map(replay).collect()
}

/// Differences between a recorded impact of a mallet on the puck (recording `mallet_impact`) and the simulated one, at the end.
pub struct Impact {
    /// Name of the series of impacts, e.g. `override_…`.
    pub kind: String,
    /// Difference of the puck's velocity, divided by its recorded peak speed.
    pub velocity_error: f64,
    /// Distance of the pucks, m.
    pub position_error_m: f64,
}

impl Impact {
    /// Is the mallet moved by the simulated arm? Otherwise its motion is imposed.
    pub fn is_moved_by_arm(&self) -> bool {
        self.kind.starts_with("realarm")
    }
}

/// Simulates all recorded impacts.
pub fn impacts() -> Vec<Impact> {
    let replay = |case: &serde_json::Value| {
        // One row per ms: position (3) and velocity (2) of the mallet, state of the puck (6).
        let recorded: Vec<[f64; 11]> = rows(&case["rows"]);
        let kind = case["kind"].as_str().unwrap();
        let mut world = World::with_robots(&Plant::nominal(), 1, array(&case["puck_init"]));
        let mut simulated = world.puck().state();
        for (k, row) in recorded.iter().enumerate() {
            if kind.starts_with("override") {
                world.impose_mallet(Some(MalletState {
                    position: [row[0], row[1], row[2]],
                    velocity: [row[3], row[4]],
                }));
            } else if k % SUBSTEPS == 0 {
                match case["actions"].get(k / SUBSTEPS) {
                    Some(action) => world.command(0, Interpolation::Cubic, &flat(action)),
                    None => world.hold(0, Interpolation::Cubic),
                }
            }
            simulated = world.puck().state();
            world.substep();
        }
        let puck = |k: usize| -> [f64; 6] { std::array::from_fn(|i| recorded[k][5 + i]) };
        let peak = (0..recorded.len())
            .map(|k| speed(&puck(k)))
            .fold(0.0, f64::max);
        let last = puck(recorded.len() - 1);
        Impact {
            kind: kind.to_owned(),
            velocity_error: (simulated[3] - last[3]).hypot(simulated[4] - last[4]) / peak,
            position_error_m: (simulated[0] - last[0]).hypot(simulated[1] - last[1]),
        }
    };
    cases("mallet_impact").iter().map(replay).collect()
}

/// A recorded episode (recordings `episodes_*`) that is simulated with its recorded actions, whatever the simulated puck does, and the
/// differences between the two.
pub struct Replay {
    /// Task and index of the episode, e.g. `hit 7`.
    pub name: String,
    /// First control step in which the recorded puck hit something.
    pub first_contact_step: usize,
    /// First control step in which robot 1's mallet may have touched the puck; `usize::MAX` if it never may have.
    pub first_mallet_impact_step: usize,
    pub steps: Vec<StepDifferences>,
    /// The puck after each control step, as recorded.
    pub recorded_puck: Vec<[f64; 6]>,
    /// The puck after each control step, as simulated.
    pub puck: Vec<[f64; 6]>,
}

/// Differences between a recorded and a simulated control step; of several numbers the largest.
pub struct StepDifferences {
    /// Observations before the step; mixed units.
    pub observation: f64,
    /// Positions of the driven joints after the step.
    pub joints_rad: f64,
    /// Constraint values after the step; mixed units.
    pub constraints: f64,
    /// Distance of the pucks after the step.
    pub puck_m: f64,
}

impl Replay {
    /// The largest `value` over the control steps for which `steps` is true.
    pub fn largest(
        &self,
        steps: impl Fn(usize) -> bool,
        value: impl Fn(&StepDifferences) -> f64,
    ) -> f64 {
        self.steps
            .iter()
            .enumerate()
            .filter(|(step, _)| steps(*step))
            .map(|(_, differences)| value(differences))
            .fold(0.0, f64::max)
    }
}

/// Replays the episodes of all tasks.
pub fn episodes() -> Vec<Replay> {
    let replays_of_task = |task: AirHockeyTask| {
        let recording = recording(&format!("episodes_{task}"));
        let cases = recording["episodes"].as_array().unwrap().clone();
        cases
            .into_iter()
            .enumerate()
            .map(move |(index, case)| replay_episode(task, index, &case))
    };
    AirHockeyTask::ALL
        .into_iter()
        .flat_map(replays_of_task)
        .collect()
}

fn replay_episode(task: AirHockeyTask, index: usize, case: &serde_json::Value) -> Replay {
    let init: [f64; 6] = array(&case["puck_init"]);
    let puck: Vec<[f64; 6]> = rows(&case["puck"]);
    let q_dq: Vec<[f64; 14]> = rows(&case["q_dq"]);
    let constraints: Vec<[f64; 4]> = rows(&case["max_constraint"]);
    let mut episode = Episode::with_initial_puck(
        task,
        Interpolation::Cubic,
        ActivePerturbations::NONE,
        &PerturbationSettings::default(),
        &Plant::nominal(),
        Seed::from_number(0),
        init,
    );
    let mut replay = Replay {
        name: format!("{task} {index}"),
        first_contact_step: first_sharp_change(&init, &puck),
        first_mallet_impact_step: usize::MAX,
        steps: vec![],
        recorded_puck: puck.clone(),
        puck: vec![],
    };
    for step in 0..puck.len() {
        if may_touch(&episode.world().mallet(0), &episode.state().puck) {
            replay.first_mallet_impact_step = replay.first_mallet_impact_step.min(step);
        }
        let observation = max_difference(&flat(&case["obs"][step]), episode.observation());
        let outcome = episode.step(&flat(&case["action"][step]));
        let state = episode.state();
        let values = &outcome.constraints;
        let values = [values.joint_pos, values.joint_vel, values.ee, values.link];
        let [dx, dy] = [0, 1].map(|i| state.puck[i] - puck[step][i]);
        replay.puck.push(state.puck);
        replay.steps.push(StepDifferences {
            observation,
            joints_rad: max_difference(&q_dq[step][..7], &state.q),
            constraints: max_difference(&values, &constraints[step]),
            puck_m: dx.hypot(dy),
        });
        if outcome.end.is_some() {
            break;
        }
    }
    replay
}

/// The first control step in which the puck hit something: its velocity changed by more than free damping does. The number of steps, if
/// there is none.
fn first_sharp_change(init: &[f64; 6], puck: &[[f64; 6]]) -> usize {
    // Free damping over a control step of 20 ms.
    let decay = DAMPING_DIVISOR.powi(-20);
    let mut before = *init;
    puck.iter()
        .position(|after| {
            let change = (after[3] - before[3] * decay).hypot(after[4] - before[4] * decay);
            before = *after;
            change > SHARP_CHANGE_M_S
        })
        .unwrap_or(puck.len())
}

/// May robot 1's mallet touch the puck within a control step? It may if they are closer than their radii, the distance that they
/// travel in the step, and 1 mm.
fn may_touch(mallet: &MalletState, puck: &[f64; 6]) -> bool {
    let distance = (mallet.position[0] - puck[0]).hypot(mallet.position[1] - puck[1]);
    let speed = (mallet.velocity[0] - puck[3]).hypot(mallet.velocity[1] - puck[4]);
    distance < PUCK_RADIUS_M + MALLET_RADIUS_M + 0.02 * speed + 0.001
}
