//! `faceoff webhook`: programs that the server tells of what happens.

use super::{
    output::{or_none, print},
    server::ServerArgs,
};
use crate::client::Client;
use clap::{Args, Subcommand};
use faceoff_api::{
    requests::{NewWebhook, Revived, WebhookChanges},
    views::webhook::{DeliveryStateView, DeliveryView, NewWebhookView, WebhookState, WebhookView},
};
use faceoff_types::WebhookId;
use jiff::Timestamp;
use serde_json::json;

/// Has programs told of what happens, by signed requests (Standard Webhooks).
#[derive(Debug, Args)]
pub struct WebhookCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: WebhookAction,
}

/// What can be done with webhooks.
#[derive(Debug, Subcommand)]
pub(super) enum WebhookAction {
    /// List them, with those that take nothing
    List,
    /// Have an address told, and print the secret of its signatures, this once
    Create {
        /// What it is for, e.g. chat
        name: String,
        /// The address: https, and on the Internet
        url: String,
        /// Of what: board, queue, day_released, stage:ID, …; may be given again [default: everything that you may know]
        #[arg(long, value_name = "WHAT")]
        about: Vec<String>,
    },
    /// Change one
    Change {
        /// Its id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
        /// What it is for
        #[arg(long)]
        name: Option<String>,
        /// The address
        #[arg(long)]
        url: Option<String>,
        /// Of what it is told, in place of what it was
        #[arg(long, value_name = "WHAT")]
        about: Option<Vec<String>>,
        /// Tell it again, if it was given up
        #[arg(long)]
        revive: bool,
    },
    /// Give one another secret and print it, this once; the old one signs, too, for a day
    Rotate {
        /// Its id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
    },
    /// Have one told something, to see whether it takes it
    Test {
        /// Its id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
    },
    /// Show what one was told of late, and what came of it, the newest first
    Deliveries {
        /// Its id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
    },
    /// Have one told nothing more
    Remove {
        /// Its id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
    },
}

impl WebhookCommand {
    /// Does what was asked.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async { act(&self.server.client()?, self.server.json, self.action).await })
    }
}

/// Does it, as whoever the client is.
pub(super) async fn act(client: &Client, json: bool, action: WebhookAction) -> anyhow::Result<()> {
    match action {
        WebhookAction::List => {
            let webhooks = client.webhooks().await?;
            print(json, &webhooks, || {
                let lines = webhooks.iter().map(line).collect();
                or_none(lines, "no webhook yet: faceoff webhook create NAME URL")
            })
        }
        WebhookAction::Create { name, url, about } => {
            let made = client
                .create_webhook(&NewWebhook { name, url, about })
                .await?;
            print(json, &made, || with_secret(&made))
        }
        WebhookAction::Change {
            webhook,
            name,
            url,
            about,
            revive,
        } => {
            let changes = WebhookChanges {
                name,
                url,
                about,
                state: revive.then_some(Revived::Alive),
            };
            let changed = client.change_webhook(webhook, &changes).await?;
            print(json, &changed, || line(&changed))
        }
        WebhookAction::Rotate { webhook } => {
            let made = client.rotate_webhook(webhook).await?;
            print(json, &made, || with_secret(&made))
        }
        WebhookAction::Test { webhook } => {
            let test = client.test_webhook(webhook).await?;
            print(json, &test, || {
                format!(
                    "it is sent in a moment; faceoff webhook deliveries {webhook} says what came of it"
                )
            })
        }
        WebhookAction::Deliveries { webhook } => {
            let told = client.deliveries(webhook).await?;
            print(json, &told, || {
                or_none(
                    told.iter().map(delivery).collect(),
                    "it was told nothing yet",
                )
            })
        }
        WebhookAction::Remove { webhook } => {
            client.remove_webhook(webhook).await?;
            print(json, &json!({ "removed": webhook }), || {
                format!("{webhook} is told nothing more")
            })
        }
    }
}

fn shown(at: Timestamp) -> String {
    at.strftime("%Y-%m-%d %H:%M UTC").to_string()
}

fn with_secret(made: &NewWebhookView) -> String {
    format!(
        "{}\n{}\nIt is not shown again.",
        line(&made.webhook),
        made.secret
    )
}

fn line(webhook: &WebhookView) -> String {
    let state = match &webhook.state {
        WebhookState::Alive => "takes what it is told".to_owned(),
        WebhookState::Failing { since } => format!("has taken nothing since {}", shown(*since)),
        WebhookState::Dead { since, reason } => {
            format!("given up {}: {reason}", shown(*since))
        }
    };
    let about = match &webhook.about[..] {
        [] => "everything".to_owned(),
        about => about.join(", "),
    };
    let owner = webhook
        .team
        .map_or_else(|| "organisers".to_owned(), |id| format!("team:{id}"));
    format!(
        "{}  {:<20} {owner}  {}  of {about}  {state}",
        webhook.id, webhook.name, webhook.url
    )
}

fn delivery(told: &DeliveryView) -> String {
    let state = match told.state {
        DeliveryStateView::Waiting { next_at } => format!("sent at {}", shown(next_at)),
        DeliveryStateView::Delivered { settled_at } => format!("taken {}", shown(settled_at)),
        DeliveryStateView::GivenUp { settled_at } => format!("given up {}", shown(settled_at)),
    };
    let last = told.last.as_ref().map_or_else(String::new, |last| {
        let status = last
            .status
            .map_or_else(|| "no answer".to_owned(), |status| status.to_string());
        match &last.error {
            Some(error) => format!("  last: {status}, {error}"),
            None => format!("  last: {status}"),
        }
    });
    format!(
        "{}  {:<24} {} tries  {state}{last}",
        shown(told.created_at),
        told.kind,
        told.attempts
    )
}
