//! Webhooks, without what signs, and what came of their deliveries.

use faceoff_api::views::webhook::{
    AttemptView, DeliveryStateView, DeliveryView, WebhookState, WebhookView,
};
use faceoff_store::{Delivery, DeliveryState, Webhook};
use jiff::Timestamp;

/// A webhook, as it is at `now`.
pub fn of(webhook: Webhook, now: Timestamp) -> WebhookView {
    let state = match (webhook.dead, webhook.failing_since) {
        (Some(dead), _) => WebhookState::Dead {
            since: dead.at,
            reason: dead.reason,
        },
        (None, Some(since)) => WebhookState::Failing { since },
        (None, None) => WebhookState::Alive,
    };
    WebhookView {
        id: webhook.id,
        team: webhook.team,
        name: webhook.name,
        url: webhook.url,
        about: webhook.about,
        created_at: webhook.created_at,
        old_secret_until: webhook.old_secret_until.filter(|until| now < *until),
        state,
    }
}

pub fn delivery(delivery: Delivery) -> DeliveryView {
    DeliveryView {
        id: delivery.id,
        event: delivery.event,
        kind: delivery.kind,
        created_at: delivery.created_at,
        attempts: delivery.attempts,
        last: delivery.last.map(|last| AttemptView {
            at: last.at,
            status: last.status,
            error: last.error,
        }),
        state: match delivery.state {
            DeliveryState::Waiting { next_at } => DeliveryStateView::Waiting { next_at },
            DeliveryState::Delivered { at } => DeliveryStateView::Delivered { settled_at: at },
            DeliveryState::GivenUp { at } => DeliveryStateView::GivenUp { settled_at: at },
        },
    }
}
