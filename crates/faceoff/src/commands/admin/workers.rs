//! `faceoff admin worker`: who plays on other machines.

use crate::{
    client::Client,
    commands::output::{or_none, print},
};
use clap::Subcommand;
use faceoff_api::views::workers::{BusyView, WorkerBanView, WorkerState, WorkerView, WorkersView};
use faceoff_store::WorkerName;

#[derive(Debug, Subcommand)]
pub(super) enum WorkerAction {
    /// Show who plays on other machines, what keeps others from it, and who is banned
    List,
    /// Take nothing of a worker any more: what it plays and has played of runs that go on is played again by others
    Ban {
        /// What it is called
        worker: WorkerName,
        /// Organisers read it, and so does the worker's log
        reason: String,
    },
    /// Take a banned worker's work again
    Readmit {
        /// What it is called
        worker: WorkerName,
    },
}

pub(super) async fn act(client: &Client, json: bool, action: WorkerAction) -> anyhow::Result<()> {
    match action {
        WorkerAction::List => {
            let workers = client.workers().await?;
            print(json, &workers, || listed(&workers))
        }
        WorkerAction::Ban { worker, reason } => {
            client.ban_worker(&worker, reason).await?;
            told_of(client, json, || format!("{worker} is banned")).await
        }
        WorkerAction::Readmit { worker } => {
            client.readmit_worker(&worker).await?;
            told_of(client, json, || format!("{worker} is readmitted")).await
        }
    }
}

/// How all stand after a decision.
async fn told_of(client: &Client, json: bool, text: impl FnOnce() -> String) -> anyhow::Result<()> {
    let workers = client.workers().await?;
    print(json, &workers, text)
}

fn listed(of: &WorkersView) -> String {
    let own = format!(
        "slots that play: {} of the server's own, {} elsewhere",
        of.own_slots, of.remote_slots
    );
    let workers = of.workers.iter().map(worker_lines);
    let workers = match of.is_given {
        true => or_none(workers.collect(), "no worker has asked for work yet"),
        false => "no work is given to other machines".to_owned(),
    };
    let bans = of.bans.iter().map(ban_lines);
    [own]
        .into_iter()
        .chain(of.troubles.iter().cloned())
        .chain(of.alarms.iter().cloned())
        .chain([workers])
        .chain(bans)
        .collect::<Vec<_>>()
        .join("\n")
}

fn worker_lines(worker: &WorkerView) -> String {
    let state = match worker.state {
        WorkerState::Working => "works",
        WorkerState::Idle => "waits for work",
        WorkerState::Refused => "gets no work",
        WorkerState::Silent => "silent",
    };
    let at = worker.last_at.strftime("%Y-%m-%d %H:%M:%S UTC");
    let mut lines = vec![format!(
        "{:<24} {state}  slots:{}  version {}  heard of at {at}",
        worker.name, worker.slots, worker.version
    )];
    if !worker.labels.is_empty() {
        lines.push(format!("  labels: {}", worker.labels.join(", ")));
    }
    let refused = worker.refused.iter();
    lines.extend(refused.map(|why| format!("  gets no work: {why}")));
    lines.extend(worker.busy.iter().map(busy_line));
    lines.join("\n")
}

fn busy_line(busy: &BusyView) -> String {
    let what = busy.what.as_deref().unwrap_or("begun before the server");
    let long = if busy.is_long {
        "  for more than an hour"
    } else {
        ""
    };
    format!(
        "  {}: {what} since {}{long}",
        busy.slot,
        busy.since.strftime("%H:%M:%S UTC")
    )
}

fn ban_lines(ban: &WorkerBanView) -> String {
    let at = ban.at.strftime("%Y-%m-%d %H:%M UTC");
    let mut lines = vec![format!(
        "{:<24} banned since {at}: {}",
        ban.worker, ban.reason
    )];
    let evaluations = ban.evaluations.iter();
    lines.extend(evaluations.map(|id| format!("  played a part of evaluation:{id}")));
    lines.extend(ban.games.iter().map(|id| format!("  played game:{id}")));
    lines.join("\n")
}
