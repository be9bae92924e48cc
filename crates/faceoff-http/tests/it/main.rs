//! The API and the pages over real HTTP, on a real store in a temporary folder.
#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests fail as tests do: by panicking"
)]

mod ablations;
mod acts;
mod archive;
mod baselines;
mod blind;
mod board;
mod board_data;
mod board_load;
mod board_page;
mod browser;
mod capacity;
mod capacity_log;
mod clips;
mod comparisons;
mod days;
mod desk;
mod divisions;
mod docs;
mod downloads;
mod evaluations;
mod event_stream;
mod events;
mod feed;
mod frozen;
mod html;
mod limits;
mod links;
mod lists;
mod openapi;
mod organiser_desk;
mod people;
mod probes;
mod problems;
mod proposals;
mod publication;
mod rates;
mod receiver;
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
mod sse;
mod stages;
mod standings;
mod submissions;
mod team_page;
mod teams;
mod tournament;
mod uploads;
mod variation;
mod watched;
mod webhooks;
mod whole_season;
mod work_files;
mod workers;
