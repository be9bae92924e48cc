//! Checks the numbers that `docs/robot.md` quotes from the model, in tables and sentences.

use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    Interpolation, JOINTS, Plant, SUBSTEPS, World, env_info,
    model::{
        EE_DESIRED_HEIGHT_M, INITIAL_Q, LIMIT_FRACTION, LINKS, Mount, Offset, SUBSTEP_S, TOOL,
    },
    table::geometry::{PUCK, TABLE},
};

const DOCUMENT: &str = include_str!("../../../../docs/robot.md");

/// Asserts that the document contains a text, ignoring line breaks.
fn assert_documented(expected: &str) {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words(DOCUMENT).contains(&words(expected)),
        "docs/robot.md does not say: {expected}"
    );
}

/// A number as the document writes it.
fn number(x: f64) -> String {
    let text = if x != 0.0 && x.abs() < 1e-4 {
        format!("{x:e}")
    } else {
        x.to_string()
    };
    text.replace('-', "−")
}

/// Numbers as the document writes them, separated by commas.
fn numbers(xs: &[f64]) -> String {
    xs.iter().map(|&x| number(x)).collect::<Vec<_>>().join(", ")
}

#[test]
fn link_table_matches_the_model() {
    for (i, link) in LINKS.iter().enumerate() {
        let position = match link.offset {
            Offset::Y(y) => [0.0, y, 0.0],
            Offset::Z(z) => [0.0, 0.0, z],
        };
        let rotation = match link.mount {
            Mount::Aligned => "none",
            Mount::HalfTurnYz => "half, about y + z",
            Mount::QuarterTurnX => "quarter, about x",
        };
        assert_documented(&format!(
            "| {} | {} | {rotation} | {} | {} | {} |",
            i + 1,
            numbers(&position),
            number(link.mass_kg),
            numbers(&link.centre_m),
            numbers(&link.inertia_kg_m2),
        ));
    }
}

#[test]
fn joint_tables_match_the_model() {
    let acceleration = env_info(AirHockeyTask::Defend).joint_acc_limit[1];
    for (i, link) in LINKS.iter().enumerate() {
        let (range, speed) = (link.range_rad, link.velocity_limit_rad_s);
        assert_documented(&format!(
            "| {} | {} | {:.4} | {:.4} | {:.4} | {:.4} | {} |",
            i + 1,
            number(range),
            LIMIT_FRACTION * range,
            speed,
            LIMIT_FRACTION * speed,
            acceleration[i],
            number(link.torque_limit_n_m),
        ));
        assert_documented(&format!(
            "| {} | {} | {} | {} | {} | {} |",
            i + 1,
            numbers(&[link.damping]),
            numbers(&[link.friction_n_m]),
            numbers(&[link.armature_kg_m2]),
            numbers(&[link.kp]),
            numbers(&[link.kd]),
        ));
    }
}

#[test]
fn tool_start_pose_and_table_match_the_model() {
    for (value, name) in [
        (TOOL.end_effector_mass_kg, "kg, the end effector"),
        (TOOL.mallet_mass_kg, "kg, the mallet"),
    ] {
        assert_documented(&format!("{} {name}", number(value)));
    }
    assert_documented(&format!(
        "{} m beyond link 7's origin",
        number(TOOL.end_effector_z_m)
    ));
    assert_documented(&format!(
        "its centre of mass {} m and the middle of the striking cylinder {} m below",
        number(TOOL.mallet_centre_z_m),
        number(TOOL.cylinder_centre_z_m)
    ));
    assert_documented(&format!(
        "radius {} m, half height {} m",
        number(TOOL.cylinder_radius_m),
        number(TOOL.cylinder_half_height_m)
    ));
    assert_documented(&format!("q = ({})", numbers(&INITIAL_Q)));
    assert_documented(&format!(
        "base at ({}, 0, {})",
        number(-TABLE.base_x_m),
        number(TABLE.base_z_m)
    ));
    assert_documented(&format!(
        "x > {:.5} m and |y| < {:.5} m",
        TABLE.base_x_m - (TABLE.half_length_m() - TOOL.cylinder_radius_m),
        TABLE.half_width_m() - TOOL.cylinder_radius_m
    ));
    assert_documented(&format!("height of {} m", number(EE_DESIRED_HEIGHT_M)));
    assert_documented(&format!(
        "{} × {} m, goals {} m wide",
        number(TABLE.length_m),
        number(TABLE.width_m),
        number(TABLE.goal_width_m)
    ));
    assert_documented(&format!(
        "radius {} m, mass {} kg, yaw inertia {} kg m², {} m high",
        number(PUCK.radius_m),
        number(PUCK.mass_kg),
        number(PUCK.inertia_kg_m2),
        number(PUCK.height_m)
    ));
}

#[test]
fn quoted_measurements_match_the_simulator() {
    let puck_out_of_reach = [0.8, 0.4, 0.0, 0.0, 0.0, 0.0];
    let mut world = World::with_robots(&Plant::nominal(), 1, puck_out_of_reach);
    let [x, _, z] = world.kinematics(0).end_effector.origin.to_array();
    hold_for(&mut world, 2000);
    let [sagged_x, _, sagged_z] = world.kinematics(0).end_effector.origin.to_array();
    assert_documented(&format!(
        "{:.1} mm lower and {:.1} mm nearer",
        1e3 * (z - sagged_z),
        1e3 * (x - sagged_x)
    ));

    let mut world = World::with_robots(&Plant::nominal(), 1, [-0.5, 0.4, 0.0, 1.0, 0.0, 10.0]);
    hold_for(&mut world, 1000);
    // It started with 1 m/s and 10 rad/s.
    let [vx, _, spin] = world.puck().velocity;
    assert_documented(&format!(
        "{:.0} % of its speed and {:.0} % of its spin after a second",
        100.0 * vx,
        10.0 * spin
    ));

    let (across, along) = rim_bounces();
    let mean = |ratios: &[f64]| ratios.iter().sum::<f64>() / ratios.len() as f64;
    let [least, most] =
        [f64::min, f64::max].map(|reduce| across.iter().copied().reduce(reduce).unwrap());
    assert_documented(&format!(
        "{:.2} of its speed across the rim, {least:.2} to {most:.2}",
        mean(&across)
    ));
    assert_documented(&format!("{:.2} of its speed along the rim", mean(&along)));

    let speed_ratios: Vec<f64> = [0.5, 1.0, 2.0, 3.0].map(mallet_bounce).to_vec();
    let [least, most] =
        [f64::min, f64::max].map(|reduce| speed_ratios.iter().copied().reduce(reduce).unwrap());
    assert_documented(&format!("{least:.2} to {most:.2} of the puck's speed"));
}

/// Simulates some milliseconds, in which the arm holds its position.
fn hold_for(world: &mut World, duration_ms: usize) {
    for ms in 0..duration_ms {
        if ms % SUBSTEPS == 0 {
            world.hold(0, Interpolation::Cubic);
        }
        world.substep();
    }
}

/// Ratios of the puck's velocity across and along a long rim after a bounce without spin, for 120 bounces that differ
/// in speed and phase.
fn rim_bounces() -> (Vec<f64>, Vec<f64>) {
    (0..120)
        .map(|k| {
            let speed = 0.5 + 2.5 * f64::from(k) / 119.0;
            let y = 0.4 + f64::from(k * 7 % 20) * 1e-4;
            let mut world =
                World::with_robots(&Plant::nominal(), 1, [0.2, y, 0.0, 0.3, speed, 0.0]);
            let is_free =
                |world: &World| world.puck().pose[1] + PUCK.radius_m < TABLE.half_width_m();
            let mut before = *world.puck();
            let mut ms = 0;
            while world.puck().velocity[1] > 0.0 || !is_free(&world) {
                if is_free(&world) {
                    before = *world.puck();
                }
                hold_for(&mut world, 1);
                ms += 1;
                assert!(ms < 1000, "the puck does not come back");
            }
            let after = world.puck();
            let ratio = |axis: usize| (after.velocity[axis] / before.velocity[axis]).abs();
            (ratio(1), ratio(0))
        })
        .unzip()
}

/// Ratio of the puck's speeds after and before a head-on impact, at `speed` m/s, on the mallet of an arm that holds its position.
fn mallet_bounce(speed: f64) -> f64 {
    let mut world = World::with_robots(&Plant::nominal(), 1, [-0.6, 0.0, 0.0, -speed, 0.0, 0.0]);
    let is_touching = |world: &World| {
        let mallet = world.mallet(0).position[0];
        world.puck().pose[0] - mallet < PUCK.radius_m + TOOL.cylinder_radius_m + 1e-3
    };
    let mut before = speed;
    let mut ms = 0;
    while world.puck().velocity[0] < 0.0 || is_touching(&world) {
        if !is_touching(&world) {
            before = -world.puck().velocity[0];
        }
        hold_for(&mut world, 1);
        ms += 1;
        assert!(ms < 2000, "the puck does not come back");
    }
    world.puck().velocity[0] / before
}

#[test]
fn step_lengths_and_joint_count_match_the_model() {
    assert_eq!((JOINTS, SUBSTEPS), (7, 20));
    assert_eq!(SUBSTEP_S, 0.001);
    assert_documented("1 kHz");
    assert_documented("50 Hz");
}
