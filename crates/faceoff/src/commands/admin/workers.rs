//! `faceoff admin worker`: lists, bans and readmits remote workers, the processes on other machines that run the server's jobs.

use crate::{
    client::Client,
    commands::output::{exact_time_text, lines_or, print, time_text},
};
use clap::Subcommand;
use faceoff_api::views::workers::{
    BusySlotView, WorkerBanView, WorkerState, WorkerView, WorkersView,
};
use faceoff_types::WorkerName;

#[derive(Debug, Subcommand)]
pub(super) enum WorkerAction {
    /// List the remote workers with the reasons why some get no jobs, and the bans
    List,
    /// Ban a worker: other workers repeat its jobs of all unfinished runs
    Ban {
        /// The worker's name
        worker: WorkerName,
        /// Shown to organisers and in the worker's log
        reason: String,
    },
    /// Lift the ban of a worker
    Readmit {
        /// The worker's name
        worker: WorkerName,
    },
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: WorkerAction,
) -> anyhow::Result<()> {
    match action {
        WorkerAction::List => {
            let workers = client.workers().await?;
            print(json, &workers, workers_text)
        }
        WorkerAction::Ban { worker, reason } => {
            client.ban_worker(&worker, reason).await?;
            print_workers(client, json, format!("{worker} is banned")).await
        }
        WorkerAction::Readmit { worker } => {
            client.readmit_worker(&worker).await?;
            print_workers(client, json, format!("{worker} is readmitted")).await
        }
    }
}

/// Prints the workers after a decision: as JSON, or as `text`.
async fn print_workers(client: &Client, json: bool, text: String) -> anyhow::Result<()> {
    let workers = client.workers().await?;
    print(json, &workers, |_| text)
}

fn workers_text(view: &WorkersView) -> String {
    let slots_line = format!(
        "slots in use: {} on the server, {} on remote workers",
        view.own_slots, view.remote_slots
    );
    let workers = view.workers.iter().map(worker_lines);
    let workers = match view.leases_jobs {
        true => lines_or(workers.collect(), "no worker has connected yet"),
        false => "remote workers are not enabled".to_owned(),
    };
    let bans = view.bans.iter().map(ban_lines);
    [slots_line]
        .into_iter()
        .chain(view.problems.iter().cloned())
        .chain(view.alarms.iter().cloned())
        .chain([workers])
        .chain(bans)
        .collect::<Vec<_>>()
        .join("\n")
}

fn worker_lines(worker: &WorkerView) -> String {
    let state = match worker.state {
        WorkerState::Working => "working",
        WorkerState::Idle => "idle",
        WorkerState::Refused => "refused",
        WorkerState::Silent => "silent",
    };
    let last_contact = exact_time_text(worker.last_at);
    let mut lines = vec![format!(
        "{:<24} {state}  slots:{}  version {}  last contact {last_contact}",
        worker.name, worker.slots, worker.version
    )];
    if !worker.labels.is_empty() {
        lines.push(format!("  labels: {}", worker.labels.join(", ")));
    }
    let refused = worker.refused.iter();
    lines.extend(refused.map(|reason| format!("  refused: {reason}")));
    lines.extend(worker.busy.iter().map(busy_line));
    lines.join("\n")
}

fn busy_line(busy: &BusySlotView) -> String {
    let job = busy
        .job_description
        .as_deref()
        .unwrap_or("job from before the server's start");
    let duration_note = if busy.is_long {
        "  for more than an hour"
    } else {
        ""
    };
    format!(
        "  {}: {job} since {}{duration_note}",
        busy.slot,
        busy.since.strftime("%H:%M:%S UTC")
    )
}

fn ban_lines(ban: &WorkerBanView) -> String {
    let banned_at = time_text(ban.at);
    let mut lines = vec![format!(
        "{:<24} banned since {banned_at}: {}",
        ban.worker, ban.reason
    )];
    let evaluations = ban.evaluations.iter();
    lines.extend(evaluations.map(|id| format!("  ran jobs of evaluation:{id}")));
    lines.extend(ban.games.iter().map(|id| format!("  ran game:{id}")));
    lines.join("\n")
}
