//! Clips of an ablation. An *ablation* runs a submission under several profiles (sets of perturbations) on the same episodes. A
//! *clip* is the compressed recording of an episode. Clips are stored of the episodes whose outcome under a profile differs from
//! that in the ideal simulator.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    viewer::Viewer,
    views::clip_file::{ClipFile, Episode},
};
use faceoff_replay::{EpisodeIndexEntry, Pack};
use faceoff_store::Artifacts;
use faceoff_types::{AblationId, Profile, ProfileMap, SubmissionId, Task};

/// The stored clips of a submission's newest ablation.
#[derive(Debug)]
pub struct AblationClips {
    /// `None` if the submission has no ablation.
    ablation: Option<AblationId>,
    /// Whether the viewer may see observations, actions, computation times and faults.
    pub can_see_observations: bool,
}

/// An episode whose outcome under a perturbation differs from that in the ideal simulator.
#[derive(Debug, Clone, PartialEq)]
pub struct DifferingEpisode {
    /// The outcome in the ideal simulator.
    pub ideal: EpisodeIndexEntry,
    /// The outcome under the perturbation.
    pub perturbed: EpisodeIndexEntry,
}

impl DifferingEpisode {
    /// Both outcomes, the ideal one first.
    pub fn both(&self) -> [&EpisodeIndexEntry; 2] {
        [&self.ideal, &self.perturbed]
    }
}

impl AblationClips {
    /// The clips of a submission; it may have none.
    ///
    /// # Errors
    /// `NotFound` if there is no such submission.
    #[boxed_future]
    pub async fn load(
        app: &AppState,
        viewer: Viewer,
        submission: SubmissionId,
    ) -> Result<Self, Problem> {
        let team = app.store.submission(submission).await?.team;
        let newest = app.store.newest_ablation(submission).await?;
        Ok(Self {
            ablation: newest.map(|ablation| ablation.id),
            can_see_observations: match viewer {
                Viewer::Organiser => true,
                Viewer::Team(viewer_team) => viewer_team == team,
                Viewer::Visitor => false,
            },
        })
    }

    /// The clip file of a profile; `None` if all of its episodes end as in the ideal simulator.
    async fn find(&self, app: &AppState, profile: Profile) -> Result<Option<ClipFile>, Problem> {
        match self.ablation {
            Some(id) => ClipFile::find(app, Artifacts::ablation_clips_key(id, profile)).await,
            None => Ok(None),
        }
    }

    /// The clip file of a profile.
    ///
    /// # Errors
    /// `NotFound` if there is none.
    #[boxed_future]
    pub async fn profile_file(
        &self,
        app: &AppState,
        profile: Profile,
    ) -> Result<ClipFile, Problem> {
        let file = self.find(app, profile).await?;
        file.ok_or_else(|| Problem::not_found("episode"))
    }

    /// The differing episodes by profile, in order of task and number.
    ///
    /// # Errors
    /// An internal problem, if a file cannot be read.
    #[boxed_future]
    pub async fn differing_episodes(
        &self,
        app: &AppState,
    ) -> Result<ProfileMap<Vec<DifferingEpisode>>, Problem> {
        let competition = app.config.competition();
        let ideal_profile = competition.ideal_profile;
        let Some(ideal) = self.find(app, ideal_profile).await? else {
            return Ok(ProfileMap::new());
        };
        let ideal = ideal.read(Pack::clip_index).await?;
        let mut differing = ProfileMap::new();
        let profiles = competition.ablation_profiles();
        for profile in profiles.filter(|profile| *profile != ideal_profile) {
            let Some(file) = self.find(app, profile).await? else {
                continue;
            };
            let perturbed = file.read(Pack::clip_index).await?.episodes;
            let pairs = perturbed.into_iter().filter_map(|perturbed| {
                let ideal = ideal.summary(perturbed.task, perturbed.episode)?.clone();
                let mut pair = DifferingEpisode { ideal, perturbed };
                if !self.can_see_observations {
                    pair.ideal.make_public();
                    pair.perturbed.make_public();
                }
                Some(pair)
            });
            differing.insert(profile, pairs.collect());
        }
        Ok(differing)
    }

    /// An episode with its decoded clips.
    ///
    /// # Errors
    /// `NotFound` if it is not stored.
    #[boxed_future]
    pub async fn episode(
        &self,
        app: &AppState,
        profile: Profile,
        task: Task,
        episode: u32,
    ) -> Result<Episode, Problem> {
        let file = self.profile_file(app, profile).await?;
        file.episode(task, episode, self.can_see_observations).await
    }
}
