//! The subcommands, one public module each, and the private modules that they share.

mod ablation_text;
pub mod activate;
pub mod admin;
mod atomic_file;
mod atomic_folder;
pub mod backup;
pub mod board;
mod ca_file;
pub mod compare;
pub mod completions;
mod config_file;
pub mod dataset;
pub mod demo;
pub mod doctor;
pub mod eval;
pub mod evaluation;
mod evaluation_text;
mod files_client;
pub mod game;
pub mod health;
pub mod import;
pub mod init;
pub mod join;
pub mod link;
mod local_bundle;
pub mod log;
pub mod login;
pub mod logout;
pub mod new;
mod next_cutoff;
mod output;
mod password;
pub mod password_change;
mod people;
pub mod play;
pub mod publish;
mod queue;
pub mod register;
pub mod replay;
mod reported_capabilities;
mod resource_references;
pub mod restore;
pub mod runtimes;
pub mod score;
pub mod season;
mod series_folders;
pub mod serve;
mod server;
mod side_notes;
mod silent_agent;
pub mod sim;
mod stage_lookup;
pub mod status;
mod storage;
pub mod submissions;
pub mod submit;
mod table_cells;
pub mod team;
pub mod token;
pub mod tournament;
pub mod verify;
pub mod webhook;
pub mod whoami;
pub mod withdraw;
pub mod worker;

use anyhow::Context;
use tokio::runtime::Builder;

/// Runs a future that talks to a server.
fn block_on<T>(future: impl Future<Output = anyhow::Result<T>>) -> anyhow::Result<T> {
    block_on_runtime(Builder::new_current_thread(), future)
}

/// Runs a future of a server or a worker, on the CPUs of this process.
fn block_on_all_cpus<T>(future: impl Future<Output = anyhow::Result<T>>) -> anyhow::Result<T> {
    block_on_runtime(Builder::new_multi_thread(), future)
}

fn block_on_runtime<T>(
    mut builder: Builder,
    future: impl Future<Output = anyhow::Result<T>>,
) -> anyhow::Result<T> {
    builder
        .enable_all()
        .build()
        .context("starting the async runtime")?
        .block_on(future)
}
