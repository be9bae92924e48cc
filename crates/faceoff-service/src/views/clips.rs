//! What replays of an evaluation's episodes are drawn from. The motion, and how each episode went, are there for everybody once the
//! day is released; what the agent was told and commanded, its times and its faults for whoever gets the dataset.

use crate::{
    app::AppState,
    archived, boxed,
    problem::{Problem, ProblemKind},
    release::check_released,
    views::{
        clip_file::{ClipFile, Episode},
        sight::Sight,
    },
};
use faceoff_api::views::clips::{EpisodesView, TimeBinView};
use faceoff_replay::{EpisodeLine, Key, Pack, Sheet};
use faceoff_store::{Artifacts, Evaluation, EvaluationState};
use faceoff_types::{EvaluationId, Task};
use std::collections::BTreeMap;

/// The recorded clips of an evaluation, for a viewer.
#[derive(Debug)]
pub struct Clips {
    pub evaluation: Evaluation,
    /// Does the viewer see what was observed, commanded and timed, and the agent's faults?
    pub sees_observed: bool,
    pub file: ClipFile,
}

impl Clips {
    /// Of an evaluation, if the viewer may see it now.
    ///
    /// # Errors
    /// `NotFound`, `NotYet`, `Blind`; `Gone` once the dataset was removed; `Conflict` for one without a result, or one that an
    /// older version of the server has played.
    #[boxed]
    pub async fn of(app: &AppState, sight: &Sight, id: EvaluationId) -> Result<Self, Problem> {
        let evaluation = app.store.evaluation(id).await?;
        sight.check_shown(evaluation.of.stage)?;
        let EvaluationState::Finished { dataset, .. } = &evaluation.state else {
            return Err(Problem::new(
                ProblemKind::Conflict,
                "the evaluation has no result, and its episodes are shown with it",
            ));
        };
        check_released(app, &evaluation).await?;
        if !sight.is_own(&evaluation) {
            sight.check_not_frozen(&evaluation, "shown")?;
        }
        if let Some(removed) = &evaluation.dataset_removed {
            return Err(Problem::removed(
                "the recording, with the replays that are drawn from it,",
                removed,
            ));
        }
        archived::check_kept(app, dataset, "recording").await?;
        let key = Artifacts::clips_of(dataset);
        let file = ClipFile::find(app, key).await?.ok_or_else(|| {
            Problem::new(
                ProblemKind::Conflict,
                "there are no replays of this evaluation: the version of the server that played it made none. Its \
                 dataset has the episodes, and `faceoff replay` draws them",
            )
        })?;
        Ok(Self {
            sees_observed: sight.is_own(&evaluation) || sight.is_public(&evaluation),
            file,
            evaluation,
        })
    }

    /// An episode's clip, gzip-compressed.
    ///
    /// # Errors
    /// `NotFound` if there is no such episode.
    #[boxed]
    pub async fn clip(&self, key: Key) -> Result<Vec<u8>, Problem> {
        self.file.clip(key).await
    }

    /// An episode, read.
    ///
    /// # Errors
    /// `NotFound` if there is no such episode.
    #[boxed]
    pub async fn episode(&self, task: Task, episode: u32) -> Result<Episode, Problem> {
        self.file.episode(task, episode, self.sees_observed).await
    }

    /// By task how many control steps were answered in which time; empty for whom that is not.
    ///
    /// # Errors
    /// An internal problem, if the file cannot be read.
    #[boxed]
    pub async fn computation_times(&self) -> Result<BTreeMap<Task, Vec<TimeBinView>>, Problem> {
        match self.sees_observed {
            true => Ok(self.episodes().await?.computation_times),
            false => Ok(BTreeMap::new()),
        }
    }

    /// How the episodes went.
    ///
    /// # Errors
    /// An internal problem, if the file cannot be read.
    #[boxed]
    pub async fn episodes(&self) -> Result<EpisodesView, Problem> {
        let Sheet {
            mut episodes,
            times,
            ..
        } = self.file.read(Pack::sheet).await?;
        if !self.sees_observed {
            episodes.iter_mut().for_each(EpisodeLine::make_public);
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
            computation_times: match self.sees_observed {
                true => times.into_iter().map(bins).collect(),
                false => BTreeMap::new(),
            },
        })
    }
}
