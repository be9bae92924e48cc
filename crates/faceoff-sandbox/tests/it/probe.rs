use crate::harness::missing_layers;
use faceoff_sandbox::{Layer, probe_host};

#[test]
fn the_probe_covers_every_layer_and_names_a_cure_for_what_is_missing() {
    let features = probe_host();
    let layers: Vec<_> = features.iter().map(|feature| feature.layer).collect();
    assert_eq!(layers, Layer::ALL);
    for feature in &features {
        println!("{feature:?}");
        assert!(!feature.found.is_empty());
        assert_eq!(feature.cure.is_some(), !feature.available);
    }
    // As root, or for what an ordinary user should have, this fails when something is missing.
    missing_layers();
}
