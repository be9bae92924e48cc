//! Slides and bounces of the puck (REFERENCE, `puck_slide` and `rim_bounce`).

use crate::{
    reference::{array, max_difference, quantile, recording, rows},
    replay::{Bounce, bounces, first_touch, slide, speed},
};

const PUCK_RADIUS: f64 = 0.03165;

fn near_rim(state: &[f64; 6]) -> bool {
    state[0].abs() + PUCK_RADIUS > 0.974 || state[1].abs() + PUCK_RADIUS > 0.519
}

#[test]
fn slides_match_until_the_first_rim_contact() {
    for case in recording("puck_slide")["cases"].as_array().unwrap() {
        let recorded: Vec<[f64; 6]> = rows(&case["state"]);
        let simulated = slide(array(&case["init"]), recorded.len());
        for (simulated, recorded) in simulated.iter().zip(&recorded) {
            if near_rim(recorded) {
                break;
            }
            assert!(
                max_difference(simulated, recorded) <= 1e-6,
                "{simulated:?} {recorded:?}"
            );
        }
    }
}

/// Median and 90th percentile of some values, printed.
fn summary(name: &str, mut values: Vec<f64>) -> (f64, f64) {
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
    let (median, p90) = summary(
        "wall, velocity",
        walls.iter().map(|bounce| bounce.errors().0).collect(),
    );
    assert!(median <= 0.002 && p90 <= 0.006);
    let (median, p90) = summary(
        "wall, r·spin",
        walls.iter().map(|bounce| bounce.errors().1).collect(),
    );
    assert!(median <= 0.002 && p90 <= 0.006);
    let corners = of_kind(&["corner"]);
    let (_, p90) = summary(
        "corner, velocity",
        corners.iter().map(|bounce| bounce.errors().0).collect(),
    );
    assert!(p90 <= 0.01);

    // At −x some cases start at robot 1's mallet.
    let mut entries = of_kind(&["goal_entry"]);
    entries.retain(|bounce| bounce.recorded[0][0] > 0.0);
    for entry in &entries {
        for (simulated, recorded) in entry.simulated.iter().zip(&entry.recorded) {
            assert!(max_difference(simulated, recorded) <= 1e-6);
        }
    }

    // The reference approximates the rounding by chords, up to 0.3 mm off, so cases do not match one by one.
    let posts = of_kind(&["goal_post"]);
    for post in &posts {
        let recorded_touch =
            first_touch(&post.recorded).expect("the recorded puck touches the post");
        let simulated_touch =
            first_touch(&post.simulated).expect("the simulated puck touches the post");
        assert!(
            recorded_touch.abs_diff(simulated_touch) <= 1,
            "recorded_touch at {simulated_touch} ms, recorded {recorded_touch} ms"
        );
        assert_leaves_the_post(
            &post.simulated[recorded_touch - 1],
            &post.simulated[post.judged_row()],
        );
    }
    let ratio = |post: &&Bounce| {
        let end = post.judged_row();
        speed(&post.simulated[end]) / speed(&post.recorded[end])
    };
    let ratios: Vec<f64> = posts.iter().map(ratio).collect();
    assert!(ratios.iter().all(|ratio| (0.4..=2.0).contains(ratio)));
    summary("goal post, outgoing speed over the recorded one", ratios);
    let counts = [walls.len(), corners.len(), entries.len(), posts.len()];
    assert_eq!(counts, [108, 12, 4, 28]);
}

/// Asserts that the puck is hardly faster than before (the contact law's restitution reaches 1.03) and moves away
/// from the centre of the nearest post's rounding.
fn assert_leaves_the_post(before: &[f64; 6], after: &[f64; 6]) {
    assert!(speed(after) <= 1.05 * speed(before), "{before:?} {after:?}");
    let post = [0.979 * after[0].signum(), 0.130 * after[1].signum()];
    let outward = (after[0] - post[0]) * after[3] + (after[1] - post[1]) * after[4];
    assert!(outward > 0.0, "{before:?} {after:?}");
}
