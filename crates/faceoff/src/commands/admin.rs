//! `faceoff admin`: the organisers' commands. Each calls the REST API of a server with an organiser's token.

mod announcements;
mod authentication;
mod day;
mod evaluation_lines;
mod evaluations;
mod export;
mod log;
mod people;
mod proposal;
mod results;
mod season;
mod stage;
mod storage;
mod team_lookup;
mod teams;
mod tournament;
mod workers;

use super::{
    ca_file::CaFile,
    token::{self, TokenAction},
    webhook::{self, WebhookAction},
};
use clap::{Args, Subcommand};
use jiff::civil::Date;
use std::path::PathBuf;

/// Runs a competition.
#[derive(Debug, Args)]
pub struct AdminCommand {
    /// The server [default: the server of the last faceoff login, or http://127.0.0.1:8080]
    #[arg(long, global = true, value_name = "URL", env = "FACEOFF_SERVER")]
    server: Option<String>,
    /// An organiser's token [default: the file admin-token in the data folder, or the token of faceoff login]
    #[arg(
        long,
        global = true,
        env = "FACEOFF_ADMIN_TOKEN",
        hide_env_values = true
    )]
    token: Option<String>,
    /// The server's data folder, on this machine [default: server.data_dir of faceoff.toml]
    #[arg(long, global = true, value_name = "FOLDER")]
    data_dir: Option<PathBuf>,
    #[command(flatten)]
    ca: CaFile,
    /// Print the server's response as JSON
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    #[command(flatten)]
    Team(teams::TeamAction),
    /// Invite and remove users: organisers and team members
    People {
        #[command(subcommand)]
        action: people::PeopleAction,
    },
    /// Open and close registration, approve and refuse teams, set the divisions
    Registration {
        #[command(subcommand)]
        action: people::RegistrationAction,
    },
    /// Create, list, rotate and revoke tokens
    Token {
        #[command(subcommand)]
        action: TokenAction,
    },
    /// Manage the organisers' webhooks, which notify other programs of events
    Webhook {
        #[command(subcommand)]
        action: WebhookAction,
    },
    /// List, ban and readmit remote workers
    Worker {
        #[command(subcommand)]
        action: workers::WorkerAction,
    },
    #[command(flatten)]
    Announcement(announcements::AnnouncementAction),
    #[command(flatten)]
    Day(day::DayAction),
    #[command(flatten)]
    Storage(storage::StorageAction),
    #[command(flatten)]
    Result(results::ResultAction),
    /// Run trials, which do not count, and propose, apply or drop re-evaluations
    Proposal {
        #[command(subcommand)]
        action: proposal::ProposalAction,
    },
    /// Create, change and list stages: their times, rules and schedules
    Stage {
        #[command(subcommand)]
        action: stage::StageAction,
    },
    /// Open, run and close tournaments: rounds of games between the teams' agents
    Tournament {
        #[command(subcommand)]
        action: Box<tournament::TournamentAction>,
    },
    #[command(flatten)]
    Evaluation(evaluations::EvaluationAction),
    #[command(flatten)]
    Season(season::SeasonAction),
    /// List the log of changes with time and actor, the newest first
    Log(log::LogArgs),
    /// List the evaluations of a day with their progress
    Evaluations {
        /// A date in the time zone of the stages, e.g. 2026-11-21 [default: today]
        #[arg(long)]
        day: Option<Date>,
    },
}

impl AdminCommand {
    /// Runs the chosen action.
    ///
    /// # Errors
    /// If there is no token, or the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.run_action())
    }

    async fn run_action(self) -> anyhow::Result<()> {
        let client = authentication::admin_client(
            self.server.as_deref(),
            self.token.as_deref(),
            self.data_dir.as_deref(),
            self.ca.path(),
        )?;
        let json = self.json;
        match self.action {
            Action::Team(action) => teams::run_action(&client, json, action).await,
            Action::People { action } => people::people(&client, json, action).await,
            Action::Registration { action } => people::registrations(&client, json, action).await,
            Action::Token { action } => token::run_action(&client, json, action).await,
            Action::Webhook { action } => webhook::run_action(&client, json, action).await,
            Action::Worker { action } => workers::run_action(&client, json, action).await,
            Action::Announcement(action) => announcements::run_action(&client, json, action).await,
            Action::Day(action) => day::run_action(&client, json, action).await,
            Action::Storage(action) => storage::run_action(&client, json, action).await,
            Action::Result(action) => results::run_action(&client, json, action).await,
            Action::Proposal { action } => proposal::run_action(&client, json, action).await,
            Action::Stage { action } => stage::run_action(&client, json, action).await,
            Action::Tournament { action } => tournament::run_action(&client, json, *action).await,
            Action::Evaluation(action) => evaluations::run_action(&client, json, action).await,
            Action::Season(action) => season::run_action(&client, json, action).await,
            Action::Log(args) => log::list(&client, json, args).await,
            Action::Evaluations { day } => evaluations::list(&client, json, day).await,
        }
    }
}
