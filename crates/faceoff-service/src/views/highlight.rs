//! The highlight of a board: the quickest success of its first team whose episodes are visible.

use crate::{
    app::AppState,
    boxed_future,
    highlight::Highlight,
    problem::Problem,
    views::{clips::Clips, visibility::Visibility},
};
use faceoff_api::views::board::BoardRow;
use faceoff_replay::{Clip, ClipKey, EpisodeIndexEntry, Pack, ReplayError};
use faceoff_types::{Competition, EvaluationId};
use jiff::civil::Date;
use std::{cmp::Reverse, sync::Arc};

/// Teams whose episodes are looked at, from the first of the board on.
const MAX_TEAMS: usize = 3;

/// A highlight with its team.
#[derive(Debug)]
pub struct TeamHighlight {
    pub team: String,
    pub evaluation: EvaluationId,
    /// The date of its evaluation day.
    pub day: Date,
    pub highlight: Arc<Option<Highlight>>,
}

/// The highlight of a board with these rows; `None` if no success of the first teams is visible to the viewer. Errors
/// are in the log, and must not take down the page of which the highlight is an ornament.
#[boxed_future]
pub async fn of_board(
    app: &AppState,
    visibility: &Visibility,
    rows: &[BoardRow],
) -> Option<TeamHighlight> {
    for row in rows.iter().take(MAX_TEAMS) {
        // Not every problem is an error: episodes are not visible before the release, or were removed, or never recorded.
        if let Ok(highlight) = of_evaluation(app, visibility, row.evaluation).await
            && highlight.is_some()
        {
            return Some(TeamHighlight {
                team: row.team.to_string(),
                evaluation: row.evaluation,
                day: row.day,
                highlight,
            });
        }
    }
    None
}

async fn of_evaluation(
    app: &AppState,
    visibility: &Visibility,
    evaluation: EvaluationId,
) -> Result<Arc<Option<Highlight>>, Problem> {
    let clips = Clips::find(app, visibility, evaluation).await?;
    let competition = Arc::clone(app.config.competition());
    let find = async {
        let found = clips
            .file
            .read(move |pack| quickest_success(pack, &competition));
        Ok(Arc::new(found.await?))
    };
    app.highlights.get(clips.file.key.clone(), find).await
}

/// The quickest success of the task with the largest share in the score; of two such tasks, of the one that comes first.
fn quickest_success(
    pack: &Pack,
    competition: &Competition,
) -> Result<Option<Highlight>, ReplayError> {
    let index = pack.clip_index()?;
    let mut tasks: Vec<_> = competition.tasks.iter().collect();
    tasks.sort_by_key(|info| Reverse(info.weight));
    let successes = |task| {
        let summaries = index.episodes.iter();
        summaries
            .filter(move |summary| summary.task == task && summary.success && summary.has_clips())
    };
    let quickest: Option<&EpisodeIndexEntry> = tasks.iter().find_map(|info| {
        successes(info.task).min_by_key(|summary| (summary.steps, summary.episode))
    });
    let Some(summary) = quickest else {
        return Ok(None);
    };
    let Some(bytes) = pack.clip(ClipKey::motion(summary.task, summary.episode))? else {
        return Ok(None);
    };
    Ok(Some(Highlight {
        task: summary.task,
        episode: summary.episode,
        steps: summary.steps,
        motion: Clip::read(&bytes)?,
    }))
}
