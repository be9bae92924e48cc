//! One file per subcommand.

pub mod activate;
pub mod admin;
mod any_server;
pub mod compare;
pub mod dataset;
pub mod demo;
pub mod doctor;
pub mod eval;
pub mod game;
pub mod import;
pub mod init;
pub mod join;
mod local_bundle;
pub mod new;
mod output;
mod people;
pub mod play;
pub mod publish;
pub mod replay;
pub mod score;
pub mod serve;
pub mod sim;
mod storage;
pub mod submissions;
pub mod submit;
pub mod team;
mod team_server;
pub mod token;
pub mod tournament;
pub mod verify;
pub mod whoami;

use anyhow::Context;
use std::process::ExitCode;

/// Runs what talks to a server.
fn block_on<T>(work: impl Future<Output = anyhow::Result<T>>) -> anyhow::Result<T> {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("starting the async runtime")?
        .block_on(work)
}

/// Success, or the error with its causes on standard error and status 1.
pub fn exit_code(outcome: anyhow::Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        // The reader of our output went away, as in `faceoff sim trace | head`: nothing to report.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<std::io::Error>())
        .any(|cause| cause.kind() == std::io::ErrorKind::BrokenPipe)
}
