//! Webhooks, without their secrets, and their deliveries. A *webhook* is a URL, chosen by a team or an
//! organiser, to which the server sends events. A *delivery* is the sending of one event.

use faceoff_api::views::webhook::{
    DeliveryAttemptView, DeliveryStateView, DeliveryView, WebhookState, WebhookView,
};
use faceoff_store::{Delivery, DeliveryState, Webhook};
use jiff::Timestamp;

/// The webhook's state at `now`.
pub fn view(webhook: Webhook, now: Timestamp) -> WebhookView {
    let state = match (webhook.disabled, webhook.failing_since) {
        (Some(disabling), _) => WebhookState::Dead {
            since: disabling.at,
            reason: disabling.reason,
        },
        (None, Some(since)) => WebhookState::Failing { since },
        (None, None) => WebhookState::Alive,
    };
    WebhookView {
        id: webhook.id,
        team: webhook.team,
        name: webhook.name,
        url: webhook.url,
        about: webhook.topics,
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
        last: delivery.last_attempt.map(|last| DeliveryAttemptView {
            at: last.at,
            status: last.status,
            error: last.error,
        }),
        state: match delivery.state {
            DeliveryState::Pending { next_at } => DeliveryStateView::Waiting { next_at },
            DeliveryState::Delivered { at } => DeliveryStateView::Delivered { ended_at: at },
            DeliveryState::GivenUp { at } => DeliveryStateView::GivenUp { ended_at: at },
        },
    }
}
