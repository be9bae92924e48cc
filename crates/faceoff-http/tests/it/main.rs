//! The API and the pages over real HTTP, on a real store in a temporary folder.
#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests fail as tests do: by panicking"
)]

mod ablations;
mod blind;
mod board;
mod board_load;
mod comparisons;
mod days;
mod evaluations;
mod events;
mod limits;
mod openapi;
mod problems;
mod publication;
mod room;
mod rulings;
mod season;
mod seeds;
mod sign_off;
mod site;
mod stages;
mod standings;
mod submissions;
mod teams;
mod uploads;
mod variation;
