//! `faceoff admin`: organises a running competition through its API.

mod day;
mod export;
mod find;
mod lines;
mod news;
mod people;
mod played;
mod proposal;
mod speaker;
mod stage;
mod storage;
mod teams;
mod tournament;
mod workers;

use super::{
    ca_file::CaFile,
    find_stage::find_stage,
    output::{or_none, print},
    season::of_season,
    token::{self, TokenAction},
    webhook::{self, WebhookAction},
};
use anyhow::bail;
use clap::{Args, Subcommand};
use faceoff_api::{
    requests::Decision,
    views::{evaluation::EvaluationStatus, event::EventView},
};
use faceoff_types::{EvaluationId, QuestionId, StageDay};
use jiff::civil::Date;
use lines::line;
use serde_json::Value;
use std::path::PathBuf;

/// Organises a running competition.
#[derive(Debug, Args)]
pub struct AdminCommand {
    /// The server [default: that of faceoff login, or http://127.0.0.1:8080]
    #[arg(long, global = true, value_name = "URL", env = "FACEOFF_SERVER")]
    server: Option<String>,
    /// The organiser's token [default: the file admin-token in the data folder, or that of faceoff login]
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
    /// Print the server's answer as JSON
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    #[command(flatten)]
    Team(teams::TeamAction),
    /// Invite and remove people, organisers and members of teams
    People {
        #[command(subcommand)]
        action: people::PeopleAction,
    },
    /// Let teams register, approve and refuse them, set the divisions
    Registration {
        #[command(subcommand)]
        action: people::RegistrationAction,
    },
    /// Make, list, rotate and revoke tokens
    Token {
        #[command(subcommand)]
        action: TokenAction,
    },
    /// Have programs told of what happens
    Webhook {
        #[command(subcommand)]
        action: WebhookAction,
    },
    /// List, ban and readmit those who play on other machines
    Worker {
        #[command(subcommand)]
        action: workers::WorkerAction,
    },
    /// Tell everybody
    Announce {
        /// One line
        title: String,
        /// Plain text
        text: String,
    },
    /// List what teams have asked
    Questions,
    /// Answer a question
    Answer {
        /// The question's id
        question: QuestionId,
        /// Plain text
        text: String,
        /// Let everybody read question and answer; who asked stays with the organisers
        #[arg(long)]
        public: bool,
    },
    /// Publish other terms of taking part
    PublishTerms {
        /// A text file
        file: PathBuf,
    },
    /// Start a stage's day: what each team has active now plays it. A day starts once
    StartDay {
        /// The stage's name or id [default: the one that is open]
        #[arg(long)]
        stage: Option<String>,
    },
    #[command(flatten)]
    Day(day::DayAction),
    #[command(flatten)]
    Storage(storage::StorageAction),
    #[command(flatten)]
    Played(played::PlayedAction),
    /// Try a day without counting, or have results evaluated again, and apply or drop that
    Proposal {
        #[command(subcommand)]
        action: proposal::ProposalAction,
    },
    /// Make, change or list the stages: their times, rules and schedules
    Stage {
        #[command(subcommand)]
        action: stage::StageAction,
    },
    /// Open, play and close tournaments: rounds of games between the teams' agents
    Tournament {
        #[command(subcommand)]
        action: Box<tournament::TournamentAction>,
    },
    /// Play an evaluation again that was cancelled, voided or failed by the server's fault: same agent, same episodes
    Rerun {
        /// The evaluation's id
        evaluation: EvaluationId,
    },
    /// Stop an evaluation that is not over
    Cancel {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// Shown to the team
        reason: String,
    },
    /// Take a finished evaluation off the boards; without --confirm, say what that would do
    Void {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// Shown to everybody
        reason: String,
        /// The team's name
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Take a whole day off the boards, and cancel what is under way; without --confirm, say what that would do
    VoidDay {
        /// Its date
        day: Date,
        /// Shown to everybody
        reason: String,
        /// The stage's name or id
        #[arg(long)]
        stage: String,
        /// The date again
        #[arg(long, value_name = "DATE")]
        confirm: Option<String>,
    },
    /// Hold the queue: nothing is begun, what is begun is played to its end
    Pause {
        /// Shown to everybody
        reason: String,
    },
    /// Let a paused queue go on
    Resume,
    /// Take the season along as one archive, which `faceoff import` shows read-only on another server
    Export {
        /// The file to write, e.g. season.tar.zst; one that exists is left as it is
        file: PathBuf,
        /// Only what everybody may know and have: no submissions, no people, nothing that is hidden
        #[arg(long)]
        public: bool,
    },
    /// Show the season, or close it
    Season {
        #[command(subcommand)]
        action: SeasonAction,
    },
    /// List what was changed, when and by whom, the newest first
    Log {
        /// Who: organiser (the host), person:ID, team:ID, visitor, schedule, worker:NAME or server; person, team, worker: all
        #[arg(long)]
        actor: Option<String>,
        /// About what: season, stage:ID, day:STAGE/DATE, team:ID, submission:ID, evaluation:ID, person:ID, proposal:ID …
        #[arg(long)]
        subject: Option<String>,
        /// What happened, e.g. day_started
        #[arg(long)]
        kind: Option<String>,
        /// How many, 1 to 1000
        #[arg(long, default_value_t = 100)]
        limit: u32,
        /// Only changes before the one with this number
        #[arg(long, value_name = "NUMBER")]
        before: Option<i64>,
    },
    /// List the evaluations of a day with their progress
    Evaluations {
        /// A date in the stages' zones, e.g. 2026-11-21 [default: today]
        #[arg(long)]
        day: Option<Date>,
    },
}

#[derive(Debug, Subcommand)]
enum SeasonAction {
    /// Show name, commitment and state
    Show,
    /// Close the season for good: its secret becomes public, nothing more is uploaded or evaluated
    Close {
        /// The season's name, since this cannot be undone
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
}

impl AdminCommand {
    /// Does what was asked.
    ///
    /// # Errors
    /// If there is no token, or the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.act())
    }

    async fn act(self) -> anyhow::Result<()> {
        let client = speaker::client(
            self.server.as_deref(),
            self.token.as_deref(),
            self.data_dir.as_deref(),
            self.ca.path(),
        )?;
        match self.action {
            Action::Team(action) => teams::act(&client, self.json, action).await,
            Action::Storage(action) => storage::act(&client, self.json, action).await,
            Action::Played(action) => played::act(&client, self.json, action).await,
            Action::People { action } => people::people(&client, self.json, action).await,
            Action::Registration { action } => {
                people::registrations(&client, self.json, action).await
            }
            Action::Token { action } => token::act(&client, self.json, action).await,
            Action::Webhook { action } => webhook::act(&client, self.json, action).await,
            Action::Worker { action } => workers::act(&client, self.json, action).await,
            Action::Announce { title, text } => {
                news::announce(&client, self.json, title, text).await
            }
            Action::Questions => news::questions(&client, self.json).await,
            Action::Answer {
                question,
                text,
                public,
            } => news::answer(&client, self.json, question, text, public).await,
            Action::PublishTerms { file } => news::publish_terms(&client, self.json, &file).await,
            Action::Day(action) => day::act(&client, self.json, action).await,
            Action::Proposal { action } => proposal::act(&client, self.json, action).await,
            Action::Stage { action } => stage::act(&client, self.json, action).await,
            Action::Tournament { action } => tournament::act(&client, self.json, *action).await,
            Action::StartDay { stage } => {
                let stage = match stage {
                    Some(stage) => Some(find_stage(&client, &stage).await?.id),
                    None => None,
                };
                let day = client.start_day(stage).await?;
                print(self.json, &day, || {
                    let mut lines = vec![format!("{}: {} started", day.day, day.created.len())];
                    lines.extend(day.created.iter().map(line));
                    lines.extend(
                        day.without_submission
                            .iter()
                            .map(|team| format!("{:<40} no valid submission", team.name)),
                    );
                    let not_taken = day.not_taken.iter();
                    lines.extend(
                        not_taken.map(|one| format!("{:<40} {}", one.team_name, one.reason)),
                    );
                    lines.join("\n")
                })
            }
            Action::Rerun { evaluation } => {
                let rerun = client.rerun(evaluation).await?;
                print(self.json, &rerun, || line(&rerun))
            }
            Action::Cancel { evaluation, reason } => {
                let cancelled = client.cancel(evaluation, &reason).await?;
                print(self.json, &cancelled, || line(&cancelled))
            }
            Action::Void {
                evaluation,
                reason,
                confirm,
            } => {
                let decision = Decision { reason, confirm };
                let voided = client.void(evaluation, &decision).await?;
                print(self.json, &voided, || line(&voided))
            }
            Action::VoidDay {
                day,
                reason,
                stage,
                confirm,
            } => {
                let stage = find_stage(&client, &stage).await?.id;
                let of = StageDay { stage, date: day };
                let decision = Decision { reason, confirm };
                let voided = client.void_day(of, &decision).await?;
                print(self.json, &voided, || {
                    voided
                        .created
                        .iter()
                        .map(line)
                        .collect::<Vec<_>>()
                        .join("\n")
                })
            }
            Action::Pause { reason } => {
                client.pause(&reason).await?;
                let season = client.season().await?;
                print(self.json, &season, || of_season(&season))
            }
            Action::Resume => {
                client.resume().await?;
                let season = client.season().await?;
                print(self.json, &season, || of_season(&season))
            }
            Action::Export { file, public } => {
                export::export(&client, self.json, &file, public).await
            }
            Action::Season {
                action: SeasonAction::Show,
            } => {
                let season = client.season().await?;
                print(self.json, &season, || of_season(&season))
            }
            Action::Season {
                action: SeasonAction::Close { confirm },
            } => {
                let Some(confirm) = confirm else {
                    let season = client.season().await?;
                    bail!(
                        "closing {:?} publishes its secret and ends uploads and evaluations; it cannot \
                         be undone. To do it: faceoff admin season close --confirm {:?}",
                        season.name,
                        season.name
                    );
                };
                let season = client.close_season(&confirm).await?;
                print(self.json, &season, || of_season(&season))
            }
            Action::Log {
                actor,
                subject,
                kind,
                limit,
                before,
            } => {
                let wanted: Vec<(&str, String)> = [
                    ("limit", Some(limit.to_string())),
                    ("actor", actor),
                    ("subject", subject),
                    ("kind", kind),
                    ("before", before.map(|number| number.to_string())),
                ]
                .into_iter()
                .filter_map(|(name, value)| Some((name, value?)))
                .collect();
                let found = client.events(&wanted).await?;
                print(self.json, &found, || {
                    let mut lines: Vec<String> = found.events.iter().map(event_line).collect();
                    lines.extend(
                        found
                            .next_before
                            .map(|number| format!("older ones: --before {number}")),
                    );
                    or_none(lines, "nothing of that kind happened")
                })
            }
            Action::Evaluations { day } => {
                let mut evaluations = client.evaluations(day).await?;
                for evaluation in &mut evaluations {
                    // a list leaves out the faults
                    if let EvaluationStatus::AgentFailed { .. } = evaluation.status {
                        *evaluation = client.evaluation(evaluation.id).await?;
                    }
                }
                print(self.json, &evaluations, || {
                    or_none(
                        evaluations.iter().map(line).collect(),
                        "no evaluation on that day",
                    )
                })
            }
        }
    }
}

/// Number, time, who, what, about what, and what else is known.
fn event_line(event: &EventView) -> String {
    let details: Vec<String> = event
        .details
        .iter()
        .map(|(name, value)| match value {
            Value::String(text) => format!("{name}={text}"),
            other => format!("{name}={other}"),
        })
        .collect();
    format!(
        "{:>6}  {}  {}  {}  {}  {}",
        event.id,
        event.at.strftime("%Y-%m-%d %H:%M:%S UTC"),
        match &event.actor_name {
            Some(name) => format!("{} ({name})", event.actor),
            None => event.actor.clone(),
        },
        event.kind,
        event.subject,
        details.join(" ")
    )
    .trim_end()
    .to_owned()
}
