//! Requests about evaluations. An *evaluation* is the run of one team's submission on all tasks.

use super::Client;
use faceoff_api::{
    requests::{Cancellation, ComparisonQuery, Decision},
    views::{comparison::ComparisonView, evaluation::EvaluationView},
};
use faceoff_types::EvaluationId;
use jiff::civil::Date;
use reqwest::Method;

impl Client {
    /// Organiser: all evaluations of a day (default: today). Team: its own (default: of all days).
    pub async fn evaluations(&self, day: Option<Date>) -> anyhow::Result<Vec<EvaluationView>> {
        let request = self.request(Method::GET, "/evaluations");
        let request = match day {
            Some(day) => request.query(&[("day", day.to_string())]),
            None => request,
        };
        self.list(request).await
    }

    /// Team: its newest evaluations, at most `limit` (up to 200).
    pub async fn newest_evaluations(&self, limit: usize) -> anyhow::Result<Vec<EvaluationView>> {
        let query = [("limit", limit.clamp(1, 200))];
        let mut newest: Vec<EvaluationView> = self.get_with_query("/evaluations", &query).await?;
        newest.truncate(limit);
        Ok(newest)
    }

    /// Team or organiser: one evaluation.
    pub async fn evaluation(&self, id: EvaluationId) -> anyhow::Result<EvaluationView> {
        self.get(&format!("/evaluations/{id}")).await
    }

    /// Compares two finished evaluations on the same episodes.
    pub async fn compare(
        &self,
        a: EvaluationId,
        b: EvaluationId,
        query: ComparisonQuery,
    ) -> anyhow::Result<ComparisonView> {
        let path = format!("/evaluations/{a}/compare/{b}");
        self.get_with_query(&path, &query).await
    }

    /// Team: publishes one of its own evaluations.
    pub async fn publish(&self, id: EvaluationId) -> anyhow::Result<EvaluationView> {
        self.post_empty(&format!("/evaluations/{id}/publish")).await
    }

    /// Organiser: repeats an evaluation that was cancelled or failed by a platform fault.
    pub async fn rerun(&self, id: EvaluationId) -> anyhow::Result<EvaluationView> {
        self.post_empty(&format!("/evaluations/{id}/rerun")).await
    }

    /// Organiser: stops an evaluation.
    pub async fn cancel(&self, id: EvaluationId, reason: String) -> anyhow::Result<EvaluationView> {
        self.post(
            &format!("/evaluations/{id}/cancel"),
            &Cancellation { reason },
        )
        .await
    }

    /// Organiser: voids a result, which leaves the boards.
    pub async fn void(
        &self,
        id: EvaluationId,
        decision: &Decision,
    ) -> anyhow::Result<EvaluationView> {
        self.post(&format!("/evaluations/{id}/void"), decision)
            .await
    }
}
