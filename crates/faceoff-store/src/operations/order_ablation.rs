use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{purpose, runs},
    reads,
    store::Store,
    tables::{
        ablations::{self, Ablation},
        plan::RunPlan,
        runs::Run,
        season,
        submissions::{self, SubmissionState},
    },
};
use faceoff_types::{AblationId, Profile, Ruleset, RunId, SeedLabel, SubmissionId, Task};
use jiff::Timestamp;

impl Store {
    /// Orders an ablation of a valid submission: every task in every profile, `plan` otherwise.
    /// [`StoreError::Conflict`] if the submission is not valid, or one of it is under way;
    /// [`StoreError::SeasonClosed`] once the season is over.
    #[boxed]
    pub async fn create_ablation(
        &self,
        actor: Actor,
        submission: SubmissionId,
        plan: &RunPlan,
        now: Timestamp,
    ) -> Result<Ablation> {
        let plan = RunPlan {
            tasks: Task::ALL.to_vec(),
            ..plan.clone()
        };
        plan.check()?;
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let taken_apart = submissions::find(tx, submission).await?;
            if taken_apart.state != SubmissionState::Valid {
                return Err(StoreError::Conflict(
                    "only a valid submission can be taken apart: wait for its smoke run, or upload a \
                     corrected one"
                        .into(),
                ));
            }
            let id = AblationId::new();
            ablations::insert(tx, id, submission, now).await?;
            for profile in Profile::ABLATION {
                let run = Run {
                    id: RunId::new(),
                    ruleset: Ruleset::CURRENT,
                    plan: RunPlan {
                        profile,
                        ..plan.clone()
                    },
                    seed: SeedLabel::Ablation,
                    keeps_recordings: false,
                };
                let (unit, team) = (purpose::ABLATION_SHARD, taken_apart.team);
                runs::create(tx, &run, &[submission], unit, team).await?;
                ablations::insert_run(tx, id, run.id).await?;
            }
            let event = Event::AblationOrdered {
                submission,
                episodes_per_task: plan.episodes_per_task,
            };
            tx.record(Subject::Ablation(id), event);
            let ordered = reads::ablations::newest(tx, submission).await?;
            ordered.ok_or(StoreError::NotFound("ablation"))
        })
        .await
    }
}
