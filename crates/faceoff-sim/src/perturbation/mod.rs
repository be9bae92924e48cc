//! *Perturbations*: differences between the world of an evaluation and the ideal one that agents are developed in (`docs/rules.md`,
//! "Perturbations"). Each has its own random stream.

pub mod disturbance;
mod mismatch;
pub mod noise;
mod profile;
pub mod rehearsal_table;
mod settings;
pub mod table_perturbations;
pub mod tracking_loss;

pub use profile::{ActivePerturbations, AirHockeyProfile, Perturbation};
pub use settings::{
    DelaySettings, DisturbanceSettings, MismatchSettings, NoiseSettings, PerturbationSettings,
    TrackingLossSettings,
};
