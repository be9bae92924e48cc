//! Remote workers: processes on other machines that run the server's jobs.

use super::Client;
use faceoff_api::{requests::Reason, views::workers::WorkersView};
use faceoff_types::WorkerName;
use reqwest::Method;

impl Client {
    /// Organiser: the remote workers, and the bans that exclude some of them from jobs.
    pub async fn workers(&self) -> anyhow::Result<WorkersView> {
        self.get("/workers").await
    }

    /// Organiser: bans a worker.
    pub async fn ban_worker(&self, name: &WorkerName, reason: String) -> anyhow::Result<()> {
        let request = self.request(Method::POST, &format!("/workers/{name}/ban"));
        self.send(request.json(&Reason { reason })).await.map(drop)
    }

    /// Organiser: lifts the ban of a worker.
    pub async fn readmit_worker(&self, name: &WorkerName) -> anyhow::Result<()> {
        let request = self.request(Method::POST, &format!("/workers/{name}/readmit"));
        self.send(request).await.map(drop)
    }
}
