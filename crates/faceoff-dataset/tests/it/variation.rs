//! Tests of evaluations with a variation: weights of tasks, bounds of tiers and magnitudes of perturbations other than the
//! ruleset's. The dataset records them, and verification uses them.

use crate::{
    forgery::Forgery,
    recordings::{Evaluation, json, swing_arm},
    verify::check,
};
use faceoff_airhockey::{DEFEND, HIT, simulator};
use faceoff_dataset::{Dataset, verify::VerifyError};
use faceoff_episode::Simulator as _;
use faceoff_types::{Magnitude, Magnitudes, Task, Variation};
use faceoff_wire::dataset::DatasetManifest;
use serde_json::{Value, json};

const SHARDS: [(Task, std::ops::Range<u32>); 2] = [(HIT, 0..2), (DEFEND, 0..2)];

/// A variation that differs from the ruleset in all respects.
fn large_variation() -> Variation {
    serde_json::from_value(json!({
        "weights": { "hit": 0.125, "defend": 0.875, "prepare": 0.0 },
        "tier_bounds": { "deployable": 5.0, "improvable": 10.0 },
        "perturbations": {
            "model_mismatch": { "mass": [0.9, 1.1], "static_error_m": [0.002, 0.02] },
            "observation_noise": { "puck_position_m": 0.01 },
            "disturbance": { "sigma_n_per_m_s": 0.02 },
            "tracking_loss": { "probability": 0.2, "steps": [2, 3] },
        },
    }))
    .unwrap()
}

#[test]
fn dataset_records_its_variation_and_verifies_with_it() {
    let played =
        Evaluation::play_with_variation(large_variation(), Some(swing_arm), &SHARDS).assembled();
    let verified = check(&played.archive(), 2).unwrap();
    assert_eq!(verified.result.variation, large_variation());
    let dataset = Dataset::open(&played.archive(), simulator().competition()).unwrap();
    assert_eq!(dataset.manifest().variation, large_variation());
    for name in ["manifest.json", "results.json"] {
        let file: Value = json(&played.folder().join(name));
        assert_eq!(file["weights"]["defend"], 0.875, "{name}");
        assert_eq!(
            file["perturbations"]["tracking_loss"]["steps"],
            json!([2, 3]),
            "{name}"
        );
    }
    let rate = |task| verified.result.tasks[&task].success_rate;
    let score = 12.5 * rate(HIT) + 87.5 * rate(DEFEND);
    assert!((verified.result.score - score).abs() < 1e-9);

    // With the ruleset's magnitudes the same agent and seeds give another evaluation, which states no variation.
    let plain = Evaluation::play(Some(swing_arm), &SHARDS).assembled();
    assert_ne!(
        std::fs::read(plain.folder().join("steps.parquet")).unwrap(),
        std::fs::read(played.folder().join("steps.parquet")).unwrap()
    );
    let file: Value = json(&plain.folder().join("results.json"));
    for key in ["weights", "tier_bounds", "perturbations"] {
        assert_eq!(file.get(key), None);
    }
}

#[test]
fn forged_variation_is_found() {
    let played =
        Evaluation::play_with_variation(large_variation(), Some(swing_arm), &SHARDS).assembled();
    let forged = |change: &dyn Fn(&mut Variation)| {
        let forgery = Forgery::copy_of(&played.folder());
        let path = forgery.path("manifest.json");
        let mut manifest: DatasetManifest = json(&path);
        change(&mut manifest.variation);
        std::fs::write(&path, serde_json::to_vec(&manifest).unwrap()).unwrap();
        check(forgery.update_manifest().dir.path(), 2)
    };
    let forged_magnitude = |group: &str, name: &str, value: f64| {
        let value = Magnitude::Number(value);
        forged(&|variation| variation.perturbations.set(group, name, value))
    };
    let fewer_losses = forged_magnitude("tracking_loss", "probability", 0.03);
    assert!(
        matches!(fewer_losses, Err(VerifyError::Differs(_))),
        "{fewer_losses:?}"
    );
    let weights = forged(&|variation| variation.weights = Default::default());
    assert!(
        matches!(weights, Err(VerifyError::Differs(_))),
        "{weights:?}"
    );
    let impossible_tilt = forged_magnitude("delay", "tilt_m_s2", 1e9).unwrap_err();
    assert!(
        impossible_tilt.to_string().contains("delay.tilt_m_s2"),
        "{impossible_tilt}"
    );
}

#[test]
fn shards_of_other_magnitudes_are_not_joined() {
    let mut played = Evaluation::play_with_variation(large_variation(), Some(swing_arm), &SHARDS);
    played.meta.variation.perturbations = Magnitudes::default();
    let refused = played.assemble("dataset.zip").unwrap_err().to_string();
    assert!(refused.contains("other magnitudes"), "{refused}");
}

#[test]
fn magnitudes_that_no_robot_satisfies_are_refused() {
    let seed = faceoff_types::Seed::from_number(7).model_mismatch();
    let check = |magnitudes: &Magnitudes| simulator().check_season_magnitudes(magnitudes, seed);
    let mut magnitudes = Magnitudes::default();
    assert_eq!(check(&magnitudes), Ok(()));
    assert_eq!(check(&large_variation().perturbations), Ok(()));
    // An arm that sags by its own length.
    let error_m = Magnitude::Range([0.9, 1.0]);
    magnitudes.set("model_mismatch", "static_error_m", error_m);
    let refused = check(&magnitudes).unwrap_err();
    assert!(refused.contains("none of 300 robots"), "{refused}");
}
