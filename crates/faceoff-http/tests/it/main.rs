//! Tests of the API and the pages over real HTTP, on a real store (database and files) in a temporary folder.
#![expect(
    clippy::unwrap_used,
    reason = "test helpers fail as tests do: by panicking"
)]

mod ablations;
mod archive;
mod baselines;
mod blind_stages;
mod board;
mod board_data;
mod board_load;
mod board_pages;
mod browser;
mod capacity;
mod capacity_log;
mod clips;
mod comparisons;
mod confirmations;
mod counting_evaluations;
mod days;
mod decisions;
mod deprecated_names;
mod divisions;
mod docs;
mod download_links;
mod downloads;
mod evaluations;
mod event_stream;
mod events;
mod feed;
mod free_space;
mod frozen_boards;
mod html;
mod openapi;
mod organiser_dashboard;
mod pagination;
mod probes;
mod problems;
mod proposals;
mod publication;
mod rate_limits;
mod request_log;
mod retention;
mod roles;
mod runtimes;
mod scoring_settings;
mod season;
mod seeds;
mod sign_in;
mod sign_off;
mod site;
mod sse;
mod stage_limits;
mod stages;
mod submissions;
mod team_dashboard;
mod team_page;
mod teams;
mod tournament;
mod upload_quotas;
mod users;
mod webhook_receiver;
mod webhooks;
mod whole_season;
mod worker_files;
mod workers;
