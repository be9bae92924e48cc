//! The `faceoff` binary: parses the command line and runs a subcommand, each of which has its own file in `commands`.
//!
//! `client` calls a server's API, `credentials` stores logins. `competition` is air hockey, the only competition compiled in.
//! `descriptors` divides the file descriptors of a server, `machine` describes this host, `packing` packs agents, and `user_scope` gets
//! control groups for a user without privileges.

#[macro_use]
mod terminal;

mod client;
mod commands;
mod competition;
mod config;
mod credentials;
mod descriptors;
mod exit;
mod log;
mod machine;
mod packing;
mod user_scope;

use clap::{CommandFactory, Parser, Subcommand};
use exit::Exit;
use std::process::ExitCode;

/// Competition server for robot-learning agents.
#[derive(Debug, Parser)]
#[command(name = "faceoff", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the competition server: API, board and worker slots.
    Serve(commands::serve::ServeCommand),
    Worker(commands::worker::WorkerCommand),
    /// Write a configuration file with all defaults, units and meanings.
    Init(commands::init::InitCommand),
    /// Run a whole evaluation day with example agents.
    Demo(commands::demo::DemoCommand),
    /// Create a new agent: a folder that works immediately.
    New(commands::new::NewCommand),
    /// Evaluate a bundle locally with the server's evaluator.
    Eval(commands::eval::EvalCommand),
    /// Play one game or a series of games between two bundles.
    Play(commands::play::PlayCommand),
    /// Compare two evaluations on the same episodes.
    Compare(commands::compare::CompareCommand),
    /// Draw a recorded game, or an episode of a dataset, as a page, picture or video.
    Replay(commands::replay::ReplayCommand),
    /// Simulate a dataset or a game again and compare every state and score.
    Verify(commands::verify::VerifyCommand),
    /// Download datasets and print their content.
    Dataset(commands::dataset::DatasetCommand),
    /// Score results from a file: a qualifying board or a tournament.
    Score(commands::score::ScoreCommand),
    /// Run the simulator alone: open-loop simulation, model export, benchmark, golden hashes.
    Sim(commands::sim::SimCommand),
    /// Upload a bundle and wait for its validation.
    Submit(commands::submit::SubmitCommand),
    /// Make a submission active for the next cutoff.
    Activate(commands::activate::ActivateCommand),
    /// Publish an evaluation of the team with its dataset.
    Publish(commands::publish::PublishCommand),
    Withdraw(commands::withdraw::WithdrawCommand),
    Evaluation(commands::evaluation::EvaluationCommand),
    Status(commands::status::StatusCommand),
    Board(commands::board::BoardCommand),
    Season(commands::season::SeasonCommand),
    Runtimes(commands::runtimes::RuntimesCommand),
    Health(commands::health::HealthCommand),
    Log(commands::log::LogCommand),
    Link(commands::link::LinkCommand),
    Submissions(commands::submissions::SubmissionsCommand),
    Join(commands::join::JoinCommand),
    Register(commands::register::RegisterCommand),
    Login(commands::login::LoginCommand),
    Logout(commands::logout::LogoutCommand),
    Password(commands::password_change::PasswordCommand),
    Whoami(commands::whoami::WhoamiCommand),
    Team(commands::team::TeamCommand),
    Tournament(commands::tournament::TournamentCommand),
    Game(commands::game::GameCommand),
    Token(commands::token::TokenCommand),
    Webhook(commands::webhook::WebhookCommand),
    /// Run a competition: days, teams, users, stages, tournaments, workers.
    Admin(commands::admin::AdminCommand),
    Import(commands::import::ImportCommand),
    Backup(commands::backup::BackupCommand),
    Restore(commands::restore::RestoreCommand),
    /// Check whether this host can run agents, and how to fix what is missing.
    Doctor(commands::doctor::DoctorCommand),
    Completions(commands::completions::CompletionsCommand),
}

fn main() -> ExitCode {
    // Keeps file descriptors 3 and 4 free for agents that answer on them, before threads open files. A failure is reported when such
    // an agent starts.
    let _ = faceoff_sandbox::reserve_protocol_descriptors();
    let outcome = match Cli::parse().command {
        Command::Serve(command) => command.run(),
        Command::Worker(command) => command.run(),
        Command::Init(command) => command.run(),
        Command::Demo(command) => command.run(),
        Command::New(command) => command.run(),
        Command::Eval(command) => command.run(),
        Command::Play(command) => command.run(),
        Command::Compare(command) => command.run(),
        Command::Replay(command) => command.run(),
        Command::Verify(command) => return command.run().into(),
        Command::Dataset(command) => command.run(),
        Command::Score(command) => command.run(),
        Command::Sim(command) => command.run(),
        Command::Submit(command) => command.run(),
        Command::Activate(command) => command.run(),
        Command::Publish(command) => command.run(),
        Command::Withdraw(command) => command.run(),
        Command::Evaluation(command) => command.run(),
        Command::Status(command) => command.run(),
        Command::Board(command) => command.run(),
        Command::Season(command) => command.run(),
        Command::Runtimes(command) => command.run(),
        Command::Health(command) => command.run(),
        Command::Log(command) => command.run(),
        Command::Link(command) => command.run(),
        Command::Submissions(command) => command.run(),
        Command::Join(command) => command.run(),
        Command::Register(command) => command.run(),
        Command::Login(command) => command.run(),
        Command::Logout(command) => command.run(),
        Command::Password(command) => command.run(),
        Command::Whoami(command) => command.run(),
        Command::Team(command) => command.run(),
        Command::Tournament(command) => command.run(),
        Command::Game(command) => command.run(),
        Command::Token(command) => command.run(),
        Command::Webhook(command) => command.run(),
        Command::Admin(command) => command.run(),
        Command::Import(command) => command.run(),
        Command::Backup(command) => command.run(),
        Command::Restore(command) => command.run(),
        Command::Doctor(command) => command.run(),
        Command::Completions(command) => command.run(Cli::command()),
    };
    Exit::from_outcome(outcome).into()
}
