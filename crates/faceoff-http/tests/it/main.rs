//! The API and the pages over real HTTP, on a real store in a temporary folder.
#![expect(
    clippy::unwrap_used,
    reason = "test helpers fail as tests do: by panicking"
)]

mod ablations;
mod decisions;
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
mod days;
mod deprecated_names;
mod team_dashboard;
mod divisions;
mod docs;
mod downloads;
mod evaluations;
mod event_stream;
mod events;
mod feed;
mod frozen_boards;
mod html;
mod stage_limits;
mod download_links;
mod pagination;
mod openapi;
mod organiser_dashboard;
mod users;
mod probes;
mod problems;
mod proposals;
mod publication;
mod rate_limits;
mod webhook_receiver;
mod retention;
mod roles;
mod free_space;
mod confirmations;
mod runtimes;
mod season;
mod seeds;
mod sign_in;
mod sign_off;
mod site;
mod sse;
mod stages;
mod counting_evaluations;
mod submissions;
mod team_page;
mod teams;
mod tournament;
mod upload_quotas;
mod scoring_settings;
mod request_log;
mod webhooks;
mod whole_season;
mod worker_files;
mod workers;
