//! Checks that the constants of the viewer in the browser are those of the simulator.

use faceoff_sim::{
    episode::{
        constraints::{HEIGHT_TOLERANCE_M, LINK_HEIGHT_M},
        task::{PLAYABLE_Y_M, TASK_RULES},
    },
    model::{
        CONTROL_STEP_S, EE_DESIRED_HEIGHT_M, INITIAL_Q, LIMIT_FRACTION, LINKS, Mount, Offset, TOOL,
    },
    table::geometry::{PUCK, TABLE},
};
use serde_json::Value;
use std::f64::consts::FRAC_1_SQRT_2;

/// The constants of the viewer.
const MODEL: &str = include_str!("../../../web/client/src/model/model.json");

#[track_caller]
fn assert_same(found: &Value, expected: f64) {
    let number = found.as_f64().unwrap_or(f64::NAN);
    assert!(
        (number - expected).abs() < 1e-12,
        "the viewer has {found}, the simulator {expected}"
    );
}

#[test]
fn viewer_model_matches_the_simulator() {
    let model: Value = serde_json::from_str(MODEL).unwrap();
    assert_same(&model["step_s"], CONTROL_STEP_S);
    for (base, side) in [(0, -1.0), (1, 1.0)] {
        let base = &model["bases"][base];
        assert_same(&base["x_m"], side * TABLE.base_x_m);
        assert_same(&base["y_m"], 0.0);
        assert_same(&base["z_m"], TABLE.base_z_m);
    }
    let links = model["links"].as_array().unwrap();
    assert_eq!(links.len(), LINKS.len());
    for (link_model, link) in links.iter().zip(&LINKS) {
        assert_same(&link_model["range_rad"], link.range_rad);
        let limit = link_model["velocity_limit_deg_s"]
            .as_f64()
            .unwrap()
            .to_radians();
        assert_same(&limit.into(), link.velocity_limit_rad_s);
        let position = match link.offset {
            Offset::Y(y) => [0.0, y, 0.0],
            Offset::Z(z) => [0.0, 0.0, z],
        };
        // Quaternions (w, x, y, z), in which sine and cosine of 45° occur.
        let half = FRAC_1_SQRT_2;
        let orientation = match link.mount {
            Mount::Aligned => [1.0, 0.0, 0.0, 0.0],
            Mount::HalfTurnYz => [0.0, 0.0, half, half],
            Mount::QuarterTurnX => [half, half, 0.0, 0.0],
        };
        for (axis, expected) in position.into_iter().enumerate() {
            assert_same(&link_model["position_m"][axis], expected);
        }
        for (part, expected) in orientation.into_iter().enumerate() {
            assert_same(&link_model["orientation_wxyz"][part], expected);
        }
    }
    for (angle, q) in model["initial_q_rad"]
        .as_array()
        .unwrap()
        .iter()
        .zip(INITIAL_Q)
    {
        assert_same(angle, q);
    }
    assert_same(&model["end_effector_z_m"], TOOL.end_effector_z_m);
    let mallet = &model["mallet"];
    assert_same(&mallet["radius_m"], TOOL.cylinder_radius_m);
    assert_same(&mallet["half_height_m"], TOOL.cylinder_half_height_m);
    assert_same(&mallet["centre_z_m"], TOOL.cylinder_centre_z_m);
    assert_same(&model["puck"]["radius_m"], PUCK.radius_m);
    let table = &model["table"];
    assert_same(&table["half_length_m"], TABLE.half_length_m());
    assert_same(&table["half_width_m"], TABLE.half_width_m());
    assert_same(&table["goal_half_width_m"], TABLE.goal_width_m / 2.0);
    assert_same(&table["post_radius_m"], TABLE.post_radius_m);
    assert_same(&table["rim_width_m"], TABLE.rim_thickness_m);
    let limits = &model["constraints"];
    assert_same(&limits["limit_fraction"], LIMIT_FRACTION);
    assert_same(&limits["ee_height_m"], EE_DESIRED_HEIGHT_M);
    assert_same(&limits["ee_height_tolerance_m"], HEIGHT_TOLERANCE_M);
    assert_same(&limits["link_height_m"], LINK_HEIGHT_M);
    assert_same(&limits["computation_time_s"], CONTROL_STEP_S);
    for (task, half_width) in [("defend", TABLE.half_width_m()), ("prepare", PLAYABLE_Y_M)] {
        let region = &model["success_regions"][task];
        let [from, to] = TASK_RULES.success_x_m;
        assert_same(&region["x_from_m"], from);
        assert_same(&region["x_to_m"], to);
        assert_same(&region["half_width_m"], half_width);
    }
}
