//! The world of a job: the same one to play in, and to verify the recording with.

use faceoff_episode::Arena;
use faceoff_wire::{game::GameSpec, job::ShardSpec};

/// The world of a shard's episodes.
#[must_use]
pub fn shard_arena(spec: &ShardSpec) -> Arena {
    Arena::with_ruleset(
        spec.ruleset,
        spec.profile,
        &spec.perturbations,
        spec.seed,
        spec.mismatch_seed,
    )
}

/// The world of a game.
#[must_use]
pub fn game_arena(spec: &GameSpec) -> Arena {
    Arena::with_ruleset(
        spec.ruleset,
        spec.profile,
        &spec.perturbations,
        spec.seed,
        spec.mismatch_seed,
    )
}
