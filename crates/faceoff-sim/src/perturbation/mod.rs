//! Differences between the evaluator's world and the ideal one. Each factor has its own random stream.

pub mod disturbance;
mod mismatch;
pub mod noise;
pub mod rehearsal_table;
pub mod table_factors;
pub mod tracking_loss;
