//! Requests about stages and evaluation days. A *stage* has its own rules and board; at each of its *cutoffs* an *evaluation day*
//! starts.

use super::Client;
use faceoff_api::{
    requests::{
        Confirmation, Decision, MissedDay, NewExtraEvaluation, NewStage, Reason, StagePatch,
        StartDay,
    },
    views::{capacity::CapacityView, day::DayView, evaluation::EvaluationView, stage::StageView},
};
use faceoff_types::{StageDay, StageId};
use reqwest::Method;

impl Client {
    /// All stages, by opening time.
    pub async fn stages(&self) -> anyhow::Result<Vec<StageView>> {
        self.get("/stages").await
    }

    /// Organiser: whether the evaluation days of a stage fit into their time.
    pub async fn capacity(&self, id: StageId) -> anyhow::Result<CapacityView> {
        self.get(&format!("/stages/{id}/capacity")).await
    }

    /// Organiser: creates a stage.
    pub async fn create_stage(&self, new: &NewStage) -> anyhow::Result<StageView> {
        self.post("/stages", new).await
    }

    /// Organiser: changes a stage.
    pub async fn change_stage(
        &self,
        id: StageId,
        change: &StagePatch,
    ) -> anyhow::Result<StageView> {
        self.call_with_body(Method::PATCH, &format!("/stages/{id}"), change)
            .await
    }

    /// Organiser: freezes the boards of a stage.
    pub async fn freeze(&self, id: StageId, reason: String) -> anyhow::Result<StageView> {
        self.post(&format!("/stages/{id}/freeze"), &Reason { reason })
            .await
    }

    /// Organiser: unfreezes the boards of a stage.
    pub async fn unfreeze(&self, id: StageId) -> anyhow::Result<StageView> {
        self.post_empty(&format!("/stages/{id}/unfreeze")).await
    }

    /// Organiser: starts the evaluation day of a stage, by default of the open one.
    pub async fn start_day(&self, stage: Option<StageId>) -> anyhow::Result<DayView> {
        self.post("/days", &StartDay { stage }).await
    }

    /// Organiser: starts an evaluation day for a past date that had no cutoff.
    pub async fn start_missed_day(
        &self,
        id: StageId,
        missed: &MissedDay,
    ) -> anyhow::Result<DayView> {
        self.post(&format!("/stages/{id}/days"), missed).await
    }

    /// Organiser: adds one evaluation of a team to an evaluation day.
    pub async fn add_evaluation(
        &self,
        day: StageDay,
        extra: &NewExtraEvaluation,
    ) -> anyhow::Result<EvaluationView> {
        let path = format!("/stages/{}/days/{}/extra-evaluation", day.stage, day.date);
        self.post(&path, extra).await
    }

    /// Organiser: voids a whole evaluation day.
    pub async fn void_day(&self, day: StageDay, decision: &Decision) -> anyhow::Result<DayView> {
        let path = format!("/stages/{}/days/{}/void", day.stage, day.date);
        self.post(&path, decision).await
    }

    /// Organiser: starts a stage's final day, the evaluation day after its close whose results decide it.
    pub async fn start_final_day(&self, id: StageId) -> anyhow::Result<DayView> {
        self.post_empty(&format!("/stages/{id}/final")).await
    }

    /// Organiser: signs off a stage's result; `confirm` is the stage's name.
    pub async fn sign_off_stage(
        &self,
        id: StageId,
        confirm: Option<String>,
    ) -> anyhow::Result<StageView> {
        self.post(&format!("/stages/{id}/finalise"), &Confirmation { confirm })
            .await
    }
}
