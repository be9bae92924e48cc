//! `faceoff admin`: the organisers' commands. Each calls the REST API of a server with an organiser's token.

mod announcements;
mod authentication;
mod day;
mod export;
mod lines;
mod people;
mod proposal;
mod results;
mod stage;
mod storage;
mod team_lookup;
mod teams;
mod tournament;
mod workers;

use super::{
    ca_file::CaFile,
    output::{lines_or, print},
    season::season_text,
    stage_lookup::find_stage,
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
use lines::evaluation_line;
use serde_json::Value;
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
    /// Publish an announcement
    Announce {
        /// One line
        title: String,
        /// Plain text
        text: String,
    },
    /// List the teams' questions
    Questions,
    /// Answer a question
    Answer {
        /// The question's id
        question: QuestionId,
        /// Plain text
        text: String,
        /// Publish question and answer, without the name of the team
        #[arg(long)]
        public: bool,
    },
    /// Publish a new version of the terms of participation
    PublishTerms {
        /// A text file
        file: PathBuf,
    },
    /// Start an evaluation day: the active submission of each team is evaluated. A day starts only once
    StartDay {
        /// The stage's name or id [default: the open stage]
        #[arg(long)]
        stage: Option<String>,
    },
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
    /// Repeat an evaluation that was cancelled, voided or failed by a platform fault: same agent, same episodes
    Rerun {
        /// The evaluation's id
        evaluation: EvaluationId,
    },
    /// Cancel an unfinished evaluation
    Cancel {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// Shown to the team
        reason: String,
    },
    /// Void a finished evaluation, which leaves the boards; without --confirm, only list the effects
    Void {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// Shown publicly
        reason: String,
        /// The team's name
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Void an evaluation day and cancel its unfinished evaluations; without --confirm, only list the effects
    VoidDay {
        /// The date of the day
        day: Date,
        /// Shown publicly
        reason: String,
        /// The stage's name or id
        #[arg(long)]
        stage: String,
        /// The same date, as confirmation
        #[arg(long, value_name = "DATE")]
        confirm: Option<String>,
    },
    /// Pause the queue: running jobs finish, no further job starts
    Pause {
        /// Shown publicly
        reason: String,
    },
    /// Resume a paused queue
    Resume,
    /// Download the season as one archive, which `faceoff import` shows read-only on another server
    Export {
        /// The file to write, e.g. season.tar.zst; an existing file is not overwritten
        file: PathBuf,
        /// Only public data: no submissions, no users, nothing hidden
        #[arg(long)]
        public: bool,
    },
    /// Show the season, or close it
    Season {
        #[command(subcommand)]
        action: SeasonAction,
    },
    /// List the log of changes with time and actor, the newest first
    Log {
        /// Only by this actor: organiser (the host), person:ID, team:ID, visitor, schedule, worker:NAME or server;
        /// without an id, person, team and worker match all of that kind
        #[arg(long)]
        actor: Option<String>,
        /// Only about this subject: season, stage:ID, day:STAGE/DATE, team:ID, submission:ID, evaluation:ID,
        /// person:ID, proposal:ID …
        #[arg(long)]
        subject: Option<String>,
        /// Only events of this kind, e.g. day_started
        #[arg(long)]
        kind: Option<String>,
        /// Number of entries, 1 to 1000
        #[arg(long, default_value_t = 100)]
        limit: u32,
        /// Only entries before the one with this number
        #[arg(long, value_name = "NUMBER")]
        before: Option<i64>,
    },
    /// List the evaluations of a day with their progress
    Evaluations {
        /// A date in the time zone of the stages, e.g. 2026-11-21 [default: today]
        #[arg(long)]
        day: Option<Date>,
    },
}

#[derive(Debug, Subcommand)]
enum SeasonAction {
    /// Show the season's name, its commitment (the hash of its secret) and its state
    Show,
    /// Close the season permanently: its secret is published, uploads and evaluations end
    Close {
        /// The season's name, as confirmation: this cannot be undone
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
}

impl AdminCommand {
    /// Runs the chosen action.
    ///
    /// # Errors
    /// If there is no token, or the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.act())
    }

    async fn act(self) -> anyhow::Result<()> {
        let client = authentication::admin_client(
            self.server.as_deref(),
            self.token.as_deref(),
            self.data_dir.as_deref(),
            self.ca.path(),
        )?;
        match self.action {
            Action::Team(action) => teams::act(&client, self.json, action).await,
            Action::Storage(action) => storage::act(&client, self.json, action).await,
            Action::Result(action) => results::act(&client, self.json, action).await,
            Action::People { action } => people::people(&client, self.json, action).await,
            Action::Registration { action } => {
                people::registrations(&client, self.json, action).await
            }
            Action::Token { action } => token::act(&client, self.json, action).await,
            Action::Webhook { action } => webhook::act(&client, self.json, action).await,
            Action::Worker { action } => workers::act(&client, self.json, action).await,
            Action::Announce { title, text } => {
                announcements::announce(&client, self.json, title, text).await
            }
            Action::Questions => announcements::questions(&client, self.json).await,
            Action::Answer {
                question,
                text,
                public,
            } => announcements::answer(&client, self.json, question, text, public).await,
            Action::PublishTerms { file } => {
                announcements::publish_terms(&client, self.json, &file).await
            }
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
                    let mut lines = vec![format!(
                        "{}: {} evaluations started",
                        day.day,
                        day.created.len()
                    )];
                    lines.extend(day.created.iter().map(evaluation_line));
                    lines.extend(
                        day.without_submission
                            .iter()
                            .map(|team| format!("{:<40} no valid submission", team.name)),
                    );
                    let exclusions = day.excluded.iter();
                    lines.extend(
                        exclusions.map(|excluded| {
                            format!("{:<40} {}", excluded.team_name, excluded.reason)
                        }),
                    );
                    lines.join("\n")
                })
            }
            Action::Rerun { evaluation } => {
                let rerun = client.rerun(evaluation).await?;
                print(self.json, &rerun, || evaluation_line(&rerun))
            }
            Action::Cancel { evaluation, reason } => {
                let cancelled = client.cancel(evaluation, &reason).await?;
                print(self.json, &cancelled, || evaluation_line(&cancelled))
            }
            Action::Void {
                evaluation,
                reason,
                confirm,
            } => {
                let decision = Decision { reason, confirm };
                let voided = client.void(evaluation, &decision).await?;
                print(self.json, &voided, || evaluation_line(&voided))
            }
            Action::VoidDay {
                day,
                reason,
                stage,
                confirm,
            } => {
                let stage = find_stage(&client, &stage).await?.id;
                let stage_day = StageDay { stage, date: day };
                let decision = Decision { reason, confirm };
                let voided = client.void_day(stage_day, &decision).await?;
                print(self.json, &voided, || {
                    voided
                        .created
                        .iter()
                        .map(evaluation_line)
                        .collect::<Vec<_>>()
                        .join("\n")
                })
            }
            Action::Pause { reason } => {
                client.pause(&reason).await?;
                let season = client.season().await?;
                print(self.json, &season, || season_text(&season))
            }
            Action::Resume => {
                client.resume().await?;
                let season = client.season().await?;
                print(self.json, &season, || season_text(&season))
            }
            Action::Export { file, public } => {
                export::export(&client, self.json, &file, public).await
            }
            Action::Season {
                action: SeasonAction::Show,
            } => {
                let season = client.season().await?;
                print(self.json, &season, || season_text(&season))
            }
            Action::Season {
                action: SeasonAction::Close { confirm },
            } => {
                let Some(confirm) = confirm else {
                    let season = client.season().await?;
                    bail!(
                        "closing {:?} publishes its secret and ends uploads and evaluations; this cannot \
                        be undone. To close it, run: faceoff admin season close --confirm {:?}",
                        season.name,
                        season.name
                    );
                };
                let season = client.close_season(&confirm).await?;
                print(self.json, &season, || season_text(&season))
            }
            Action::Log {
                actor,
                subject,
                kind,
                limit,
                before,
            } => {
                let parameters: Vec<(&str, String)> = [
                    ("limit", Some(limit.to_string())),
                    ("actor", actor),
                    ("subject", subject),
                    ("kind", kind),
                    ("before", before.map(|number| number.to_string())),
                ]
                .into_iter()
                .filter_map(|(name, value)| Some((name, value?)))
                .collect();
                let page = client.events(&parameters).await?;
                print(self.json, &page, || {
                    let mut lines: Vec<String> = page.events.iter().map(event_line).collect();
                    lines.extend(
                        page.next_before
                            .map(|number| format!("older entries: --before {number}")),
                    );
                    lines_or(lines, "no matching entry")
                })
            }
            Action::Evaluations { day } => {
                let mut evaluations = client.evaluations(day).await?;
                for evaluation in &mut evaluations {
                    // Lists leave out the faults.
                    if let EvaluationStatus::AgentFailed { .. } = evaluation.status {
                        *evaluation = client.evaluation(evaluation.id).await?;
                    }
                }
                print(self.json, &evaluations, || {
                    lines_or(
                        evaluations.iter().map(evaluation_line).collect(),
                        "no evaluation on that day",
                    )
                })
            }
        }
    }
}

/// Number, time, actor, kind, subject and details of a log entry.
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
