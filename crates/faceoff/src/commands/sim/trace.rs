//! `faceoff sim trace`: simulates actions that are given in advance (open-loop), for comparison with other simulators.

use super::{constraints::Constraints, scenario::Scenario};
use anyhow::{Context as _, Result, ensure};
use faceoff_sim::{
    ConstraintValues, Interpolation, JOINTS, MalletState, PerturbationSettings, Plant, SUBSTEPS,
    World,
    episode::{opponent::Opponent, task},
    perturbation::table_perturbations::TablePerturbations,
};
use faceoff_types::EpisodeEnd;
use serde::Serialize;
use std::io::{IsTerminal as _, Write};

/// One line of the output: the state at one time. Each list has one entry per robot.
#[derive(Debug, Serialize)]
struct Line {
    t_ms: u64,
    /// x, y, yaw and their velocities.
    puck: [f64; 6],
    /// Joint positions, rad.
    q: Vec<[f64; JOINTS]>,
    /// Joint velocities, rad/s.
    dq: Vec<[f64; JOINTS]>,
    /// Joint velocities as the robot's sensors filter them, rad/s.
    dq_filtered: Vec<[f64; JOINTS]>,
    /// Angles of the passive universal joint, which holds the mallet, rad.
    universal: Vec<[f64; 2]>,
    /// Joint torques, N m.
    torque: Vec<[f64; JOINTS]>,
    /// Position of the end effector, m.
    ee: Vec<[f64; 3]>,
    /// x, y, z, vx, vy of each mallet.
    mallet: Vec<[f64; 5]>,
    constraints: Vec<Constraints>,
}

/// The last line of the output of a scenario with a task.
#[derive(Debug, Serialize)]
struct Done {
    done: bool,
    steps: u32,
    /// `null` if the scenario's duration ended first.
    reason: Option<EpisodeEnd>,
    success: bool,
}

/// Reads a scenario from standard input and writes its trace to standard output.
pub fn run() -> Result<()> {
    let stdin = std::io::stdin();
    ensure!(
        !stdin.is_terminal(),
        "expected a scenario on standard input, as in `faceoff sim trace < scenario.json`"
    );
    let scenario = Scenario::read(stdin.lock())?;
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    trace(&scenario, &mut out)?;
    out.flush().context("standard output")
}

fn trace(scenario: &Scenario, out: &mut impl Write) -> Result<()> {
    let settings = PerturbationSettings::default();
    let active_perturbations = scenario.profile.active_perturbations();
    let plant = Plant::for_perturbations(
        active_perturbations,
        &settings,
        scenario.seed.model_mismatch(),
    );
    let mut world = World::new(&plant, &scenario.joints, scenario.puck);
    let mut table =
        TablePerturbations::new(active_perturbations, &settings, &scenario.seed, &mut world);
    let mut opponent = (scenario.task == Some(faceoff_sim::AirHockeyTask::Hit)).then(Opponent::new);
    let mut steps = 0;
    let mut end = None;
    impose_mallet(&mut world, scenario, 0);
    write_state(&world, 0, out)?;
    for t_ms in 0..scenario.duration_ms {
        if t_ms % SUBSTEPS as u64 == 0 {
            let step = usize::try_from(t_ms).unwrap_or(usize::MAX) / SUBSTEPS;
            for robot in 0..scenario.interpolation.len() {
                let interpolation = scenario.interpolation[robot];
                match scenario.actions[robot].get(step) {
                    Some(action) => world.command(robot, interpolation, action),
                    None => world.hold(robot, interpolation),
                }
            }
            if let Some(opponent) = &mut opponent {
                world.command(
                    1,
                    Interpolation::LinearPositionAndVelocity,
                    &opponent.action(),
                );
            }
        }
        let force = table.force(world.puck());
        world.set_air_force(force);
        world.substep();
        let t_ms = t_ms + 1;
        impose_mallet(&mut world, scenario, t_ms);
        if t_ms % scenario.every_ms == 0 {
            write_state(&world, t_ms, out)?;
        }
        if t_ms % SUBSTEPS as u64 == 0 {
            steps += 1;
            end = scenario
                .task
                .and_then(|task| task::end(task, world.puck(), steps));
            if end.is_some() {
                break;
            }
        }
    }
    if let Some(task) = scenario.task {
        let success = task::success(task, world.puck());
        write_line(
            &Done {
                done: true,
                steps,
                reason: end,
                success,
            },
            out,
        )?;
    }
    Ok(())
}

/// Sets the mallet to the scenario's state for this millisecond; after the last one, it stays there at rest.
fn impose_mallet(world: &mut World, scenario: &Scenario, t_ms: u64) {
    let prescribed = usize::try_from(t_ms)
        .ok()
        .and_then(|t| scenario.mallet.get(t))
        .copied();
    let at_rest = || {
        scenario.mallet.last().map(|last| MalletState {
            velocity: [0.0; 2],
            ..*last
        })
    };
    if let Some(mallet) = prescribed.or_else(at_rest) {
        world.impose_mallet(Some(mallet));
    }
}

fn write_state(world: &World, t_ms: u64, out: &mut impl Write) -> Result<()> {
    let robots = 0..world.robots();
    let mut state = Line {
        t_ms,
        puck: world.puck().state(),
        q: robots.clone().map(|robot| world.joints(robot)).collect(),
        dq: robots
            .clone()
            .map(|robot| world.joint_velocities(robot))
            .collect(),
        dq_filtered: robots
            .clone()
            .map(|robot| *world.filtered_velocities(robot))
            .collect(),
        universal: robots.clone().map(|robot| world.universal(robot)).collect(),
        torque: robots.clone().map(|robot| *world.torques(robot)).collect(),
        ee: Vec::new(),
        mallet: Vec::new(),
        constraints: Vec::new(),
    };
    for robot in robots {
        let kinematics = world.kinematics(robot);
        state.ee.push(kinematics.end_effector.origin.to_array());
        let MalletState {
            position: [x, y, z],
            velocity: [vx, vy],
        } = world.mallet(robot);
        state.mallet.push([x, y, z, vx, vy]);
        let constraints = ConstraintValues::of(world, robot);
        state.constraints.push(constraints.into());
    }
    write_line(&state, out)
}

fn write_line(value: &impl Serialize, out: &mut impl Write) -> Result<()> {
    serde_json::to_writer(&mut *out, value).map_err(std::io::Error::from)?;
    out.write_all(b"\n")?;
    Ok(())
}
