//! Webhooks, which notify other programs of events.

use super::Client;
use faceoff_api::{
    requests::{NewWebhook, WebhookChanges},
    views::webhook::{DeliveryView, NewWebhookView, WebhookView},
};
use faceoff_types::WebhookId;
use reqwest::Method;

impl Client {
    /// The team's webhooks; for an organiser, all.
    pub async fn webhooks(&self) -> anyhow::Result<Vec<WebhookView>> {
        self.get("/webhooks").await
    }

    /// Creates a webhook; only this response has its secret.
    pub async fn create_webhook(&self, new: &NewWebhook) -> anyhow::Result<NewWebhookView> {
        self.post("/webhooks", new).await
    }

    pub async fn change_webhook(
        &self,
        id: WebhookId,
        changes: &WebhookChanges,
    ) -> anyhow::Result<WebhookView> {
        self.call_with_body(Method::PATCH, &format!("/webhooks/{id}"), changes)
            .await
    }

    /// Replaces the secret of a webhook; only this response has the new one.
    pub async fn rotate_webhook(&self, id: WebhookId) -> anyhow::Result<NewWebhookView> {
        self.post_empty(&format!("/webhooks/{id}/rotate")).await
    }

    /// Makes the server send a test delivery to the webhook's address, and returns its outcome.
    pub async fn test_webhook(&self, id: WebhookId) -> anyhow::Result<DeliveryView> {
        self.post_empty(&format!("/webhooks/{id}/test")).await
    }

    pub async fn remove_webhook(&self, id: WebhookId) -> anyhow::Result<()> {
        let request = self.request(Method::DELETE, &format!("/webhooks/{id}"));
        self.send(request).await.map(drop)
    }

    /// The latest deliveries, the newest first.
    pub async fn deliveries(&self, id: WebhookId) -> anyhow::Result<Vec<DeliveryView>> {
        self.get(&format!("/webhooks/{id}/deliveries")).await
    }
}
