//! Programs that are told of what happens.

use super::Client;
use faceoff_api::{
    requests::{NewWebhook, WebhookChanges},
    views::webhook::{DeliveryView, NewWebhookView, WebhookView},
};
use faceoff_types::WebhookId;
use reqwest::Method;

impl Client {
    /// Ours, or as an organiser all.
    pub async fn webhooks(&self) -> anyhow::Result<Vec<WebhookView>> {
        self.get("/webhooks").await
    }

    /// Makes one; its secret comes this once.
    pub async fn create_webhook(&self, new: &NewWebhook) -> anyhow::Result<NewWebhookView> {
        self.tell(Method::POST, "/webhooks", new).await
    }

    pub async fn change_webhook(
        &self,
        id: WebhookId,
        changes: &WebhookChanges,
    ) -> anyhow::Result<WebhookView> {
        self.tell(Method::PATCH, &format!("/webhooks/{id}"), changes)
            .await
    }

    /// Gives one another secret, which comes this once.
    pub async fn rotate_webhook(&self, id: WebhookId) -> anyhow::Result<NewWebhookView> {
        self.act(Method::POST, &format!("/webhooks/{id}/rotate"))
            .await
    }

    /// Has one told something, to see whether it takes it.
    pub async fn test_webhook(&self, id: WebhookId) -> anyhow::Result<DeliveryView> {
        self.act(Method::POST, &format!("/webhooks/{id}/test"))
            .await
    }

    /// Has one told nothing more.
    pub async fn remove_webhook(&self, id: WebhookId) -> anyhow::Result<()> {
        let request = self.request(Method::DELETE, &format!("/webhooks/{id}"));
        self.send(request).await.map(drop)
    }

    /// What one was told of late, the newest first.
    pub async fn deliveries(&self, id: WebhookId) -> anyhow::Result<Vec<DeliveryView>> {
        self.get(&format!("/webhooks/{id}/deliveries")).await
    }
}
