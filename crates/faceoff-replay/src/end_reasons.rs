//! Beginnings of the descriptions in [`crate::EpisodeLine::end_description`].

pub use faceoff_airhockey::{LOST_PUCK, OWN_GOAL, SLOW_GOAL};
