//! Slots on a real store, with an evaluator scripted by the tests. It injects platform faults and timings that a healthy
//! runner does not have. The real runner is tested in `tests/it`.

mod fixture;
mod full_disk;
mod games;
mod intercepted_server;
mod interrupted;
mod jobs;
mod runtimes;
mod schedule;
mod scripted_game;
mod slots;
