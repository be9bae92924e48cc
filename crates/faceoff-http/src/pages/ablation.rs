//! `/submissions/{id}/ablation`: what each perturbation costs an agent, as a chart and as a table, and the episodes that it
//! changes.

pub(super) mod pair;

use super::{
    assets, figures,
    frame::{Frame, PageProblem, render},
};
use crate::{
    app::App,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{
        ablation::{AblationStatus, AblationView},
        ablation_clips::{AblationClips, Differing},
        season::SeasonHead,
        submission::SubmissionView,
        team::TeamView,
    },
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_scoring::{ProfileEffect, SIGNIFICANCE};
use faceoff_types::{Profile, SubmissionId, Task};

/// The chart's measures, in its own units.
const LEFT: f64 = 46.0;
const TOP: f64 = 22.0;
const PLOT_HEIGHT: f64 = 240.0;
const BAR: f64 = 26.0;
const BAR_STEP: f64 = 36.0;
const GROUP_STEP: f64 = 248.0;

/// One bar of the chart and one row of the table.
struct Bar {
    profile: Profile,
    /// One letter, written under the bar.
    sign: char,
    x: String,
    y: String,
    height: String,
    /// Middle of the bar.
    middle: String,
    /// Ends of the 95 % interval, and where the figure stands.
    low_y: String,
    high_y: String,
    label_y: String,
    percent: String,
    whole_percent: String,
    low: String,
    high: String,
    successes: u32,
    episodes: u32,
    penalty_points: String,
    /// Against `ideal`; none of `ideal` itself.
    difference: Option<Difference>,
}

struct Difference {
    points: String,
    lost: u32,
    gained: u32,
    p: String,
    /// Can it be told from chance?
    clear: bool,
}

struct Group {
    task: Task,
    middle: String,
    bars: Vec<Bar>,
}

#[derive(Template)]
#[template(path = "ablation.html")]
struct Page {
    frame: Frame,
    team: String,
    agent: Option<String>,
    episodes_per_task: u32,
    status: AblationStatus,
    groups: Vec<Group>,
    style: &'static str,
    id: SubmissionId,
    changed: Vec<Changed>,
}

/// The episodes of a profile that do not end as in the ideal simulator.
struct Changed {
    profile: Profile,
    pairs: Vec<Differing>,
}

/// The newest ablation of a submission.
pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    id: Result<PathParam<SubmissionId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let submission = SubmissionView::find(&app, id).await?;
    let Some(view) = AblationView::newest(&app, id).await? else {
        let detail = "there is no ablation of this submission";
        return Err(Problem::new(ProblemKind::NotFound, detail).into());
    };
    let team = TeamView::find(&app, submission.team).await?;
    let season = SeasonHead::now(&app).await?;
    let groups = match &view.status {
        AblationStatus::Finished { tasks, .. } => {
            let left = (0..).map(|group| LEFT + f64::from(group) * GROUP_STEP);
            left.zip(tasks)
                .map(|(left, (task, effects))| group(left, *task, effects))
                .collect()
        }
        AblationStatus::Open { .. } | AblationStatus::Failed { .. } => Vec::new(),
    };
    let clips = AblationClips::of(&app, viewer?, id).await?;
    let changed = clips.differing().await?.into_iter();
    render(&Page {
        frame: Frame::of(&app, season.name, ""),
        style: assets::EPISODES_STYLE.url(),
        id,
        changed: changed
            .map(|(profile, pairs)| Changed { profile, pairs })
            .collect(),
        team: team.name.to_string(),
        agent: submission.agent_name,
        episodes_per_task: view.episodes_per_task,
        status: view.status,
        groups,
    })
}

fn group(left: f64, task: Task, effects: &[ProfileEffect]) -> Group {
    let bars: Vec<Bar> = (0..)
        .zip(effects)
        .map(|(index, effect)| bar(left + 16.0 + f64::from(index) * BAR_STEP, effect))
        .collect();
    let width = 16.0 + BAR_STEP * effects.len() as f64;
    Group {
        task,
        middle: figures::one(left + width / 2.0),
        bars,
    }
}

fn bar(x: f64, effect: &ProfileEffect) -> Bar {
    let y = |rate: f64| TOP + PLOT_HEIGHT * (1.0 - rate.clamp(0.0, 1.0));
    let [low, high] = effect.success_ci95;
    let rate = effect.success_rate;
    Bar {
        profile: effect.profile,
        sign: sign(effect.profile),
        x: figures::one(x),
        y: figures::one(y(rate)),
        height: figures::one(TOP + PLOT_HEIGHT - y(rate)),
        middle: figures::one(x + BAR / 2.0),
        low_y: figures::one(y(low)),
        high_y: figures::one(y(high)),
        label_y: figures::one(y(high) - 5.0),
        percent: figures::one(100.0 * rate),
        whole_percent: format!("{:.0}", 100.0 * rate),
        low: figures::one(100.0 * low),
        high: figures::one(100.0 * high),
        successes: effect.successes,
        episodes: effect.episodes,
        penalty_points: figures::one(effect.penalty_points),
        difference: (effect.profile != Profile::Ideal).then(|| Difference {
            points: format!("{:+.1}", 100.0 * effect.difference),
            lost: effect.lost,
            gained: effect.gained,
            p: format!("{:.3}", effect.p_value),
            clear: effect.p_value <= SIGNIFICANCE,
        }),
    }
}

/// A letter for each profile, since colour alone must not carry it.
const fn sign(profile: Profile) -> char {
    match profile {
        Profile::Ideal => 'I',
        Profile::ModelMismatch => 'M',
        Profile::ObservationNoise => 'N',
        Profile::Disturbance => 'D',
        Profile::TrackingLoss => 'T',
        Profile::Delay => 'L',
        Profile::Evaluation => 'E',
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_profile_has_a_letter_of_its_own_and_a_bar_as_high_as_its_rate() {
        let signs: BTreeSet<char> = Profile::ABLATION.into_iter().map(sign).collect();
        assert_eq!(signs.len(), Profile::ABLATION.len());
        let effect = ProfileEffect {
            profile: Profile::Evaluation,
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
        let bar = bar(100.0, &effect);
        assert_eq!((bar.y.as_str(), bar.height.as_str()), ("202.0", "60.0"));
        assert_eq!((bar.low_y.as_str(), bar.high_y.as_str()), ("250.0", "94.0"));
        let difference = bar.difference.unwrap();
        assert_eq!(
            (difference.points.as_str(), difference.clear),
            ("-50.0", false)
        );
    }
}
