//! `faceoff admin`: organises a running competition through its API.

mod output;
mod stage;

use super::serve::ADMIN_TOKEN_FILE;
use crate::{client::Client, config::Config};
use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use faceoff_http::{
    requests::Decision,
    views::{
        evaluation::{EvaluationStatus, EvaluationView},
        event::EventView,
        season::SeasonView,
    },
};
use faceoff_types::{EvaluationId, StageDay, TeamId};
use jiff::civil::Date;
use output::{or_none, print};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Organises a running competition.
#[derive(Debug, Args)]
pub struct AdminCommand {
    /// The server
    #[arg(
        long,
        global = true,
        value_name = "URL",
        env = "FACEOFF_SERVER",
        default_value = "http://127.0.0.1:8080"
    )]
    server: String,
    /// The organiser's token [default: the file admin-token in the data folder]
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
    /// Print the server's answer as JSON
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Create a team and print its token, which is shown this once
    CreateTeam {
        /// 1 to 40 letters, digits, spaces and . _ -
        name: String,
    },
    /// Replace a team's token; the old one is worth nothing from then on
    NewToken {
        /// The team's name or id
        team: String,
    },
    /// Start a stage's day: what each team has active now plays it. A day starts once
    StartDay {
        /// The stage's name or id [default: the one that is open]
        #[arg(long)]
        stage: Option<String>,
    },
    /// Make, change or list the stages: their times, rules and schedules
    Stage {
        #[command(subcommand)]
        action: stage::StageAction,
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
    /// Disqualify a team: it neither plays nor is ranked, at once; without --confirm, say what that would do
    Disqualify {
        /// The team's name or id
        team: String,
        /// Shown to everybody
        reason: String,
        /// The team's name
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Let a disqualified team play and be ranked again
    Reinstate {
        /// The team's name or id
        team: String,
        /// Kept in the log
        reason: String,
    },
    /// Show the season, or close it
    Season {
        #[command(subcommand)]
        action: SeasonAction,
    },
    /// List the teams
    Teams,
    /// List what was changed, when and by whom, the newest first
    Log {
        /// Who: organiser, team, team:ID, schedule, worker, worker:NAME or server
        #[arg(long)]
        actor: Option<String>,
        /// About what: season, stage:ID, day:STAGE/DATE, team:ID, submission:ID, evaluation:ID or ablation:ID
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
        tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("starting the async runtime")?
            .block_on(self.act())
    }

    async fn act(self) -> anyhow::Result<()> {
        let token = match self.token {
            Some(token) => token,
            None => token_of(self.data_dir.as_deref())?,
        };
        let client = Client::new(&self.server, Some(token.trim()))?;
        match self.action {
            Action::CreateTeam { name } => {
                let created = client.create_team(&name).await?;
                print(self.json, &created, || {
                    format!(
                        "team {} ({})\ntoken {}\nIt is not shown again; give it to the team.",
                        created.team.name, created.team.id, created.token
                    )
                })
            }
            Action::NewToken { team } => {
                let team = find_team(&client, &team).await?;
                let replaced = client.replace_token(team).await?;
                print(self.json, &replaced, || {
                    format!(
                        "team {} ({})\ntoken {}\nThe old token is worth nothing from now on.",
                        replaced.team.name, replaced.team.id, replaced.token
                    )
                })
            }
            Action::Stage { action } => stage::act(&client, self.json, action).await,
            Action::StartDay { stage } => {
                let stage = match stage {
                    Some(stage) => Some(stage::find(&client, &stage).await?.id),
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
                let stage = stage::find(&client, &stage).await?.id;
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
            Action::Disqualify {
                team,
                reason,
                confirm,
            } => {
                let team = find_team(&client, &team).await?;
                let decision = Decision { reason, confirm };
                let team = client.disqualify(team, &decision).await?;
                print(self.json, &team, || {
                    format!("{} is disqualified", team.name)
                })
            }
            Action::Reinstate { team, reason } => {
                let team = find_team(&client, &team).await?;
                let team = client.reinstate(team, &reason).await?;
                print(self.json, &team, || format!("{} is reinstated", team.name))
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
            Action::Teams => {
                let teams = client.teams().await?;
                print(self.json, &teams, || {
                    let lines: Vec<_> = teams
                        .iter()
                        .map(|team| {
                            let disqualified = match &team.disqualified {
                                Some(ruling) => format!("  disqualified: {}", ruling.reason),
                                None => String::new(),
                            };
                            format!(
                                "{:<40} {}  since {}{disqualified}",
                                team.name,
                                team.id,
                                team.created_at.strftime("%Y-%m-%d")
                            )
                        })
                        .collect();
                    or_none(
                        lines,
                        "no team yet; create one with faceoff admin create-team NAME",
                    )
                })
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
        event.actor,
        event.kind,
        event.subject,
        details.join(" ")
    )
    .trim_end()
    .to_owned()
}

/// The token from the file that the server made.
fn token_of(data_dir: Option<&Path>) -> anyhow::Result<String> {
    let data_dir = match data_dir {
        Some(data_dir) => data_dir.to_owned(),
        None => Config::load(None)?.server.data_dir,
    };
    let file = data_dir.join(ADMIN_TOKEN_FILE);
    std::fs::read_to_string(&file).with_context(|| {
        format!(
            "reading the organiser's token from {}; name the server's folder with --data-dir, or give \
             the token with --token or FACEOFF_ADMIN_TOKEN",
            file.display()
        )
    })
}

async fn find_team(client: &Client, wanted: &str) -> anyhow::Result<TeamId> {
    if let Ok(id) = wanted.parse() {
        return Ok(id);
    }
    let teams = client.teams().await?;
    match teams.iter().find(|team| team.name.as_str() == wanted) {
        Some(team) => Ok(team.id),
        None => bail!("no team is named {wanted:?}; faceoff admin teams lists them"),
    }
}

fn of_season(season: &SeasonView) -> String {
    let state = match (season.closed_at, season.secret) {
        (Some(closed_at), Some(secret)) => {
            let closed_at = closed_at.strftime("%Y-%m-%d %H:%M UTC");
            format!("closed     {closed_at}\nsecret     {secret}")
        }
        _ => "open       its secret is published when it is closed".to_owned(),
    };
    let queue = match &season.paused {
        Some(ruling) => {
            let since = ruling.at.strftime("%Y-%m-%d %H:%M UTC");
            format!("\npaused     since {since}: {}", ruling.reason)
        }
        None => String::new(),
    };
    format!(
        "{} ({}), {} days played\ncommitment {}\n{state}{queue}",
        season.name,
        season.ruleset,
        season.days.len(),
        season.commitment
    )
}

fn line(evaluation: &EvaluationView) -> String {
    if let Some(ruling) = &evaluation.voided {
        let (team, id) = (&evaluation.team_name, evaluation.id);
        return format!("{team:<40} {id}  voided: {}", ruling.reason);
    }
    let progress = evaluation.progress;
    let state = match &evaluation.status {
        EvaluationStatus::Queued => "queued".to_owned(),
        EvaluationStatus::Running => {
            format!(
                "running, {} of {} episodes",
                progress.episodes_done, progress.episodes_total
            )
        }
        EvaluationStatus::Finalising => "computing the score".to_owned(),
        EvaluationStatus::Finished { result: None, .. } => "finished".to_owned(),
        EvaluationStatus::Finished {
            result: Some(result),
            ..
        } => format!(
            "finished: score {:.1}, {:.1} penalty points, {}",
            result.score,
            result.penalty_points,
            result.tier.title().to_lowercase()
        ),
        EvaluationStatus::AgentFailed { .. } => "the agent failed".to_owned(),
        EvaluationStatus::PlatformFailed { reason, .. } => format!("our fault: {reason}"),
        EvaluationStatus::Cancelled { reason, .. } => format!("cancelled: {reason}"),
    };
    format!("{:<40} {}  {state}", evaluation.team_name, evaluation.id)
}
