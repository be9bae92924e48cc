//! `faceoff webhook`: manages webhooks, which notify other programs of events.

use super::{
    output::{print, print_list, time_text},
    server::ServerArgs,
};
use crate::client::Client;
use clap::{Args, Subcommand};
use faceoff_api::{
    requests::{NewWebhook, WebhookChanges, WebhookRevival},
    views::webhook::{DeliveryStateView, DeliveryView, NewWebhookView, WebhookState, WebhookView},
};
use faceoff_types::WebhookId;
use serde_json::json;

/// Manages webhooks: signed requests that notify other programs of events (Standard Webhooks).
#[derive(Debug, Args)]
pub struct WebhookCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: WebhookAction,
}

#[derive(Debug, Subcommand)]
pub(super) enum WebhookAction {
    /// List the webhooks with their states
    List,
    /// Create a webhook and print its signing secret, which is shown only once
    Create {
        /// Name of the webhook, e.g. chat
        name: String,
        /// The address: a public https URL
        url: String,
        /// Events to send: board, queue, day_released, stage:ID, …; can be repeated [default: all events that you may
        /// see]
        #[arg(long, value_name = "EVENT")]
        about: Vec<String>,
    },
    /// Change a webhook
    Change {
        /// The webhook's id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
        /// The new name
        #[arg(long)]
        name: Option<String>,
        /// The new address
        #[arg(long)]
        url: Option<String>,
        /// Events to send, instead of the previous ones
        #[arg(long, value_name = "EVENT")]
        about: Option<Vec<String>>,
        /// Enable the webhook again after it was disabled
        #[arg(long)]
        revive: bool,
    },
    /// Replace the secret and print the new one, which is shown only once; the old one also signs for one more day
    Rotate {
        /// The webhook's id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
    },
    /// Send a test delivery
    Test {
        /// The webhook's id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
    },
    /// List the latest deliveries with their results, the newest first
    Deliveries {
        /// The webhook's id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
    },
    /// Remove a webhook
    Remove {
        /// The webhook's id
        #[arg(id = "id", value_name = "ID")]
        webhook: WebhookId,
    },
}

impl WebhookCommand {
    /// Runs the chosen action.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            run_action(&self.server.client()?, self.server.json, self.action).await
        })
    }
}

/// Runs an action with the client's token.
pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: WebhookAction,
) -> anyhow::Result<()> {
    match action {
        WebhookAction::List => {
            let webhooks = client.webhooks().await?;
            print_list(
                json,
                &webhooks,
                webhook_line,
                "no webhooks yet; create one with faceoff webhook create NAME URL",
            )
        }
        WebhookAction::Create { name, url, about } => {
            let created = client
                .create_webhook(&NewWebhook { name, url, about })
                .await?;
            print(json, &created, new_webhook_text)
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
                state: revive.then_some(WebhookRevival::Alive),
            };
            let changed = client.change_webhook(webhook, &changes).await?;
            print(json, &changed, webhook_line)
        }
        WebhookAction::Rotate { webhook } => {
            let rotated = client.rotate_webhook(webhook).await?;
            print(json, &rotated, new_webhook_text)
        }
        WebhookAction::Test { webhook } => {
            let test = client.test_webhook(webhook).await?;
            print(json, &test, |_| {
                format!(
                    "test delivery queued; for its result, run faceoff webhook deliveries {webhook}"
                )
            })
        }
        WebhookAction::Deliveries { webhook } => {
            let deliveries = client.deliveries(webhook).await?;
            print_list(json, &deliveries, delivery_line, "no deliveries yet")
        }
        WebhookAction::Remove { webhook } => {
            client.remove_webhook(webhook).await?;
            print(json, &json!({ "removed": webhook }), |_| {
                format!("{webhook} is removed")
            })
        }
    }
}

fn new_webhook_text(new: &NewWebhookView) -> String {
    format!(
        "{}\n{}\nIt is not shown again.",
        webhook_line(&new.webhook),
        new.secret
    )
}

fn webhook_line(webhook: &WebhookView) -> String {
    let state = match &webhook.state {
        WebhookState::Alive => "active".to_owned(),
        WebhookState::Failing { since } => format!("failing since {}", time_text(*since)),
        WebhookState::Dead { since, reason } => {
            format!("disabled {}: {reason}", time_text(*since))
        }
    };
    let about = match &webhook.about[..] {
        [] => "all events".to_owned(),
        about => about.join(", "),
    };
    let owner = webhook
        .team
        .map_or_else(|| "organisers".to_owned(), |id| format!("team:{id}"));
    format!(
        "{}  {:<20} {owner}  {}  {about}  {state}",
        webhook.id, webhook.name, webhook.url
    )
}

fn delivery_line(delivery: &DeliveryView) -> String {
    let state = match delivery.state {
        DeliveryStateView::Waiting { next_at } => format!("next attempt at {}", time_text(next_at)),
        DeliveryStateView::Delivered { ended_at } => format!("delivered {}", time_text(ended_at)),
        DeliveryStateView::GivenUp { ended_at } => format!("failed {}", time_text(ended_at)),
    };
    let last = delivery.last.as_ref().map_or_else(String::new, |last| {
        let status = last
            .status
            .map_or_else(|| "no answer".to_owned(), |status| status.to_string());
        match &last.error {
            Some(error) => format!("  last: {status}, {error}"),
            None => format!("  last: {status}"),
        }
    });
    format!(
        "{}  {:<24} {} attempts  {state}{last}",
        time_text(delivery.created_at),
        delivery.kind,
        delivery.attempts
    )
}
