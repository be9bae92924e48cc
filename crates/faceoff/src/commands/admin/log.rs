//! `faceoff admin log`: lists the log of changes.

use crate::{
    client::Client,
    commands::output::{exact_time_text, lines_or, print},
};
use clap::Args;
use faceoff_api::views::event::EventView;
use serde_json::Value;

#[derive(Debug, Args)]
pub(super) struct LogArgs {
    /// Only by this actor: organiser (the operator), person:ID, team:ID, visitor, schedule, worker:NAME or server;
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
}

/// Prints the newest entries of the log that match.
pub(super) async fn list(client: &Client, json: bool, args: LogArgs) -> anyhow::Result<()> {
    let parameters: Vec<(&str, String)> = [
        ("limit", Some(args.limit.to_string())),
        ("actor", args.actor),
        ("subject", args.subject),
        ("kind", args.kind),
        ("before", args.before.map(|number| number.to_string())),
    ]
    .into_iter()
    .filter_map(|(name, value)| Some((name, value?)))
    .collect();
    let page = client.events(&parameters).await?;
    print(json, &page, |page| {
        let mut lines: Vec<String> = page.events.iter().map(event_line).collect();
        lines.extend(
            page.next_before
                .map(|number| format!("older entries: --before {number}")),
        );
        lines_or(lines, "no matching entry")
    })
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
        exact_time_text(event.at),
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
