//! How the evaluator's world differs from the ideal one. Every factor has a stream of its own.

pub mod disturbance;
mod mismatch;
pub mod noise;
pub mod rehearsal_table;
pub mod table_factors;
pub mod tracking_loss;
