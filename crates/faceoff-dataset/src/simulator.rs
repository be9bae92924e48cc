//! Identity of the simulator: a dataset can only be verified with the simulator that made it.

use faceoff_episode::Simulator;
use faceoff_wire::dataset::SimulatorId;

/// Version and fingerprint of a simulator in this program.
pub(crate) fn simulator_id(simulator: &dyn Simulator) -> SimulatorId {
    SimulatorId {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        fingerprint: simulator.fingerprint().to_owned(),
    }
}
