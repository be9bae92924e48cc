//! Scoring against the published tables, and the properties that boards promise.

mod boards;
mod evaluation;
mod pairing;
mod paper_qualifying;
mod paper_tournament;
mod sheets;
mod support;
