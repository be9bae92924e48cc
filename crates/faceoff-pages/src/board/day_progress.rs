//! Progress of the evaluation day, on which each team's active submission is evaluated once: running and queued evaluations, and those
//! that ended without a result.

use crate::frame::PageProblem;
use faceoff_api::views::evaluation::{EvaluationStatus, EvaluationView, Progress};
use faceoff_service::{
    app::AppState,
    views::{evaluation, team, visibility::Visibility},
};
use faceoff_types::{DivisionName, EvaluationId, StageDay};
use jiff::Timestamp;

/// Evaluations of today, and those of the day before that still run.
pub(super) struct DayProgress {
    /// Sum over all evaluations, finished ones included.
    pub(super) episodes: Progress,
    pub(super) evaluations: usize,
    pub(super) running: Vec<ListedEvaluation>,
    pub(super) queued: Vec<ListedEvaluation>,
    /// Ended without a result.
    pub(super) ended_without_result: Vec<ListedEvaluation>,
    /// Expected end of the last evaluation, from recent durations; `None` if the end of one evaluation is not known.
    pub(super) expected_at: Option<Timestamp>,
}

/// A running or queued evaluation, or one that ended without a result.
pub(super) struct ListedEvaluation {
    pub(super) team: String,
    pub(super) id: EvaluationId,
    pub(super) state: &'static str,
    pub(super) progress: Progress,
}

impl DayProgress {
    /// `division`: only teams of this division.
    pub(super) async fn load(
        app: &AppState,
        visibility: &Visibility,
        today: StageDay,
        division: Option<&DivisionName>,
    ) -> Result<Self, PageProblem> {
        let mut evaluations = evaluation::current(app, visibility, today).await?;
        if division.is_some() {
            let mut teams = team::all(app).await?;
            teams.retain(|team| team.division.as_ref() == division);
            evaluations
                .retain(|evaluation| teams.iter().any(|team| team.name == evaluation.team_name));
        }
        evaluation::add_queue_positions(app, &mut evaluations).await?;
        let mut progress = Self {
            episodes: Progress {
                episodes_done: 0,
                episodes_total: 0,
            },
            evaluations: evaluations.len(),
            running: Vec::new(),
            queued: Vec::new(),
            ended_without_result: Vec::new(),
            expected_at: None,
        };
        let mut is_end_known = true;
        for evaluation in evaluations {
            if !evaluation.status.is_final() {
                let expected = evaluation.queue.and_then(|queue| queue.expected_at);
                is_end_known &= expected.is_some();
                progress.expected_at = progress.expected_at.max(expected);
            }
            progress.add(evaluation);
        }
        progress.expected_at = progress.expected_at.filter(|_| is_end_known);
        Ok(progress)
    }

    fn add(&mut self, evaluation: EvaluationView) {
        let is_voided = evaluation.voided.is_some();
        let (state, list) = match evaluation.status {
            _ if is_voided => ("Voided by the organisers", &mut self.ended_without_result),
            EvaluationStatus::Finished { .. } => {
                self.add_episodes(evaluation.progress);
                return;
            }
            // A blind stage hides the outcome: the evaluation counts as finished.
            EvaluationStatus::AgentFailed { .. } if evaluation.blind => {
                self.add_episodes(Progress {
                    episodes_done: evaluation.progress.episodes_total,
                    ..evaluation.progress
                });
                return;
            }
            EvaluationStatus::Queued => ("Queued", &mut self.queued),
            EvaluationStatus::Running => ("Running", &mut self.running),
            EvaluationStatus::Scoring => ("Computing the score", &mut self.running),
            EvaluationStatus::AgentFailed { .. } => (
                "Agent failed; the team sees the reason when the day is released",
                &mut self.ended_without_result,
            ),
            EvaluationStatus::PlatformFailed { .. } => (
                "Stopped by a platform fault",
                &mut self.ended_without_result,
            ),
            EvaluationStatus::DeadlineMissed { .. } => (
                "Not evaluated in time: the server was at capacity",
                &mut self.ended_without_result,
            ),
            EvaluationStatus::Cancelled { .. } => (
                "Cancelled by the organisers",
                &mut self.ended_without_result,
            ),
        };
        list.push(ListedEvaluation {
            team: evaluation.team_name.to_string(),
            id: evaluation.id,
            state,
            progress: evaluation.progress,
        });
        if !is_voided && !evaluation.status.is_final() {
            self.add_episodes(evaluation.progress);
        }
    }

    fn add_episodes(&mut self, progress: Progress) {
        self.episodes.episodes_done += progress.episodes_done;
        self.episodes.episodes_total += progress.episodes_total;
    }

    /// Is any evaluation running or queued?
    pub(super) fn is_open(&self) -> bool {
        !(self.running.is_empty() && self.queued.is_empty())
    }

    /// Text on the page and for screen readers; it changes when an evaluation has ended.
    pub(super) fn live_text(&self) -> String {
        let done = self.evaluations - self.running.len() - self.queued.len();
        format!("{done} of {} evaluations done", self.evaluations)
    }
}
