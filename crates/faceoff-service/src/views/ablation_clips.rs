//! What replays of an ablation's episodes are drawn from: of those that do not end as in the ideal simulator.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    viewer::Viewer,
    views::clip_file::{ClipFile, Episode},
};
use faceoff_replay::{EpisodeLine, Pack};
use faceoff_store::Artifacts;
use faceoff_types::{AblationId, Profile, SubmissionId, Task};
use std::collections::BTreeMap;

/// The clips that are kept of a submission's newest ablation.
#[derive(Debug)]
pub struct AblationClips {
    /// `None` without one.
    ablation: Option<AblationId>,
    /// Does the viewer see what was observed, commanded and timed, and the agent's faults?
    pub sees_observed: bool,
}

/// An episode that ends otherwise with a perturbation than without any.
#[derive(Debug, Clone, PartialEq)]
pub struct Differing {
    /// In the ideal simulator.
    pub ideal: EpisodeLine,
    pub perturbed: EpisodeLine,
}

impl Differing {
    /// The ideal one first.
    pub fn both(&self) -> [&EpisodeLine; 2] {
        [&self.ideal, &self.perturbed]
    }
}

impl AblationClips {
    /// Of a submission, whether anything is kept or not.
    ///
    /// # Errors
    /// `NotFound` if there is no such submission.
    #[boxed]
    pub async fn of(
        app: &AppState,
        viewer: Viewer,
        submission: SubmissionId,
    ) -> Result<Self, Problem> {
        let team = app.store.submission(submission).await?.team;
        let newest = app.store.newest_ablation(submission).await?;
        Ok(Self {
            ablation: newest.map(|ablation| ablation.id),
            sees_observed: match viewer {
                Viewer::Organiser => true,
                Viewer::Team(own) => own == team,
                Viewer::Anybody => false,
            },
        })
    }

    /// `None` of a profile in which all episodes end as in the ideal one.
    async fn find(&self, app: &AppState, profile: Profile) -> Result<Option<ClipFile>, Problem> {
        match self.ablation {
            Some(id) => ClipFile::find(app, Artifacts::ablation_clips(id, profile)).await,
            None => Ok(None),
        }
    }

    /// Those of a profile.
    ///
    /// # Errors
    /// `NotFound` if none are kept of it.
    #[boxed]
    pub async fn of_profile(&self, app: &AppState, profile: Profile) -> Result<ClipFile, Problem> {
        let file = self.find(app, profile).await?;
        file.ok_or_else(|| Problem::not_found("episode"))
    }

    /// By profile, in order of task and number.
    ///
    /// # Errors
    /// An internal problem, if a file cannot be read.
    #[boxed]
    pub async fn differing(
        &self,
        app: &AppState,
    ) -> Result<BTreeMap<Profile, Vec<Differing>>, Problem> {
        let Some(ideal) = self.find(app, Profile::Ideal).await? else {
            return Ok(BTreeMap::new());
        };
        let ideal = ideal.read(Pack::sheet).await?;
        let mut differing = BTreeMap::new();
        let all = Profile::ABLATION.into_iter();
        for profile in all.filter(|profile| *profile != Profile::Ideal) {
            let Some(file) = self.find(app, profile).await? else {
                continue;
            };
            let perturbed = file.read(Pack::sheet).await?.episodes;
            let pairs = perturbed.into_iter().filter_map(|perturbed| {
                let ideal = ideal.line(perturbed.task, perturbed.episode)?.clone();
                let mut pair = Differing { ideal, perturbed };
                if !self.sees_observed {
                    pair.ideal.make_public();
                    pair.perturbed.make_public();
                }
                Some(pair)
            });
            differing.insert(profile, pairs.collect());
        }
        Ok(differing)
    }

    /// An episode, read.
    ///
    /// # Errors
    /// `NotFound` if it is not kept.
    #[boxed]
    pub async fn episode(
        &self,
        app: &AppState,
        profile: Profile,
        task: Task,
        episode: u32,
    ) -> Result<Episode, Problem> {
        let file = self.of_profile(app, profile).await?;
        file.episode(task, episode, self.sees_observed).await
    }
}
