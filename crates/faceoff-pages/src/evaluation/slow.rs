//! The answers that cost an evaluation points.

use crate::figures;
use faceoff_api::views::{
    evaluation::{EvaluationView, ResultView},
    task::TaskView,
    violations::ViolationsView,
};
use faceoff_service::{app::App, archived, problem::Problem, views::violations};
use faceoff_store::EvaluationState;
use faceoff_types::Task;
use faceoff_wire::dataset::SlowEpisode;

/// The answers that cost points, those that cost most first; once the day is released.
#[derive(Default)]
pub(super) struct SlowAnswers {
    pub(super) shown: Vec<SlowAnswer>,
    /// Of how many episodes, those that are not shown included.
    pub(super) episodes: usize,
    /// They are in the dataset, which cannot be read.
    pub(super) lost: bool,
    /// They were in the dataset, which was removed.
    pub(super) removed: bool,
}

/// The slowest answer of an episode that lost points by slow answers; times in milliseconds.
pub(super) struct SlowAnswer {
    pub(super) task: Task,
    pub(super) episode: u32,
    pub(super) points: String,
    pub(super) mean_ms: String,
    pub(super) max_ms: String,
    /// What is known of the slowest answer; nothing in datasets of older versions.
    pub(super) step: Option<SlowStepFigures>,
}

pub(super) struct SlowStepFigures {
    pub(super) step: u32,
    pub(super) wall_ms: String,
    pub(super) host_ms: String,
    /// `None` where the host did not tell.
    pub(super) cpu_ms: Option<String>,
}

impl SlowAnswers {
    /// A page is no list; the API tells of all.
    const SHOWN: usize = 20;

    pub(super) async fn of(
        app: &App,
        view: &EvaluationView,
        result: &ResultView,
    ) -> Result<Self, Problem> {
        let of_task = |task: &TaskView| task.violations.is_some_and(|v| v.computation_time > 0);
        if !result.tasks.values().any(of_task) {
            return Ok(Self::default());
        }
        if view.dataset_removed.is_some() {
            return Ok(Self {
                removed: true,
                ..Self::default()
            });
        }
        let evaluation = app.store.evaluation(view.id).await?;
        let EvaluationState::Finished { dataset, .. } = &evaluation.state else {
            return Ok(Self::default());
        };
        if archived::is_left_out(app, dataset).await? {
            return Ok(Self::default());
        }
        Ok(match violations::read(app, dataset).await {
            Ok(violations) => Self::worst(violations),
            // It is logged; the rest of the page is not worse for it.
            Err(_) => Self {
                lost: true,
                ..Self::default()
            },
        })
    }

    fn worst(violations: ViolationsView) -> Self {
        let mut slow: Vec<(Task, SlowEpisode)> = violations
            .tasks
            .into_iter()
            .flat_map(|(task, of_task)| {
                let episodes = of_task.computation_time.into_iter();
                episodes.map(move |episode| (task, episode))
            })
            .collect();
        slow.sort_by(|(_, a), (_, b)| {
            let by_points = b.points.total_cmp(&a.points);
            by_points.then_with(|| b.max_s.total_cmp(&a.max_s))
        });
        Self {
            episodes: slow.len(),
            shown: slow
                .into_iter()
                .take(Self::SHOWN)
                .map(|(task, episode)| SlowAnswer::of(task, &episode))
                .collect(),
            lost: false,
            removed: false,
        }
    }
}

impl SlowAnswer {
    fn of(task: Task, episode: &SlowEpisode) -> Self {
        Self {
            task,
            episode: episode.episode,
            points: figures::one(episode.points),
            mean_ms: figures::milliseconds(episode.mean_s),
            max_ms: figures::milliseconds(episode.max_s),
            step: episode.slowest.map(|slowest| SlowStepFigures {
                step: slowest.step,
                wall_ms: figures::milliseconds(slowest.wall_s),
                host_ms: figures::milliseconds(slowest.host_s),
                cpu_ms: slowest.cpu_s.map(figures::milliseconds),
            }),
        }
    }
}
