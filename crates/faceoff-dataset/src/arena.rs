//! The world of a job: the same one to play in, and to verify the recording with.

use faceoff_episode::Arena;
use faceoff_types::UnknownProfile;
use faceoff_wire::{game::GameSpec, job::ShardSpec};

/// The world of a shard's episodes.
///
/// # Errors
/// If the simulator has no such profile.
pub fn shard_arena(spec: &ShardSpec) -> Result<Arena, UnknownProfile> {
    Ok(Arena::with_ruleset(
        spec.ruleset,
        spec.profile.try_into()?,
        &spec.perturbations,
        spec.seed,
        spec.mismatch_seed,
    ))
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
