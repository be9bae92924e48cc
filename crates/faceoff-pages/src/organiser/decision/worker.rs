//! Decisions about remote workers, which run jobs on other machines: ban one or readmit it.

use super::preview::{DecisionOutcome, DecisionPreview};
use faceoff_api::requests;
use faceoff_service::{app::AppState, problem::Problem, services::workers};
use faceoff_store::Actor;
use faceoff_types::WorkerName;

#[derive(Debug, Clone)]
pub(in crate::organiser) enum WorkerDecision {
    Ban(WorkerName),
    Readmit(WorkerName),
}

/// Page to return to.
const WORKERS_PATH: &str = "/organiser/workers";

impl WorkerDecision {
    pub(super) fn preview(&self) -> DecisionPreview {
        match self {
            Self::Ban(worker) => DecisionPreview {
                title: format!("Ban the worker {worker}"),
                effects: "The worker will get no jobs, and its results will be rejected. Its running jobs and its part of unfinished \
                          evaluations will be repeated on other workers. Finished results will stay; the page of workers will list \
                          them, so that you can void them."
                    .to_owned(),
                reason_readers: Some("visible to organisers and the operator of the worker"),
                button: "Ban the worker",
                is_grave: true,
                ..DecisionPreview::new(WORKERS_PATH)
            },
            Self::Readmit(worker) => DecisionPreview {
                title: format!("Readmit the worker {worker}"),
                effects: "The worker will get jobs again. Check its machine first: a faulty machine will fail again."
                    .to_owned(),
                button: "Readmit the worker",
                ..DecisionPreview::new(WORKERS_PATH)
            },
        }
    }

    pub(super) async fn carry_out(
        &self,
        app: &AppState,
        actor: Actor,
        request: requests::Decision,
    ) -> Result<DecisionOutcome, Problem> {
        let notice = match self {
            Self::Ban(worker) => {
                workers::ban_worker(app, actor, worker, &request.reason).await?;
                "worker-banned"
            }
            Self::Readmit(worker) => {
                workers::readmit_worker(app, actor, worker).await?;
                "worker-readmitted"
            }
        };
        Ok(DecisionOutcome::new(notice, WORKERS_PATH))
    }
}
