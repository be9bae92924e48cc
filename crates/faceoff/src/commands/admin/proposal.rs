//! `faceoff admin proposal`: what is tried without counting, and what is evaluated again.

use crate::{
    client::Client,
    commands::{
        find_stage::find_stage,
        output::{or_none, print},
    },
};
use clap::Subcommand;
use faceoff_api::{
    requests::{NewProposal, Trial},
    views::proposal::{
        ChangeView, DraftStatus, DraftView, ProposalKindView, ProposalStateView, ProposalView,
        StandingView,
    },
};
use faceoff_types::{EvaluationId, ProposalId, SubmissionId};
use jiff::civil::Date;

#[derive(Debug, Subcommand)]
pub(super) enum ProposalAction {
    /// List trials and proposals, the newest first
    List,
    /// Show one: what it plays, and which ranks would change
    Show {
        /// Its id
        proposal: ProposalId,
    },
    /// Play what is active by a stage's rules, without turn and board, behind everything that counts
    Trial {
        /// The stage's name or id
        stage: String,
        /// Kept in the log
        reason: String,
        /// Only this valid submission
        #[arg(long, value_name = "ID")]
        submission: Option<SubmissionId>,
    },
    /// Play one evaluation that counts again, on the same episodes, beside it
    Evaluation {
        /// The evaluation's id
        evaluation: EvaluationId,
        /// Shown to everybody once it is applied
        reason: String,
    },
    /// Play all of a day that counts again, on the same episodes, beside it
    Day {
        /// The day's date
        day: Date,
        /// Shown to everybody once it is applied
        reason: String,
        /// The stage's name or id
        #[arg(long)]
        stage: String,
        /// By the stage's newest rules, for the board of these
        #[arg(long)]
        new_rules: bool,
    },
    /// Have what was played again count; without --confirm, say what that would do
    Apply {
        /// Its id
        proposal: ProposalId,
        /// The day's date
        #[arg(long, value_name = "DATE")]
        confirm: Option<String>,
    },
    /// Have it never count; what is under way of it is stopped; without --confirm, say what that would do
    Drop {
        /// Its id
        proposal: ProposalId,
        /// The stage's name
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
}

pub(super) async fn act(client: &Client, json: bool, action: ProposalAction) -> anyhow::Result<()> {
    let shown = match action {
        ProposalAction::List => {
            let all = client.proposals().await?;
            return print(json, &all, || {
                or_none(all.iter().map(head).collect(), "no trial and no proposal")
            });
        }
        ProposalAction::Show { proposal } => client.proposal(proposal).await?,
        ProposalAction::Trial {
            stage,
            reason,
            submission,
        } => {
            let stage = find_stage(client, &stage).await?;
            client
                .trial(stage.id, &Trial { submission, reason })
                .await?
        }
        ProposalAction::Evaluation { evaluation, reason } => {
            let stage = client.evaluation(evaluation).await?.stage;
            let wanted = NewProposal {
                evaluation: Some(evaluation),
                day: None,
                new_rules: false,
                reason,
            };
            client.propose(stage, &wanted).await?
        }
        ProposalAction::Day {
            day,
            reason,
            stage,
            new_rules,
        } => {
            let stage = find_stage(client, &stage).await?;
            let wanted = NewProposal {
                evaluation: None,
                day: Some(day),
                new_rules,
                reason,
            };
            client.propose(stage.id, &wanted).await?
        }
        ProposalAction::Apply { proposal, confirm } => {
            client.apply_proposal(proposal, confirm).await?
        }
        ProposalAction::Drop { proposal, confirm } => {
            client.drop_proposal(proposal, confirm).await?
        }
    };
    print(json, &shown, || whole(&shown))
}

fn head(proposal: &ProposalView) -> String {
    let what = match (proposal.kind, proposal.day) {
        (ProposalKindView::Evaluation, Some(day)) => format!("one evaluation of {day} again"),
        (ProposalKindView::Day, Some(day)) => format!("{day} again"),
        (ProposalKindView::Rules, Some(day)) => {
            format!(
                "{day} again, by revision {} of the rules",
                proposal.revision
            )
        }
        _ => "a trial".to_owned(),
    };
    let state = match proposal.state {
        ProposalStateView::Playing => "is being played",
        ProposalStateView::Played => "is played",
        ProposalStateView::Applied => "was applied",
        ProposalStateView::Dropped => "was dropped",
    };
    format!(
        "{}  {}: {what} ({}), {state}",
        proposal.id, proposal.stage_name, proposal.reason
    )
}

fn whole(proposal: &ProposalView) -> String {
    let mut lines = vec![head(proposal)];
    lines.extend(proposal.evaluations.iter().map(played));
    if let Some(outcome) = &proposal.outcome {
        if outcome.old_board.is_some() {
            lines.push(match outcome.changes.len() {
                0 => "applied, it would change no row".to_owned(),
                1 => "applied, it would change this:".to_owned(),
                count => format!("applied, it would change these {count}:"),
            });
        }
        lines.extend(outcome.changes.iter().map(change));
    }
    lines.join("\n")
}

fn played(draft: &DraftView) -> String {
    let state = match &draft.status {
        DraftStatus::Queued => "queued, behind what counts".to_owned(),
        DraftStatus::Running => format!(
            "running, {} of {} episodes",
            draft.progress.episodes_done, draft.progress.episodes_total
        ),
        DraftStatus::Finalising => "computing the score".to_owned(),
        DraftStatus::Finished { result, .. } => format!(
            "score {:.1}, {:.1} penalty points, {}",
            result.score,
            result.penalty_points,
            result.tier.title().to_lowercase()
        ),
        DraftStatus::AgentFailed { faults, .. } => {
            format!("the agent failed ({} faults)", faults.len())
        }
        DraftStatus::PlatformFailed { reason, .. } => format!("our fault: {reason}"),
        DraftStatus::Cancelled { .. } => "stopped".to_owned(),
    };
    format!("  {:<40} {state}", draft.team_name)
}

fn change(change: &ChangeView) -> String {
    let standing = |standing: Option<StandingView>| match standing {
        Some(standing) => format!(
            "rank {} (score {:.1}, {:.1} points)",
            standing.rank, standing.score, standing.penalty_points
        ),
        None => "no row".to_owned(),
    };
    format!(
        "  {:<40} {} → {}",
        change.team,
        standing(change.old),
        standing(change.new)
    )
}
