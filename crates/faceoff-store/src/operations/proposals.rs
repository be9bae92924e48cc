//! What is tried without counting, and re-evaluations, which count once the organiser has seen what they change.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{drafts as draft_ends, purpose, rulings::void, runs},
    queue::NewUnit,
    reads,
    store::Store,
    tables::{
        days,
        drafts::{self, Draft},
        entries::{self, Entry},
        evaluations::{self, EvaluationState, Failure},
        finalisations, finalised, freezes,
        plan::RunPlan,
        proposals::{self, Proposal, ProposalKind, Settled},
        retentions, runs as run_rows,
        runs::Run,
        season, stage_runtimes,
        stages::{self, Stage, StagePhase},
        standings, submissions,
    },
    write::Tx,
};
use faceoff_types::{
    EvaluationId, ProposalId, Ruleset, RunId, SeedLabel, StageDay, StageId, SubmissionId, TeamId,
};
use jiff::Timestamp;
use std::collections::HashSet;

/// What is to be played again, and by which rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reevaluation {
    /// One evaluation that counts.
    Evaluation(EvaluationId),
    /// All of a day that count.
    Day(StageDay),
    /// All of a day that count, by the newest rules of its stage.
    Rules(StageDay),
}

/// What one draft plays.
struct Played {
    submission: SubmissionId,
    team: TeamId,
    replaces: Option<EvaluationId>,
    seed: SeedLabel,
    ruleset: Ruleset,
    plan: RunPlan,
}

fn conflict<T>(why: impl Into<String>) -> Result<T> {
    Err(StoreError::Conflict(why.into()))
}

/// Adds a proposal and queues its drafts, behind everything that counts.
async fn enter(tx: &mut Tx, proposal: &Proposal, played: Vec<Played>) -> Result<()> {
    proposals::insert(tx, proposal).await?;
    let now = tx.now;
    let unit = NewUnit {
        batch: now.as_millisecond(),
        ..purpose::PROPOSAL_SHARD
    };
    let count = u32::try_from(played.len()).unwrap_or(u32::MAX);
    for one in played {
        let run = Run {
            id: RunId::new(),
            ruleset: one.ruleset,
            plan: one.plan,
            seed: one.seed,
            keeps_recordings: true,
        };
        runs::create(tx, &run, &[one.submission], unit, one.team).await?;
        let draft = Draft {
            id: EvaluationId::new(),
            proposal: proposal.id,
            submission: one.submission,
            team: one.team,
            replaces: one.replaces,
            run: run.id,
            created_at: now,
            state: EvaluationState::Queued,
        };
        drafts::insert(tx, &draft).await?;
    }
    let event = Event::ProposalMade {
        stage: proposal.stage,
        evaluations: count,
        reason: proposal.reason.clone(),
    };
    tx.record(Subject::Proposal(proposal.id), event);
    Ok(())
}

/// The evaluations that are to be played again, by their own rules or by `newest`.
async fn again(
    tx: &mut Tx,
    ids: &[EvaluationId],
    newest: Option<&Stage>,
) -> Result<Vec<(u32, Played)>> {
    let mut all = Vec::with_capacity(ids.len());
    for id in ids {
        all.push(entries::find(tx, *id).await?);
    }
    let is_by_newest =
        |entry: &Entry| newest.is_some_and(|stage| stage.rules.number == entry.revision);
    let done: HashSet<TeamId> = all
        .iter()
        .filter(|entry| is_by_newest(entry))
        .map(|entry| entry.team)
        .collect();
    let mut played = Vec::new();
    for entry in all.into_iter().filter(|entry| !done.contains(&entry.team)) {
        let submission = submissions::find(tx, entry.submission).await?;
        // One team's deleted archive keeps no other from its turn. Asked for alone, it is refused with the reason.
        let is_gone = ids.len() > 1 && submission.archive_removed.is_some();
        if is_gone || newest.is_some_and(|stage| stage.check_takes(&submission).is_err()) {
            continue;
        }
        let run = run_rows::find(tx, entry.run).await?;
        let (revision, ruleset, plan) = match newest {
            None => (entry.revision, run.ruleset, run.plan),
            Some(stage) => (stage.rules.number, stage.rules.rules.ruleset, stage.plan()),
        };
        let one = Played {
            submission: entry.submission,
            team: entry.team,
            replaces: Some(entry.id),
            seed: run.seed,
            ruleset,
            plan,
        };
        played.push((revision, one));
    }
    Ok(played)
}

impl Store {
    /// Plays what is active in a stage, or one submission that is valid, by the stage's rules on episodes that nothing
    /// else plays: without a turn, without a board, behind everything that counts. [`StoreError::Conflict`] if there
    /// is nothing to play or the stage has closed; [`StoreError::SeasonClosed`].
    #[boxed]
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
                return conflict("the stage has closed, and nothing of it begins again");
            }
            let active = match submission {
                None => {
                    let mut active = submissions::active(tx).await?;
                    active.retain(|one| stage.check_takes(one).is_ok());
                    active
                }
                Some(id) => vec![submissions::find(tx, id).await?],
            };
            if active.is_empty() {
                return conflict(
                    "no team has a valid submission that the stage takes, so there is nothing to try",
                );
            }
            if active
                .iter()
                .any(|one| one.state != submissions::SubmissionState::Valid)
            {
                return conflict("only a valid submission can be tried");
            }
            for one in &active {
                let taken = stage.check_takes(one);
                taken.map_err(|why| stage_runtimes::conflict(&why))?;
            }
            let id = ProposalId::new();
            let proposal = Proposal {
                id,
                stage: stage.id,
                revision: stage.rules.number,
                kind: ProposalKind::Trial,
                reason: reason.to_owned(),
                created_at: now,
                settled: None,
            };
            let played = active.into_iter().map(|submission| Played {
                submission: submission.id,
                team: submission.team,
                replaces: None,
                seed: SeedLabel::Trial(id),
                ruleset: stage.rules.rules.ruleset,
                plan: stage.plan(),
            });
            enter(tx, &proposal, played.collect()).await?;
            proposals::find(tx, id).await
        })
        .await
    }

    /// Plays results that count once more, beside them, behind everything that counts: the same submissions on the
    /// same episodes. [`StoreError::Conflict`] if nothing of it counts, or its day is under way; of other rules, if
    /// there are none.
    #[boxed]
    pub async fn propose_reevaluation(
        &self,
        actor: Actor,
        what: Reevaluation,
        reason: &str,
        now: Timestamp,
    ) -> Result<Proposal> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let of = match what {
                Reevaluation::Evaluation(id) => entries::find(tx, id).await?.of,
                Reevaluation::Day(of) | Reevaluation::Rules(of) => of,
            };
            finalised::check_not(tx, of.stage).await?;
            let stage = stages::find(tx, of.stage).await?;
            if days::find(tx, of).await?.released_at.is_none() {
                return conflict(format!(
                    "{} is under way: it is played again once it is released",
                    of.date
                ));
            }
            let counting = standings::of_day(tx, of).await?;
            let counting: Vec<EvaluationId> = counting
                .into_iter()
                .filter(|one| one.counts)
                .map(|one| one.id)
                .filter(|id| match what {
                    Reevaluation::Evaluation(only) => *id == only,
                    Reevaluation::Day(_) | Reevaluation::Rules(_) => true,
                })
                .collect();
            let newest = match what {
                Reevaluation::Rules(_) => Some(&stage),
                _ => None,
            };
            let played = again(tx, &counting, newest).await?;
            let Some(revision) = played.iter().map(|(revision, _)| *revision).max() else {
                return conflict(if newest.is_some() && !counting.is_empty() {
                    "all that counts of that day was played by the stage's newest rules, or by agents that these do not take or that were deleted"
                } else {
                    "nothing of that counts or has its archive, so there is nothing to play again; `rerun` plays what was voided or cancelled"
                });
            };
            let kind = match what {
                Reevaluation::Evaluation(_) => ProposalKind::Evaluation(of.date),
                Reevaluation::Day(_) => ProposalKind::Day(of.date),
                Reevaluation::Rules(_) => ProposalKind::Rules(of.date),
            };
            let proposal = Proposal {
                id: ProposalId::new(),
                stage: stage.id,
                revision,
                kind,
                reason: reason.to_owned(),
                created_at: now,
                settled: None,
            };
            // A proposal is by one of the stage's rules: its board can only be that of these.
            let of_revision = played.into_iter().filter(|(of, _)| *of == revision);
            enter(tx, &proposal, of_revision.map(|(_, one)| one).collect()).await?;
            proposals::find(tx, proposal.id).await
        })
        .await
    }

    /// Has what a proposal has played count from now on; the results that it plays again are voided, unless it is by
    /// other rules, whose board is another. What we broke of it changes nothing. [`StoreError::Conflict`] if it is a
    /// trial, is settled or under way, if the boards of its stage are frozen, or if what it would replace counts no
    /// more.
    #[boxed]
    pub async fn apply_proposal(
        &self,
        actor: Actor,
        id: ProposalId,
        now: Timestamp,
    ) -> Result<Proposal> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let proposal = check_unsettled(tx, id).await?;
            finalised::check_not(tx, proposal.stage).await?;
            let Some(date) = proposal.kind.day() else {
                return conflict("a trial has nothing to apply: it was on episodes of its own; it can be dropped");
            };
            let open = drafts::count_open(tx, Some(id)).await?;
            if open > 0 {
                return conflict(format!(
                    "{open} of its evaluations are queued or running: wait for their end"
                ));
            }
            if let Some(frozen) = freezes::find(tx, proposal.stage).await? {
                return conflict(format!(
                    "the boards of the stage are frozen since {}: unfreeze them first",
                    frozen.at
                ));
            }
            let of = StageDay {
                stage: proposal.stage,
                date,
            };
            for draft in reads::proposals::drafts_of(tx, id).await? {
                apply(tx, &proposal, of, draft).await?;
            }
            proposals::settle(tx, id, Settled::Applied(now)).await?;
            tx.record(Subject::Proposal(id), Event::ProposalApplied);
            proposals::find(tx, id).await
        })
        .await
    }

    /// Has what a proposal has played never count; what is under way of it is stopped. [`StoreError::Conflict`] if it
    /// is settled.
    #[boxed]
    pub async fn drop_proposal(
        &self,
        actor: Actor,
        id: ProposalId,
        now: Timestamp,
    ) -> Result<Proposal> {
        self.write(actor, now, async |tx| {
            check_unsettled(tx, id).await?;
            for draft in reads::proposals::drafts_of(tx, id).await? {
                if !draft.state.is_over() {
                    let failure = Failure::Cancelled("the proposal was dropped");
                    draft_ends::fail(tx, draft.id, draft.run, id, failure).await?;
                }
            }
            proposals::settle(tx, id, Settled::Dropped(now)).await?;
            tx.record(Subject::Proposal(id), Event::ProposalDropped);
            proposals::find(tx, id).await
        })
        .await
    }
}

async fn check_unsettled(tx: &mut Tx, id: ProposalId) -> Result<Proposal> {
    let proposal = proposals::find(tx, id).await?;
    match proposal.settled {
        None => Ok(proposal),
        Some(Settled::Applied(at)) => conflict(format!("the proposal was applied at {at}")),
        Some(Settled::Dropped(at)) => conflict(format!("the proposal was dropped at {at}")),
    }
}

/// Has one draft take the place of what it plays again.
async fn apply(tx: &mut Tx, proposal: &Proposal, of: StageDay, draft: Draft) -> Result<()> {
    let now = tx.now;
    if !matches!(
        draft.state,
        EvaluationState::Finished { .. } | EvaluationState::AgentFailed { .. }
    ) {
        return Ok(());
    }
    if let (Some(replaced), false) = (
        draft.replaces,
        matches!(proposal.kind, ProposalKind::Rules(_)),
    ) {
        let standings = standings::of_day_and_team(tx, of, draft.team).await?;
        if !standings.iter().any(|one| one.id == replaced && one.counts) {
            return conflict(format!(
                "the evaluation {replaced}, which would be replaced, counts no more: drop the proposal, and make another"
            ));
        }
        let why = format!("evaluated again: {}", proposal.reason);
        void(tx, replaced, &why).await?;
    }
    let entry = Entry {
        id: draft.id,
        submission: draft.submission,
        team: draft.team,
        of,
        revision: proposal.revision,
        run: draft.run,
        rerun_of: draft.replaces,
    };
    entries::insert(tx, &entry, draft.created_at).await?;
    if let Some(replaced) = draft.replaces {
        entries::follow_extra(tx, draft.id, replaced).await?;
    }
    if let Some(unit) = drafts::finalisation_of(tx, draft.id).await? {
        finalisations::insert(tx, draft.id, unit).await?;
    }
    let event = Event::EvaluationApplied {
        proposal: proposal.id,
    };
    tx.record(Subject::Evaluation(draft.id), event);
    match draft.state {
        EvaluationState::Finished {
            result,
            dataset,
            dataset_blake3,
            ..
        } => {
            let dataset_blake3 = dataset_blake3.unwrap_or_default();
            evaluations::set_finished(tx, draft.id, &result, &dataset, &dataset_blake3, now)
                .await?;
            retentions::follow_draft(tx, draft.id).await?;
            let event = Event::EvaluationFinished {
                score: result.score,
                dataset_blake3,
            };
            tx.record(Subject::Evaluation(draft.id), event);
        }
        _ => {
            evaluations::set_failed(tx, draft.id, Failure::Agent, now).await?;
            tx.record(Subject::Evaluation(draft.id), Event::EvaluationAgentFailed);
        }
    }
    Ok(())
}
