//! Beginnings of the descriptions in [`crate::EpisodeIndexEntry::end_description`].

pub use faceoff_airhockey::{OWN_GOAL, PUCK_TOO_FAST, SLOW_GOAL};
