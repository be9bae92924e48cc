//! The conditions of a shard's episodes, for running them and for verifying their recording.

use faceoff_episode::Conditions;
use faceoff_wire::job::ShardSpec;

/// The conditions of a shard's episodes.
#[must_use]
pub fn shard_conditions(spec: &ShardSpec) -> Conditions<'_> {
    Conditions {
        ruleset: spec.ruleset,
        profile: spec.profile,
        perturbations: &spec.perturbations,
        seed: spec.seed,
        mismatch_seed: spec.mismatch_seed,
    }
}
