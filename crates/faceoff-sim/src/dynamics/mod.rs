//! The dynamics of an arm, for one arm or two at once.

pub mod arm;
pub mod lanes;
pub mod ldlt;
pub mod spatial;
