//! Reasons for the end of an episode of air hockey, as [`crate::EpisodeIndexEntry::end_description`] begins with them.

pub use faceoff_airhockey::{OWN_GOAL, PUCK_TOO_FAST, SLOW_GOAL};
