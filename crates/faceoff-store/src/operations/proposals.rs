//! Proposals: evaluations that do not count, or not yet. A trial evaluates submissions on episodes of its own and never
//! counts. A proposed re-evaluation repeats counting evaluations; its results replace theirs once an organiser applies it.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{job_purpose, organiser_decisions::void, run_completion, runs},
    queries,
    queue::NewJob,
    store::Store,
    tables::{
        board_freezes, counting_evaluations, days,
        evaluation_specs::{self, EvaluationSpec},
        evaluations::{self, EvaluationState, Failure, ProposedEvaluation},
        proposals::{self, Proposal, ProposalKind, ProposalOutcome},
        run_plan::RunPlan,
        runs as run_rows,
        runs::Run,
        season, sign_offs, stage_runtimes,
        stages::{self, Stage, StagePhase},
        submissions,
    },
    write::Tx,
};
use faceoff_types::{
    EvaluationId, ProposalId, Ruleset, RunId, SeedLabel, StageDay, StageId, SubmissionId, TeamId,
};
use jiff::Timestamp;
use std::collections::HashSet;

/// Scope of a proposed re-evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reevaluation {
    /// One counting evaluation.
    Evaluation(EvaluationId),
    /// All counting evaluations of a day.
    Day(StageDay),
    /// All counting evaluations of a day, with the newest rules of its stage.
    DayWithNewestRules(StageDay),
}

/// One evaluation of a proposal, before it is queued. `replaces` is the evaluation that it repeats.
struct ProposedRun {
    submission: SubmissionId,
    team: TeamId,
    replaces: Option<EvaluationId>,
    seed: SeedLabel,
    ruleset: Ruleset,
    plan: RunPlan,
}

/// Adds a proposal and queues its evaluations, behind everything that counts.
async fn add_proposal(tx: &mut Tx, proposal: &Proposal, proposed: Vec<ProposedRun>) -> Result<()> {
    proposals::insert(tx, proposal).await?;
    let job = NewJob {
        batch: tx.now.as_millisecond(),
        ..job_purpose::PROPOSAL_SHARD
    };
    let count = u32::try_from(proposed.len()).unwrap_or(u32::MAX);
    for proposed_run in proposed {
        let run = Run {
            id: RunId::new(),
            ruleset: proposed_run.ruleset,
            plan: proposed_run.plan,
            seed: proposed_run.seed,
            keeps_recordings: true,
        };
        runs::queue_run(tx, &run, &[proposed_run.submission], job, proposed_run.team).await?;
        let owner = (proposed_run.submission, proposed_run.team);
        evaluation_specs::insert_proposed(tx, proposal, owner, run.id, proposed_run.replaces)
            .await?;
    }
    let event = Event::ProposalMade {
        stage: proposal.stage,
        evaluations: count,
        reason: proposal.reason.clone(),
    };
    tx.record(Subject::Proposal(proposal.id), event);
    Ok(())
}

/// Runs that repeat these evaluations, each with the revision of its rules: those of the stage `newest`, if it is given,
/// or else the evaluation's own.
async fn reevaluation_runs(
    tx: &mut Tx,
    ids: &[EvaluationId],
    newest: Option<&Stage>,
) -> Result<Vec<(u32, ProposedRun)>> {
    let mut all = Vec::with_capacity(ids.len());
    for id in ids {
        all.push(evaluation_specs::find(tx, *id).await?);
    }
    let has_newest_rules =
        |spec: &EvaluationSpec| newest.is_some_and(|stage| stage.revision.number == spec.revision);
    let teams_with_newest_rules: HashSet<TeamId> = all
        .iter()
        .filter(|spec| has_newest_rules(spec))
        .map(|spec| spec.team)
        .collect();
    let mut proposed = Vec::new();
    for spec in all
        .into_iter()
        .filter(|spec| !teams_with_newest_rules.contains(&spec.team))
    {
        let submission = submissions::find(tx, spec.submission).await?;
        // In a proposal for several teams, a submission with a deleted bundle is left out. A proposal for this submission
        // alone is refused below, with the reason.
        let is_deleted = ids.len() > 1 && submission.bundle_removed.is_some();
        if is_deleted || newest.is_some_and(|stage| stage.check_accepts(&submission).is_err()) {
            continue;
        }
        let run = run_rows::find(tx, spec.run).await?;
        let (revision, ruleset, plan) = match newest {
            None => (spec.revision, run.ruleset, run.plan),
            Some(stage) => (
                stage.revision.number,
                stage.revision.rules.ruleset,
                stage.plan(),
            ),
        };
        let proposed_run = ProposedRun {
            submission: spec.submission,
            team: spec.team,
            replaces: Some(spec.id),
            seed: run.seed,
            ruleset,
            plan,
        };
        proposed.push((revision, proposed_run));
    }
    Ok(proposed)
}

impl Store {
    /// Queues a trial of a stage's active submissions, or of one valid submission, by the stage's rules on episodes of
    /// its own. It appears on no board and runs behind everything that counts. [`StoreError::Conflict`] if there is no
    /// submission to try or the stage has closed; [`StoreError::SeasonClosed`].
    #[boxed_future]
    pub async fn propose_trial(
        &self,
        actor: Actor,
        stage: StageId,
        submission: Option<SubmissionId>,
        reason: &str,
        now: Timestamp,
    ) -> Result<Proposal> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let stage = stages::find(tx, stage).await?;
            if stage.phase(now) == StagePhase::Closed {
                return StoreError::conflict("the stage has closed: no trial can start");
            }
            let active = match submission {
                None => {
                    let mut active = submissions::active(tx).await?;
                    active.retain(|submission| stage.check_accepts(submission).is_ok());
                    active
                }
                Some(id) => vec![submissions::find(tx, id).await?],
            };
            if active.is_empty() {
                return StoreError::conflict(
                    "no team has a valid submission that the stage accepts, so there is nothing to try",
                );
            }
            if active
                .iter()
                .any(|submission| submission.state != submissions::SubmissionState::Valid)
            {
                return StoreError::conflict("only a valid submission can be tried");
            }
            for submission in &active {
                stage
                    .check_accepts(submission)
                    .map_err(|refusal| stage_runtimes::conflict(&refusal))?;
            }
            let id = ProposalId::new();
            let proposal = Proposal {
                id,
                stage: stage.id,
                revision: stage.revision.number,
                kind: ProposalKind::Trial,
                reason: reason.to_owned(),
                created_at: now,
                outcome: None,
            };
            let proposed = active.into_iter().map(|submission| ProposedRun {
                submission: submission.id,
                team: submission.team,
                replaces: None,
                seed: SeedLabel::Trial(id),
                ruleset: stage.revision.rules.ruleset,
                plan: stage.plan(),
            });
            add_proposal(tx, &proposal, proposed.collect()).await?;
            proposals::find(tx, id).await
        })
        .await
    }

    /// Queues a re-evaluation of counting results, behind everything that counts: the same submissions on the same
    /// episodes. The results stay until the proposal is applied. [`StoreError::Conflict`] if there is no counting
    /// result or the day is not released; for new rules, if all results have them already.
    #[boxed_future]
    pub async fn propose_reevaluation(
        &self,
        actor: Actor,
        scope: Reevaluation,
        reason: &str,
        now: Timestamp,
    ) -> Result<Proposal> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let stage_day = match scope {
                Reevaluation::Evaluation(id) => evaluation_specs::find(tx, id).await?.stage_day,
                Reevaluation::Day(stage_day) | Reevaluation::DayWithNewestRules(stage_day) => {
                    stage_day
                }
            };
            sign_offs::check_not_signed_off(tx, stage_day.stage).await?;
            let stage = stages::find(tx, stage_day.stage).await?;
            if days::find(tx, stage_day).await?.released_at.is_none() {
                return StoreError::conflict(format!(
                    "{} is not released yet: a re-evaluation is possible once it is",
                    stage_day.date
                ));
            }
            let counting = counting_evaluations::of_day(tx, stage_day, None).await?;
            let counting: Vec<EvaluationId> = counting
                .into_iter()
                .filter(|evaluation| evaluation.counts)
                .map(|evaluation| evaluation.id)
                .filter(|id| match scope {
                    Reevaluation::Evaluation(single) => *id == single,
                    Reevaluation::Day(_) | Reevaluation::DayWithNewestRules(_) => true,
                })
                .collect();
            let newest = match scope {
                Reevaluation::DayWithNewestRules(_) => Some(&stage),
                _ => None,
            };
            let proposed = reevaluation_runs(tx, &counting, newest).await?;
            let Some(revision) = proposed.iter().map(|(revision, _)| *revision).max() else {
                return StoreError::conflict(if newest.is_some() && !counting.is_empty() {
                    "there is nothing to re-evaluate: the counting results of that day have the stage's newest rules, or their submissions were deleted or are not accepted by these rules"
                } else {
                    "there is nothing to re-evaluate: no result counts, or the bundles were removed; `rerun` repeats what was voided or cancelled"
                });
            };
            let kind = match scope {
                Reevaluation::Evaluation(_) => ProposalKind::Evaluation(stage_day.date),
                Reevaluation::Day(_) => ProposalKind::Day(stage_day.date),
                Reevaluation::DayWithNewestRules(_) => {
                    ProposalKind::DayWithNewestRules(stage_day.date)
                }
            };
            let proposal = Proposal {
                id: ProposalId::new(),
                stage: stage.id,
                revision,
                kind,
                reason: reason.to_owned(),
                created_at: now,
                outcome: None,
            };
            // All evaluations of a proposal have the same revision of the rules, because each revision has its own board.
            let of_revision = proposed.into_iter().filter(|(number, _)| *number == revision);
            add_proposal(tx, &proposal, of_revision.map(|(_, proposed_run)| proposed_run).collect()).await?;
            proposals::find(tx, proposal.id).await
        })
        .await
    }

    /// Applies a proposal: its results count from now on, and those that they replace are voided. With new rules the
    /// old results stay, on the board of their revision. Evaluations with a platform fault change nothing.
    /// [`StoreError::Conflict`] if it is a trial, was decided, or has open evaluations; if the boards of its stage are
    /// frozen; or if a result that it would replace does not count any more.
    #[boxed_future]
    pub async fn apply_proposal(
        &self,
        actor: Actor,
        id: ProposalId,
        now: Timestamp,
    ) -> Result<Proposal> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let proposal = find_undecided(tx, id).await?;
            sign_offs::check_not_signed_off(tx, proposal.stage).await?;
            let Some(date) = proposal.kind.day() else {
                return StoreError::conflict(
                    "a trial cannot be applied, since it had episodes of its own; it can be dropped",
                );
            };
            let open = evaluations::count_open_proposed(tx, Some(id)).await?;
            if open > 0 {
                return StoreError::conflict(format!(
                    "{open} of its evaluations are queued or running: wait for their end"
                ));
            }
            if let Some(frozen) = board_freezes::find(tx, proposal.stage).await? {
                return StoreError::conflict(format!(
                    "the boards of the stage are frozen since {}: unfreeze them first",
                    frozen.at
                ));
            }
            let stage_day = StageDay {
                stage: proposal.stage,
                date,
            };
            for evaluation in queries::proposals::evaluations_of_proposal(tx, id).await? {
                apply_evaluation(tx, &proposal, stage_day, evaluation).await?;
            }
            proposals::set_outcome(tx, id, ProposalOutcome::Applied(now)).await?;
            tx.record(Subject::Proposal(id), Event::ProposalApplied);
            proposals::find(tx, id).await
        })
        .await
    }

    /// Drops a proposal: its results never count, and its open evaluations are cancelled. [`StoreError::Conflict`] if
    /// it was decided.
    #[boxed_future]
    pub async fn drop_proposal(
        &self,
        actor: Actor,
        id: ProposalId,
        now: Timestamp,
    ) -> Result<Proposal> {
        self.write(actor, now, async |tx| {
            find_undecided(tx, id).await?;
            for evaluation in queries::proposals::evaluations_of_proposal(tx, id).await? {
                if !evaluation.state.is_over() {
                    let failure = Failure::Cancelled("the proposal was dropped");
                    run_completion::fail_evaluation(tx, evaluation.id, failure).await?;
                }
            }
            proposals::set_outcome(tx, id, ProposalOutcome::Dropped(now)).await?;
            tx.record(Subject::Proposal(id), Event::ProposalDropped);
            proposals::find(tx, id).await
        })
        .await
    }
}

async fn find_undecided(tx: &mut Tx, id: ProposalId) -> Result<Proposal> {
    let proposal = proposals::find(tx, id).await?;
    match proposal.outcome {
        None => Ok(proposal),
        Some(ProposalOutcome::Applied(at)) => {
            StoreError::conflict(format!("the proposal was applied at {at}"))
        }
        Some(ProposalOutcome::Dropped(at)) => {
            StoreError::conflict(format!("the proposal was dropped at {at}"))
        }
    }
}

/// Replaces a result by the re-evaluation in a proposal.
async fn apply_evaluation(
    tx: &mut Tx,
    proposal: &Proposal,
    stage_day: StageDay,
    evaluation: ProposedEvaluation,
) -> Result<()> {
    let end = match evaluation.state {
        EvaluationState::Finished {
            result,
            dataset_blake3,
            ..
        } => Event::EvaluationFinished {
            score: result.score,
            dataset_blake3: dataset_blake3.unwrap_or_default(),
        },
        EvaluationState::AgentFailed { .. } => Event::EvaluationAgentFailed,
        _ => return Ok(()),
    };
    if let (Some(replaced), false) = (
        evaluation.replaces,
        matches!(proposal.kind, ProposalKind::DayWithNewestRules(_)),
    ) {
        let counting = counting_evaluations::of_day(tx, stage_day, Some(evaluation.team)).await?;
        if !counting
            .iter()
            .any(|evaluation| evaluation.id == replaced && evaluation.counts)
        {
            return StoreError::conflict(format!(
                "the evaluation {replaced}, which would be replaced, does not count any more: drop the proposal and create another"
            ));
        }
        let void_reason = format!("evaluated again: {}", proposal.reason);
        void(tx, replaced, &void_reason).await?;
    }
    let now = tx.now;
    evaluation_specs::set_counting(tx, evaluation.id, stage_day.date, now).await?;
    let subject = Subject::Evaluation(evaluation.id);
    let applied = Event::EvaluationApplied {
        proposal: proposal.id,
    };
    tx.record(subject, applied);
    tx.record(subject, end);
    Ok(())
}
