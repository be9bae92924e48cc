//! The dynamics of an arm, for one arm or two at once.

pub mod arm;
pub mod factor;
pub mod lanes;
pub mod spatial;
