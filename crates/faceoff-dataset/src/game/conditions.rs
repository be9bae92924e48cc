//! The conditions of a game: the same to play under, and to verify the recording with.

use crate::simulator;
use faceoff_airhockey::{Arena, find_ruleset, settings};
use faceoff_episode::InvalidConditions;
use faceoff_wire::{dataset::SimulatorId, game::GameSpec};

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

/// Version and fingerprint of the simulator of games.
pub(super) fn simulator_id() -> SimulatorId {
    simulator::simulator_id(&*faceoff_airhockey::simulator())
}
