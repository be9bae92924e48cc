//! Identity of the simulator: a dataset can only be verified with the simulator that made it.

use faceoff_episode::Simulator;
use faceoff_wire::dataset::SimulatorId;

/// Version and fingerprint of a simulator in this program.
pub(crate) fn simulator_id(simulator: &dyn Simulator) -> SimulatorId {
    id(simulator.fingerprint())
}

/// Version and fingerprint of the simulator of games.
pub(crate) fn game_simulator_id() -> SimulatorId {
    id(faceoff_sim::fingerprint())
}

fn id(fingerprint: &str) -> SimulatorId {
    SimulatorId {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        fingerprint: fingerprint.to_owned(),
    }
}
