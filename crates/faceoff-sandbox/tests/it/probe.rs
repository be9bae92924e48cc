//! The probe of the host's sandbox features.

use crate::harness::{SerialGuard, missing_layers};
use faceoff_sandbox::{Layer, probe_host};

#[test]
fn probe_covers_every_layer_and_names_fixes() {
    let _guard = SerialGuard::lock();
    let features = probe_host();
    let layers: Vec<_> = features.iter().map(|feature| feature.layer).collect();
    assert_eq!(layers, Layer::ALL);
    for feature in &features {
        println!("{feature:?}");
        assert!(!feature.found.is_empty());
        assert_eq!(feature.fix.is_some(), !feature.available);
    }
    // Fails if a layer is missing for root, or one that an ordinary user should have.
    missing_layers();
}
