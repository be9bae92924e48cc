//! Slow answers of an evaluation: answers of the agent that came too late and cost penalty points.

use crate::format;
use faceoff_api::views::{
    evaluation::{EvaluationView, ResultView},
    task::TaskView,
    violations::ViolationsView,
};
use faceoff_service::{app::App, archive_contents, problem::Problem, views::violations};
use faceoff_store::EvaluationState;
use faceoff_types::Task;
use faceoff_types::ViolationName;
use faceoff_wire::dataset::SlowEpisode;

/// Slow answers, the most costly first; none before the day is released.
#[derive(Default)]
pub(super) struct SlowAnswers {
    pub(super) shown: Vec<SlowAnswer>,
    /// Number of affected episodes, including those not shown.
    pub(super) episodes: usize,
    /// The dataset, which contains the list, cannot be read.
    pub(super) is_unreadable: bool,
    /// The dataset, which contains the list, was removed.
    pub(super) is_removed: bool,
}

/// The slowest answer of an episode with points for slow answers; times in milliseconds.
pub(super) struct SlowAnswer {
    pub(super) task: Task,
    pub(super) episode: u32,
    pub(super) points: String,
    pub(super) mean_ms: String,
    pub(super) max_ms: String,
    /// Details of the slowest answer; `None` for datasets of older versions.
    pub(super) step: Option<SlowStepFigures>,
}

pub(super) struct SlowStepFigures {
    pub(super) step: u32,
    /// Time from the observation to the answer.
    pub(super) wall_ms: String,
    /// Part of it that the host machine caused.
    pub(super) host_ms: String,
    /// CPU time of the agent; `None` if the host did not measure it.
    pub(super) cpu_ms: Option<String>,
}

impl SlowAnswers {
    /// Rows on the page; the API lists all.
    const MAX_ROWS: usize = 20;

    pub(super) async fn load(
        app: &App,
        view: &EvaluationView,
        result: &ResultView,
    ) -> Result<Self, Problem> {
        let has_slow_answers = |task: &TaskView| {
            let counts = task.violations.as_ref();
            counts.is_some_and(|violations| violations.get(ViolationName::COMPUTATION_TIME) > 0)
        };
        if !result.tasks.values().any(has_slow_answers) {
            return Ok(Self::default());
        }
        if view.dataset_removed.is_some() {
            return Ok(Self {
                is_removed: true,
                ..Self::default()
            });
        }
        let evaluation = app.store.evaluation(view.id).await?;
        let EvaluationState::Finished { dataset, .. } = &evaluation.state else {
            return Ok(Self::default());
        };
        if archive_contents::is_omitted(app, dataset).await? {
            return Ok(Self::default());
        }
        Ok(match violations::read(app, dataset).await {
            Ok(violations) => Self::worst(violations),
            // The service has logged the cause; the rest of the page is shown.
            Err(_) => Self {
                is_unreadable: true,
                ..Self::default()
            },
        })
    }

    /// The episodes with the most points, from the violations that the dataset contains.
    fn worst(violations: ViolationsView) -> Self {
        let mut episodes: Vec<(Task, SlowEpisode)> = violations
            .tasks
            .into_iter()
            .flat_map(|(task, violations)| {
                let episodes = violations.computation_time.into_iter();
                episodes.map(move |episode| (task, episode))
            })
            .collect();
        episodes.sort_by(|(_, a), (_, b)| {
            let by_points = b.points.total_cmp(&a.points);
            by_points.then_with(|| b.max_s.total_cmp(&a.max_s))
        });
        Self {
            episodes: episodes.len(),
            shown: episodes
                .into_iter()
                .take(Self::MAX_ROWS)
                .map(|(task, episode)| SlowAnswer::new(task, &episode))
                .collect(),
            is_unreadable: false,
            is_removed: false,
        }
    }
}

impl SlowAnswer {
    fn new(task: Task, episode: &SlowEpisode) -> Self {
        Self {
            task,
            episode: episode.episode,
            points: format::one_decimal(episode.points),
            mean_ms: format::milliseconds(episode.mean_s),
            max_ms: format::milliseconds(episode.max_s),
            step: episode.slowest.map(|slowest| SlowStepFigures {
                step: slowest.step,
                wall_ms: format::milliseconds(slowest.wall_s),
                host_ms: format::milliseconds(slowest.host_s),
                cpu_ms: slowest.cpu_s.map(format::milliseconds),
            }),
        }
    }
}
