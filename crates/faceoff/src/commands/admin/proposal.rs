//! `faceoff admin proposal`: trials, which evaluate submissions without effect on the boards, and proposed re-evaluations, whose
//! results replace the old ones once an organiser applies the proposal.

use crate::{
    client::Client,
    commands::{
        evaluation_text::tier_suffix,
        output::{print, print_list},
        stage_lookup::find_stage,
    },
};
use clap::Subcommand;
use faceoff_api::{
    requests::{NewProposal, Trial},
    views::proposal::{
        ChangeView, ProposalKindView, ProposalStateView, ProposalView, ProposedEvaluationStatus,
        ProposedEvaluationView, RankView,
    },
};
use faceoff_types::{EvaluationId, ProposalId, SubmissionId};
use jiff::civil::Date;

#[derive(Debug, Subcommand)]
pub(super) enum ProposalAction {
    /// List trials and proposed re-evaluations, the newest first
    List,
    /// Show a trial or proposal with its evaluations and the ranks that it would change
    Show {
        /// The id of the trial or proposal
        proposal: ProposalId,
    },
    /// Evaluate the active submissions by a stage's rules, without effect on boards; all jobs whose results count run first
    Trial {
        /// The stage's name or id
        stage: String,
        /// Recorded in the log
        reason: String,
        /// Only this valid submission
        #[arg(long, value_name = "ID")]
        submission: Option<SubmissionId>,
    },
    /// Propose to re-evaluate one result that counts, on the same episodes
    Evaluation {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// Shown publicly once the proposal is applied
        reason: String,
    },
    /// Propose to re-evaluate all results of a day that count, on the same episodes
    Day {
        /// The date of the day
        day: Date,
        /// Shown publicly once the proposal is applied
        reason: String,
        /// The stage's name or id
        #[arg(long)]
        stage: String,
        /// Evaluate by the stage's newest rules, for the board of that revision
        #[arg(long)]
        new_rules: bool,
    },
    /// Apply a proposal: its results replace the old ones; without --confirm, only list the effects
    Apply {
        /// The id of the trial or proposal
        proposal: ProposalId,
        /// The date of the day, as confirmation
        #[arg(long, value_name = "DATE")]
        confirm: Option<String>,
    },
    /// Drop a proposal or trial and cancel its unfinished evaluations; without --confirm, only list the effects
    Drop {
        /// The id of the trial or proposal
        proposal: ProposalId,
        /// The stage's name, as confirmation
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: ProposalAction,
) -> anyhow::Result<()> {
    let proposal_view = match action {
        ProposalAction::List => {
            let all = client.proposals().await?;
            return print_list(json, &all, proposal_line, "no trials or proposals");
        }
        ProposalAction::Show { proposal } => client.proposal(proposal).await?,
        ProposalAction::Trial {
            stage,
            reason,
            submission,
        } => {
            let stage = find_stage(client, &stage).await?;
            client
                .start_trial(stage.id, &Trial { submission, reason })
                .await?
        }
        ProposalAction::Evaluation { evaluation, reason } => {
            let stage = client.evaluation(evaluation).await?.stage;
            let new = NewProposal {
                evaluation: Some(evaluation),
                day: None,
                new_rules: false,
                reason,
            };
            client.propose(stage, &new).await?
        }
        ProposalAction::Day {
            day,
            reason,
            stage,
            new_rules,
        } => {
            let stage = find_stage(client, &stage).await?;
            let new = NewProposal {
                evaluation: None,
                day: Some(day),
                new_rules,
                reason,
            };
            client.propose(stage.id, &new).await?
        }
        ProposalAction::Apply { proposal, confirm } => {
            client.apply_proposal(proposal, confirm).await?
        }
        ProposalAction::Drop { proposal, confirm } => {
            client.drop_proposal(proposal, confirm).await?
        }
    };
    print(json, &proposal_view, proposal_text)
}

fn proposal_line(proposal: &ProposalView) -> String {
    let subject = match (proposal.kind, proposal.day) {
        (ProposalKindView::Evaluation, Some(day)) => {
            format!("re-evaluation of one result of {day}")
        }
        (ProposalKindView::Day, Some(day)) => format!("re-evaluation of {day}"),
        (ProposalKindView::Rules, Some(day)) => {
            format!(
                "re-evaluation of {day} by revision {} of the rules",
                proposal.revision
            )
        }
        _ => "trial".to_owned(),
    };
    let state = match proposal.state {
        ProposalStateView::Running => "running",
        ProposalStateView::Finished => "finished, not applied",
        ProposalStateView::Applied => "applied",
        ProposalStateView::Dropped => "dropped",
    };
    format!(
        "{}  {}: {subject} ({}), {state}",
        proposal.id, proposal.stage_name, proposal.reason
    )
}

/// A proposal as several lines: subject, evaluations, and the board rows that it would change.
fn proposal_text(proposal: &ProposalView) -> String {
    let mut lines = vec![proposal_line(proposal)];
    lines.extend(proposal.evaluations.iter().map(evaluation_line));
    if let Some(outcome) = &proposal.outcome {
        if outcome.old_board.is_some() {
            lines.push(match outcome.changes.len() {
                0 => "applying it would change no row of the board".to_owned(),
                1 => "applying it would change one row of the board:".to_owned(),
                count => format!("applying it would change {count} rows of the board:"),
            });
        }
        lines.extend(outcome.changes.iter().map(change_line));
    }
    lines.join("\n")
}

fn evaluation_line(evaluation: &ProposedEvaluationView) -> String {
    let state = match &evaluation.status {
        ProposedEvaluationStatus::Queued => "queued, after all jobs whose results count".to_owned(),
        ProposedEvaluationStatus::Running => format!(
            "running, {} of {} episodes",
            evaluation.progress.episodes_done, evaluation.progress.episodes_total
        ),
        ProposedEvaluationStatus::Scoring => "computing the score".to_owned(),
        ProposedEvaluationStatus::Finished { result, .. } => format!(
            "score {:.1}, {:.1} penalty points{}",
            result.score,
            result.penalty_points,
            tier_suffix(result.tier)
        ),
        ProposedEvaluationStatus::AgentFailed { faults, .. } => {
            format!("the agent failed ({} faults)", faults.len())
        }
        ProposedEvaluationStatus::PlatformFailed { reason, .. } => {
            format!("platform fault: {reason}")
        }
        ProposedEvaluationStatus::Cancelled { .. } => "cancelled".to_owned(),
    };
    format!("  {:<40} {state}", evaluation.team_name)
}

fn change_line(change: &ChangeView) -> String {
    let rank = |row: Option<RankView>| match row {
        Some(row) => format!(
            "rank {} (score {:.1}, {:.1} points)",
            row.rank, row.score, row.penalty_points
        ),
        None => "no row".to_owned(),
    };
    format!(
        "  {:<40} {} → {}",
        change.team,
        rank(change.old),
        rank(change.new)
    )
}
