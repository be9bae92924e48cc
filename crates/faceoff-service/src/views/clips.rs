//! Clips of an evaluation: compressed recordings of its episodes. Motion and outcomes are public once the evaluation day is
//! released. Observations, actions, computation times and faults are visible to viewers with access to the dataset.

use crate::{
    app::AppState,
    archive_contents, boxed_future,
    day_release::check_released,
    problem::{Problem, ProblemKind},
    views::{
        clip_file::{ClipFile, Episode},
        visibility::Visibility,
    },
};
use faceoff_api::views::episodes::{EpisodesView, TimeBinView};
use faceoff_replay::{ClipIndex, ClipKey, EpisodeIndexEntry, Pack};
use faceoff_store::{Artifacts, Evaluation, EvaluationState};
use faceoff_types::{EvaluationId, Task, TaskMap};

/// The recorded clips of an evaluation, for a viewer.
#[derive(Debug)]
pub struct Clips {
    pub evaluation: Evaluation,
    /// Whether the viewer may see observations, actions, computation times and faults.
    pub can_see_observations: bool,
    pub file: ClipFile,
}

impl Clips {
    /// The clips of an evaluation, if the viewer may see them now.
    ///
    /// # Errors
    /// `NotFound`; `NotYet` before the release; `Blind` for a blind stage; `Removed` if the dataset was removed; `Conflict`
    /// without a result, and for evaluations by an older version of the server, which recorded no clips.
    #[boxed_future]
    pub async fn find(
        app: &AppState,
        visibility: &Visibility,
        id: EvaluationId,
    ) -> Result<Self, Problem> {
        let evaluation = app.store.evaluation(id).await?;
        visibility.check_not_blind(evaluation.stage_day.stage)?;
        let EvaluationState::Finished { dataset, .. } = &evaluation.state else {
            return Err(Problem::new(
                ProblemKind::Conflict,
                "the evaluation has no result yet; its episodes become visible with the result",
            ));
        };
        check_released(app, &evaluation).await?;
        if !visibility.has_team_access(&evaluation) {
            visibility.check_not_frozen(&evaluation, "shown")?;
        }
        if let Some(removal) = &evaluation.dataset_removed {
            return Err(Problem::removed("the recording and its replays", removal));
        }
        archive_contents::check_included(app, dataset, "recording").await?;
        let key = Artifacts::clips_key(dataset);
        let file = ClipFile::find(app, key).await?.ok_or_else(|| {
            Problem::new(
                ProblemKind::Conflict,
                "there are no replays of this evaluation: the server version that ran it did not record any. Download its \
                 dataset; `faceoff replay` shows the episodes",
            )
        })?;
        Ok(Self {
            can_see_observations: visibility.has_team_access(&evaluation)
                || visibility.is_public(&evaluation),
            file,
            evaluation,
        })
    }

    /// An episode's clip, gzip-compressed.
    ///
    /// # Errors
    /// `NotFound` if there is no such episode.
    #[boxed_future]
    pub async fn clip(&self, key: ClipKey) -> Result<Vec<u8>, Problem> {
        self.file.clip(key).await
    }

    /// An episode with its decoded clips.
    ///
    /// # Errors
    /// `NotFound` if there is no such episode.
    #[boxed_future]
    pub async fn episode(&self, task: Task, episode: u32) -> Result<Episode, Problem> {
        self.file
            .episode(task, episode, self.can_see_observations)
            .await
    }

    /// Histogram of computation times by task; empty without access to the dataset.
    ///
    /// # Errors
    /// `Internal` if the file cannot be read.
    #[boxed_future]
    pub async fn computation_times(&self) -> Result<TaskMap<Vec<TimeBinView>>, Problem> {
        match self.can_see_observations {
            true => Ok(self.episodes().await?.computation_times),
            false => Ok(TaskMap::new()),
        }
    }

    /// The outcomes of all episodes.
    ///
    /// # Errors
    /// `Internal` if the file cannot be read.
    #[boxed_future]
    pub async fn episodes(&self) -> Result<EpisodesView, Problem> {
        let ClipIndex {
            mut episodes,
            times,
            ..
        } = self.file.read(Pack::clip_index).await?;
        if !self.can_see_observations {
            episodes.iter_mut().for_each(EpisodeIndexEntry::make_public);
        }
        let bins = |(task, times): (Task, faceoff_replay::TimeBins)| {
            let bins = times
                .bins()
                .map(|(from_s, to_s, steps)| TimeBinView {
                    from_s,
                    to_s,
                    steps,
                })
                .collect();
            (task, bins)
        };
        Ok(EpisodesView {
            episodes,
            computation_times: match self.can_see_observations {
                true => times.into_iter().map(bins).collect(),
                false => TaskMap::new(),
            },
        })
    }
}
