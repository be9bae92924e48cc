//! The API and the pages over real HTTP, on a real store in a temporary folder.
#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests fail as tests do: by panicking"
)]

mod ablations;
mod acts;
mod archive;
mod blind;
mod board;
mod board_load;
mod capacity;
mod capacity_log;
mod comparisons;
mod days;
mod divisions;
mod evaluations;
mod events;
mod frozen;
mod limits;
mod openapi;
mod people;
mod problems;
mod proposals;
mod publication;
mod retention;
mod roles;
mod room;
mod rulings;
mod runtimes;
mod season;
mod seeds;
mod sign_in;
mod sign_off;
mod site;
mod stages;
mod standings;
mod submissions;
mod teams;
mod tournament;
mod uploads;
mod variation;
mod whole_season;
