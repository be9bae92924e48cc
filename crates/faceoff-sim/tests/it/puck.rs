//! Slides and bounces of the puck match the recordings `puck_slide` and `rim_bounce` of the *reference*, the simulator of the 2023 Robot
//! Air Hockey Challenge. *Rims* are the walls of the table. States are [x, y, yaw, vx, vy, yaw rate] in the table frame, in SI units.

use crate::{
    reference::{array, cases, max_difference, quantile, rows},
    replay::{Bounce, bounces, first_touch, slide, speed},
};

const PUCK_RADIUS_M: f64 = 0.03165;
/// Half the length and half the width of the table.
const HALF_TABLE_M: [f64; 2] = [0.974, 0.519];
/// Centre of the rounded edge of the goal post at x > 0, y > 0.
const POST_M: [f64; 2] = [0.979, 0.130];

/// May the puck touch a rim?
fn is_near_rim(state: &[f64; 6]) -> bool {
    (0..2).any(|axis| state[axis].abs() + PUCK_RADIUS_M > HALF_TABLE_M[axis])
}

#[test]
fn slides_match_until_the_first_rim_contact() {
    for case in cases("puck_slide") {
        let recorded: Vec<[f64; 6]> = rows(&case["state"]);
        let simulated = slide(array(&case["init"]), recorded.len());
        for (simulated, recorded) in simulated.iter().zip(&recorded) {
            if is_near_rim(recorded) {
                break;
            }
            assert!(
                max_difference(simulated, recorded) <= 1e-6,
                "{simulated:?} {recorded:?}"
            );
        }
    }
}

/// Prints and returns the median and the 90th percentile of some values.
fn print_quantiles(name: &str, mut values: Vec<f64>) -> (f64, f64) {
    let (median, p90) = (quantile(&mut values, 0.5), quantile(&mut values, 0.9));
    println!(
        "{name}: {} cases, median {median:.2e}, p90 {p90:.2e}",
        values.len()
    );
    (median, p90)
}

#[test]
fn bounces_match_recordings() {
    let bounces = bounces();
    let of_kind = |kinds: &[&str]| -> Vec<&Bounce> {
        bounces
            .iter()
            .filter(|bounce| kinds.contains(&bounce.kind.as_str()))
            .collect()
    };
    let walls = of_kind(&["wall", "wall_spin"]);
    let (median, p90) = print_quantiles(
        "wall, velocity",
        walls.iter().map(|bounce| bounce.errors().0).collect(),
    );
    assert!(median <= 0.002 && p90 <= 0.006);
    let (median, p90) = print_quantiles(
        "wall, r·spin",
        walls.iter().map(|bounce| bounce.errors().1).collect(),
    );
    assert!(median <= 0.002 && p90 <= 0.006);
    let corners = of_kind(&["corner"]);
    let (_, p90) = print_quantiles(
        "corner, velocity",
        corners.iter().map(|bounce| bounce.errors().0).collect(),
    );
    assert!(p90 <= 0.01);

    // Pucks that enter the goal. At x < 0 some of them start in contact with robot 1's mallet.
    let mut entries = of_kind(&["goal_entry"]);
    entries.retain(|bounce| bounce.recorded[0][0] > 0.0);
    for entry in &entries {
        for (simulated, recorded) in entry.simulated.iter().zip(&entry.recorded) {
            assert!(max_difference(simulated, recorded) <= 1e-6);
        }
    }

    // The reference approximates the rounded edge of the goal posts by chords, which are up to 0.3 mm off, so single bounces may differ.
    let posts = of_kind(&["goal_post"]);
    for post in &posts {
        let recorded_touch =
            first_touch(&post.recorded).expect("the recorded puck touches the post");
        let simulated_touch =
            first_touch(&post.simulated).expect("the simulated puck touches the post");
        assert!(
            recorded_touch.abs_diff(simulated_touch) <= 1,
            "first touch at {simulated_touch} ms, recorded at {recorded_touch} ms"
        );
        assert_leaves_the_post(
            &post.simulated[recorded_touch - 1],
            &post.simulated[post.compared_row()],
        );
    }
    let ratio = |post: &&Bounce| {
        let end = post.compared_row();
        speed(&post.simulated[end]) / speed(&post.recorded[end])
    };
    let ratios: Vec<f64> = posts.iter().map(ratio).collect();
    assert!(ratios.iter().all(|ratio| (0.4..=2.0).contains(ratio)));
    print_quantiles("goal post, outgoing speed over the recorded one", ratios);
    let counts = [walls.len(), corners.len(), entries.len(), posts.len()];
    assert_eq!(counts, [108, 12, 4, 28]);
}

/// Asserts that the puck is hardly faster than before (the contact law's restitution, outgoing over incoming speed, reaches 1.03) and moves
/// away from the centre of the nearest post's rounded edge.
fn assert_leaves_the_post(before: &[f64; 6], after: &[f64; 6]) {
    assert!(speed(after) <= 1.05 * speed(before), "{before:?} {after:?}");
    let post = [0, 1].map(|axis| POST_M[axis] * after[axis].signum());
    let outward = (after[0] - post[0]) * after[3] + (after[1] - post[1]) * after[4];
    assert!(outward > 0.0, "{before:?} {after:?}");
}
