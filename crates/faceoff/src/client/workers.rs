//! Who plays on other machines.

use super::Client;
use faceoff_api::{requests::Reason, views::workers::WorkersView};
use faceoff_store::WorkerName;
use reqwest::Method;

impl Client {
    /// Organiser: who plays beside the server's own slots, and of whom nothing is taken.
    pub async fn workers(&self) -> anyhow::Result<WorkersView> {
        self.get("/workers").await
    }

    /// Organiser: takes nothing of a worker any more.
    pub async fn ban_worker(&self, name: &WorkerName, reason: String) -> anyhow::Result<()> {
        let request = self.request(Method::POST, &format!("/workers/{name}/ban"));
        self.send(request.json(&Reason { reason })).await.map(drop)
    }

    /// Organiser: takes a banned worker's work again.
    pub async fn readmit_worker(&self, name: &WorkerName) -> anyhow::Result<()> {
        let request = self.request(Method::POST, &format!("/workers/{name}/readmit"));
        self.send(request).await.map(drop)
    }
}
