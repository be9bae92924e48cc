//! The agent protocol and the jobs of slots: valid and invalid answers of agents, and round trips of jobs.

mod answers;
mod job;
mod robustness;
