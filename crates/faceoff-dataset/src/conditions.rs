//! The conditions of a job: the same to play under, and to verify the recording with.

use faceoff_airhockey::Arena;
use faceoff_episode::Conditions;
use faceoff_types::UnknownProfile;
use faceoff_wire::{game::GameSpec, job::ShardSpec};

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

/// The world of a game.
///
/// # Errors
/// If the simulator has no such profile.
pub fn game_arena(spec: &GameSpec) -> Result<Arena, UnknownProfile> {
    Ok(Arena::with_ruleset(
        spec.ruleset,
        spec.profile.try_into()?,
        &spec.perturbations,
        spec.seed,
        spec.mismatch_seed,
    ))
}
