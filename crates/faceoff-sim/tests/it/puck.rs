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
fn slides_match_until_a_rim_is_met() {
    for case in recording("puck_slide")["cases"].as_array().unwrap() {
        let recorded: Vec<[f64; 6]> = rows(&case["state"]);
        let ours = slide(array(&case["init"]), recorded.len());
        for (ours, recorded) in ours.iter().zip(&recorded) {
            if near_rim(recorded) {
                break;
            }
            assert!(
                max_difference(ours, recorded) <= 1e-6,
                "{ours:?} {recorded:?}"
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
    let of = |kinds: &[&str]| -> Vec<&Bounce> {
        bounces
            .iter()
            .filter(|bounce| kinds.contains(&bounce.kind.as_str()))
            .collect()
    };
    let walls = of(&["wall", "wall_spin"]);
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
    let corners = of(&["corner"]);
    let (_, p90) = summary(
        "corner, velocity",
        corners.iter().map(|bounce| bounce.errors().0).collect(),
    );
    assert!(p90 <= 0.01);

    // At −x robot 1's mallet stands where some cases start.
    let mut entries = of(&["goal_entry"]);
    entries.retain(|bounce| bounce.recorded[0][0] > 0.0);
    for entry in &entries {
        for (ours, recorded) in entry.ours.iter().zip(&entry.recorded) {
            assert!(max_difference(ours, recorded) <= 1e-6);
        }
    }

    // The reference meets the rounding's chords up to 0.3 mm off: no case-by-case match is to be had.
    let posts = of(&["goal_post"]);
    for post in &posts {
        let touched = first_touch(&post.recorded).expect("a post case touches");
        let ours_touched = first_touch(&post.ours).expect("ours touches too");
        assert!(
            touched.abs_diff(ours_touched) <= 1,
            "touched at {ours_touched} ms, recorded {touched} ms"
        );
        assert_leaves_the_post(&post.ours[touched - 1], &post.ours[post.judged_at()]);
    }
    let ratio = |post: &&Bounce| {
        let end = post.judged_at();
        speed(&post.ours[end]) / speed(&post.recorded[end])
    };
    let ratios: Vec<f64> = posts.iter().map(ratio).collect();
    assert!(ratios.iter().all(|ratio| (0.4..=2.0).contains(ratio)));
    summary("goal post, outgoing speed over the recorded one", ratios);
    let counts = [walls.len(), corners.len(), entries.len(), posts.len()];
    assert_eq!(counts, [108, 12, 4, 28]);
}

/// Hardly faster than before (the law's restitution reaches 1.03), and away from the nearest post's
/// centre of rounding.
fn assert_leaves_the_post(before: &[f64; 6], after: &[f64; 6]) {
    assert!(speed(after) <= 1.05 * speed(before), "{before:?} {after:?}");
    let post = [0.979 * after[0].signum(), 0.130 * after[1].signum()];
    let outward = (after[0] - post[0]) * after[3] + (after[1] - post[1]) * after[4];
    assert!(outward > 0.0, "{before:?} {after:?}");
}
