//! Slots on a real store, with an evaluator that plays what a test tells it to: faults of ours and
//! moments of time that a healthy runner does not offer. The real runner is in `tests/it`.

mod between;
mod fixture;
mod full_disk;
mod games;
mod interrupted;
mod orders;
mod runtimes;
mod scripted_game;
mod slots;
