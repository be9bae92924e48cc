//! `/submissions/{id}/ablation`: an ablation, which measures the effect of each *perturbation* on an agent. A perturbation is a disturbance
//! of the simulation, such as sensor noise; a *profile* is a set of perturbations. The page has a chart, a table, and the episodes that
//! end with another outcome than in the ideal simulator.

pub(super) mod pair;

use super::{
    assets,
    chart::{LabelledRate, RateChart},
    format,
    frame::{Frame, NO_ENTRY, PageProblem, render},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::ablation::AblationStatus;
use faceoff_scoring::{ProfileEffect, SIGNIFICANCE};
use faceoff_service::{
    app::App,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{
        ablation,
        ablation_clips::{AblationClips, DifferingEpisode},
        submission, team,
    },
};
use faceoff_types::{Competition, Profile, SubmissionId, Task};

/// One row of the table.
struct Row {
    profile: Profile,
    /// Label below the bar of the profile.
    letter: char,
    percent: String,
    low: String,
    high: String,
    successes: u32,
    episodes: u32,
    penalty_points: String,
    /// Difference to the ideal profile; `None` for the ideal one.
    difference: Option<Difference>,
}

/// Difference of the success rate to the ideal profile, which has no perturbations.
struct Difference {
    /// In percentage points.
    points: String,
    /// Episodes solved only in the ideal simulator.
    lost: u32,
    /// Episodes solved only with the profile.
    gained: u32,
    p_value: String,
    is_significant: bool,
}

/// Results of a task.
struct TaskResults {
    task: Task,
    chart: RateChart,
    rows: Vec<Row>,
}

#[derive(Template)]
#[template(path = "ablation.html")]
struct Page {
    frame: Frame,
    team: String,
    agent: Option<String>,
    episodes_per_task: u32,
    status: AblationStatus,
    task_results: Vec<TaskResults>,
    /// The letters of the profiles and what they stand for.
    legend: String,
    style: &'static str,
    id: SubmissionId,
    outcome_changes: Vec<OutcomeChanges>,
    has_replays: bool,
}

/// Episodes that end differently with a profile than in the ideal simulator.
struct OutcomeChanges {
    profile: Profile,
    pairs: Vec<DifferingEpisode>,
}

/// The newest ablation of a submission.
pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let submission = submission::find(&app, id).await?;
    let Some(view) = ablation::newest(&app, id).await? else {
        let detail = "there is no ablation of this submission";
        return Err(Problem::new(ProblemKind::NotFound, detail).into());
    };
    let team = team::find(&app, submission.team).await?;
    let task_results = match &view.status {
        AblationStatus::Finished { tasks, .. } => {
            let results = tasks.iter();
            results
                .map(|(task, effects)| TaskResults::new(*task, effects, app.config.competition()))
                .collect()
        }
        AblationStatus::Unfinished { .. } | AblationStatus::Failed { .. } => Vec::new(),
    };
    let competition = app.config.competition();
    let profiles = competition.ablation_profiles();
    let profiles = profiles.filter_map(|profile| competition.profile(profile));
    let legend: Vec<String> = profiles
        .map(|info| format!("{}: {}", info.letter, info.title))
        .collect();
    let clips = AblationClips::load(&app, viewer?, id).await?;
    let outcome_changes = clips.differing_episodes(&app).await?.into_iter();
    render(&Page {
        frame: Frame::load(&app, NO_ENTRY).await?,
        legend: legend.join(", "),
        style: assets::EPISODES_STYLE.url(),
        id,
        has_replays: app.config.competition().has_replays,
        outcome_changes: outcome_changes
            .map(|(profile, pairs)| OutcomeChanges { profile, pairs })
            .collect(),
        team: team.name.to_string(),
        agent: submission.agent_name,
        episodes_per_task: view.episodes_per_task,
        status: view.status,
        task_results,
    })
}

impl TaskResults {
    fn new(task: Task, effects: &[ProfileEffect], competition: &Competition) -> Self {
        let rates: Vec<LabelledRate<'_>> = effects
            .iter()
            .map(|effect| LabelledRate {
                name: effect.profile.as_str(),
                is_ideal: effect.profile == competition.ideal_profile,
                letter: letter(effect.profile, competition),
                percent: 100.0 * effect.success_rate,
                interval: effect.success_ci95.map(|end| 100.0 * end),
            })
            .collect();
        Self {
            task,
            chart: RateChart::new(task.as_str(), &rates),
            rows: effects
                .iter()
                .map(|effect| Row::new(effect, competition))
                .collect(),
        }
    }
}

impl Row {
    fn new(effect: &ProfileEffect, competition: &Competition) -> Self {
        let [low, high] = effect.success_ci95;
        Self {
            profile: effect.profile,
            letter: letter(effect.profile, competition),
            percent: format::one_decimal(100.0 * effect.success_rate),
            low: format::one_decimal(100.0 * low),
            high: format::one_decimal(100.0 * high),
            successes: effect.successes,
            episodes: effect.episodes,
            penalty_points: format::one_decimal(effect.penalty_points),
            difference: (effect.profile != competition.ideal_profile).then(|| Difference {
                points: format::signed(100.0 * effect.difference),
                lost: effect.lost,
                gained: effect.gained,
                p_value: format::p_value(effect.p_value),
                is_significant: effect.p_value <= SIGNIFICANCE,
            }),
        }
    }
}

/// Letter of a profile in the chart. An old ablation may have a profile that the competition no longer has.
fn letter(profile: Profile, competition: &Competition) -> char {
    competition.profile(profile).map_or('?', |info| info.letter)
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_airhockey::{EVALUATION, IDEAL, competition};

    #[test]
    fn profiles_have_letters_and_p_decides_significance() {
        let effect = ProfileEffect {
            profile: EVALUATION,
            episodes: 4,
            successes: 1,
            success_rate: 0.25,
            success_ci95: [0.05, 0.7],
            penalty_points: 3.0,
            difference: -0.5,
            lost: 2,
            gained: 0,
            p_value: 0.5,
        };
        let row = Row::new(&effect, &competition());
        assert_eq!(row.letter, 'E');
        let difference = row.difference.unwrap();
        assert_eq!(
            (difference.points.as_str(), difference.is_significant),
            ("−50.0", false)
        );
        let ideal = ProfileEffect {
            profile: IDEAL,
            ..effect
        };
        assert!(Row::new(&ideal, &competition()).difference.is_none());
    }
}
