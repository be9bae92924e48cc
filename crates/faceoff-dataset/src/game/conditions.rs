//! The conditions of a game, for playing it and for verifying its recording.

use crate::simulator;
use faceoff_airhockey::{SimulationSetup, simulation_setup};
use faceoff_episode::{Conditions, InvalidConditions};
use faceoff_wire::{dataset::SimulatorId, game::GameSpec};

/// The simulation setup of a game.
///
/// # Errors
/// If the simulator has no such ruleset, profile or magnitudes.
pub fn game_simulation_setup(spec: &GameSpec) -> Result<SimulationSetup, InvalidConditions> {
    simulation_setup(&Conditions {
        ruleset: spec.ruleset,
        profile: spec.profile,
        perturbations: &spec.perturbations,
        seed: spec.seed,
        mismatch_seed: spec.mismatch_seed,
    })
}

/// Version and fingerprint of the simulator of games.
pub(super) fn simulator_id() -> SimulatorId {
    simulator::simulator_id(&*faceoff_airhockey::simulator())
}
