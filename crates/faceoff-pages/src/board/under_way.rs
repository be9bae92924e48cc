//! What is being played: how far the day is, who plays, who waits, and what ended without a result.

use crate::frame::PageProblem;
use faceoff_api::views::evaluation::{EvaluationStatus, EvaluationView, Progress};
use faceoff_service::{
    app::AppState,
    views::{evaluation, sight::Sight, team},
};
use faceoff_types::{DivisionName, EvaluationId, StageDay};
use jiff::Timestamp;

/// The evaluations of today, and of yesterday those that still go on.
pub(super) struct UnderWay {
    /// Of all of them, those that are over included.
    pub(super) progress: Progress,
    pub(super) evaluations: usize,
    /// Those that episodes are played of, or a score is computed of.
    pub(super) running: Vec<Run>,
    pub(super) waiting: Vec<Run>,
    /// Those that ended without a result.
    pub(super) ended: Vec<Run>,
    /// When the last of them will be over, by what such work took.
    pub(super) expected_at: Option<Timestamp>,
}

/// An evaluation without a result (yet).
pub(super) struct Run {
    pub(super) team: String,
    pub(super) evaluation: EvaluationId,
    pub(super) state: &'static str,
    pub(super) progress: Progress,
}

impl UnderWay {
    /// Of the teams of one division, or of all.
    pub(super) async fn of(
        app: &AppState,
        sight: &Sight,
        today: StageDay,
        division: Option<&DivisionName>,
    ) -> Result<Self, PageProblem> {
        let mut evaluations = evaluation::current(app, sight, today).await?;
        if division.is_some() {
            let mut teams = team::all(app).await?;
            teams.retain(|team| team.division.as_ref() == division);
            evaluations.retain(|of| teams.iter().any(|team| team.name == of.team_name));
        }
        evaluation::place(app, &mut evaluations).await?;
        let mut under_way = Self {
            progress: Progress {
                episodes_done: 0,
                episodes_total: 0,
            },
            evaluations: evaluations.len(),
            running: Vec::new(),
            waiting: Vec::new(),
            ended: Vec::new(),
            expected_at: None,
        };
        let mut is_known = true;
        for evaluation in evaluations {
            if !evaluation.status.is_final() {
                let expected = evaluation.queue.and_then(|queue| queue.expected_at);
                is_known &= expected.is_some();
                under_way.expected_at = under_way.expected_at.max(expected);
            }
            under_way.add(evaluation);
        }
        under_way.expected_at = under_way.expected_at.filter(|_| is_known);
        Ok(under_way)
    }

    fn add(&mut self, evaluation: EvaluationView) {
        let is_voided = evaluation.voided.is_some();
        let (state, list) = match evaluation.status {
            _ if is_voided => ("Voided by the organiser", &mut self.ended),
            EvaluationStatus::Finished { .. } => {
                self.count(evaluation.progress);
                return;
            }
            // How it went is not told: it is over as any other.
            EvaluationStatus::AgentFailed { .. } if evaluation.blind => {
                self.count(Progress {
                    episodes_done: evaluation.progress.episodes_total,
                    ..evaluation.progress
                });
                return;
            }
            EvaluationStatus::Queued => ("Queued", &mut self.waiting),
            EvaluationStatus::Running => ("Running", &mut self.running),
            EvaluationStatus::Finalising => ("Computing the score", &mut self.running),
            EvaluationStatus::AgentFailed { .. } => (
                "The agent failed; its team sees why when the day is released",
                &mut self.ended,
            ),
            EvaluationStatus::PlatformFailed { .. } => ("Stopped by our fault", &mut self.ended),
            EvaluationStatus::NotPlayed { .. } => {
                ("Not played in time: our capacity", &mut self.ended)
            }
            EvaluationStatus::Cancelled { .. } => ("Cancelled by the organiser", &mut self.ended),
        };
        list.push(Run {
            team: evaluation.team_name.to_string(),
            evaluation: evaluation.id,
            state,
            progress: evaluation.progress,
        });
        if !is_voided && !evaluation.status.is_final() {
            self.count(evaluation.progress);
        }
    }

    fn count(&mut self, progress: Progress) {
        self.progress.episodes_done += progress.episodes_done;
        self.progress.episodes_total += progress.episodes_total;
    }

    /// Is anything still to come of it?
    pub(super) fn is_moving(&self) -> bool {
        !(self.running.is_empty() && self.waiting.is_empty())
    }

    /// How far it is, in a sentence that changes when an evaluation is over.
    pub(super) fn told(&self) -> String {
        let is_over = self.evaluations - self.running.len() - self.waiting.len();
        format!("{is_over} of {} evaluations are over", self.evaluations)
    }
}
