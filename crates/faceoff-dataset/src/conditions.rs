//! The conditions of a job: the same to play under, and to verify the recording with.

use faceoff_airhockey::{Arena, find_ruleset, settings};
use faceoff_episode::{Conditions, InvalidConditions};
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
/// If the simulator has no such ruleset, profile or magnitudes.
pub fn game_arena(spec: &GameSpec) -> Result<Arena, InvalidConditions> {
    Ok(Arena::with_ruleset(
        find_ruleset(spec.ruleset)?,
        spec.profile
            .try_into()
            .map_err(InvalidConditions::Profile)?,
        &settings(&spec.perturbations).map_err(InvalidConditions::Magnitudes)?,
        spec.seed,
        spec.mismatch_seed,
    ))
}
