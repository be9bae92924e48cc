//! Requests for ablations. An ablation runs a submission without perturbations, with each kind of perturbation alone, and
//! with all, to show which kind costs it points. Each of these sets of perturbations is a *profile*.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{job_purpose, runs},
    queries,
    store::Store,
    tables::{
        ablations::{self, Ablation},
        run_plan::RunPlan,
        runs::Run,
        season,
        submissions::{self, SubmissionState},
    },
};
use faceoff_types::{AblationId, Profile, Ruleset, RunId, SeedLabel, SubmissionId};
use jiff::Timestamp;

impl Store {
    /// Queues an ablation of a valid submission: the plan's tasks in each of the profiles, instead of in the plan's.
    /// [`StoreError::Conflict`] if the submission is not valid, or has an open ablation;
    /// [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn request_ablation(
        &self,
        actor: Actor,
        submission: SubmissionId,
        ruleset: Ruleset,
        plan: &RunPlan,
        profiles: &[Profile],
        now: Timestamp,
    ) -> Result<Ablation> {
        plan.check()?;
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let ablated = submissions::find(tx, submission).await?;
            if ablated.state != SubmissionState::Valid {
                return StoreError::conflict(
                    "only a valid submission can be ablated: wait for its validation run, or upload a \
                     corrected one",
                );
            }
            let id = AblationId::new();
            ablations::insert(tx, id, submission, now).await?;
            for profile in profiles.iter().copied() {
                let run = Run {
                    id: RunId::new(),
                    ruleset,
                    plan: RunPlan {
                        profile,
                        ..plan.clone()
                    },
                    seed: SeedLabel::Ablation,
                    keeps_recordings: false,
                };
                let job_template = job_purpose::ABLATION_SHARD;
                runs::queue_run(tx, &run, &[submission], job_template, ablated.team).await?;
                ablations::insert_run(tx, id, run.id).await?;
            }
            let event = Event::AblationRequested {
                submission,
                episodes_per_task: plan.episodes_per_task,
            };
            tx.record(Subject::Ablation(id), event);
            let ablation = queries::ablations::newest(tx, submission).await?;
            ablation.ok_or(StoreError::NotFound("ablation"))
        })
        .await
    }
}
