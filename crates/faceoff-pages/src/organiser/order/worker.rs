//! Decisions about workers on other machines.

use super::sheet::Sheet;
use faceoff_api::requests::Decision;
use faceoff_service::{acts::workers, app::AppState, problem::Problem};
use faceoff_store::{Actor, WorkerName};

#[derive(Debug, Clone)]
pub(in crate::organiser) enum WorkerOrder {
    Ban(WorkerName),
    Readmit(WorkerName),
}

impl WorkerOrder {
    /// The one that a path names.
    pub(super) fn named(kind: &str, of: &str) -> Option<Self> {
        Some(match kind {
            "ban" => Self::Ban(of.parse().ok()?),
            "readmit" => Self::Readmit(of.parse().ok()?),
            _ => return None,
        })
    }

    /// What it would do.
    pub(super) fn sheet(&self) -> Sheet {
        let back = "/organiser/workers".to_owned();
        match self {
            Self::Ban(worker) => Sheet {
                title: format!("Ban the worker {worker}"),
                what: "It gets no work, and nothing is taken of it. What it plays now, and what it has played of evaluations that go on, is \
                       played again by others. What is over stays: its page lists that, to be voided or not."
                    .to_owned(),
                reason: Some("organisers and whoever runs the worker read it"),
                confirm: None,
                button: "Ban the worker",
                is_grave: true,
                back,
            },
            Self::Readmit(worker) => Sheet {
                title: format!("Readmit the worker {worker}"),
                what: "It gets work again when it asks next. Do so once its machine has been looked at: what is broken there breaks again."
                    .to_owned(),
                reason: None,
                confirm: None,
                button: "Readmit the worker",
                is_grave: false,
                back,
            },
        }
    }

    pub(super) async fn carry_out(
        &self,
        app: &AppState,
        actor: Actor,
        decision: Decision,
    ) -> Result<&'static str, Problem> {
        match self {
            Self::Ban(worker) => {
                workers::ban_worker(app, actor, worker, &decision.reason).await?;
                Ok("worker-banned")
            }
            Self::Readmit(worker) => {
                workers::readmit_worker(app, actor, worker).await?;
                Ok("worker-readmitted")
            }
        }
    }
}
