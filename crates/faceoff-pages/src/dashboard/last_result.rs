//! The last result of a team: its rank, a bar for each task, and the worst failed episodes.

use crate::{
    board_status::shared_rank, episode_text::plain_end, format::Rate, replay::page_path,
    replay_section::Still,
};
use faceoff_api::{requests::BoardQuery, views::board::BoardRow};
use faceoff_replay::EpisodeIndexEntry;
use faceoff_service::{
    app::App,
    problem::Problem,
    viewer::Viewer,
    views::{board, clips::Clips, visibility::Visibility},
};
use faceoff_types::{EvaluationId, Task, TeamId, Tier};
use jiff::civil::Date;
use std::cmp::Reverse;

/// Failed episodes on the page.
const MAX_FAILED: usize = 3;

/// The team's row of the board.
pub(super) struct LastResult {
    pub(super) rank: String,
    /// Number of ranked teams.
    pub(super) ranked: usize,
    pub(super) day: Date,
    pub(super) evaluation: EvaluationId,
    pub(super) score: Rate,
    /// `None` in a competition without tiers.
    pub(super) tier: Option<Tier>,
    /// Titles and success rates.
    pub(super) tasks: Vec<(String, Rate)>,
    pub(super) failed: Vec<FailedEpisode>,
}

/// An episode without success.
pub(super) struct FailedEpisode {
    pub(super) task: Task,
    pub(super) episode: u32,
    /// The page of its replay.
    pub(super) path: String,
    pub(super) end_reason: String,
    /// Number of kinds of violations.
    pub(super) violations: usize,
    pub(super) still: Still,
}

/// The last result of a team in the current stage, as its members may see it; `None` if there is none yet, and for
/// reference agents, which have no rank.
pub(super) async fn of_team(app: &App, team: TeamId) -> Result<Option<LastResult>, Problem> {
    let visibility = Visibility::load(app, Viewer::Team(team)).await?;
    let board = board::query(app, &visibility, BoardQuery::default(), None).await?;
    let own_row = board.rows.iter().find(|row| row.team_id == team);
    let Some(row) = own_row else {
        return Ok(None);
    };
    let tasks = app.config.competition().tasks.iter();
    let tasks = tasks.filter_map(|info| {
        let result = row.tasks.get(&info.task)?;
        Some((info.title.clone(), Rate::new(result)))
    });
    Ok(Some(LastResult {
        rank: shared_rank(&board.rows, row),
        ranked: board.rows.len(),
        day: row.day,
        evaluation: row.evaluation,
        score: Rate::of_score(row.score, &row.tasks, &board.weights),
        tier: row.tier,
        tasks: tasks.collect(),
        // An error, which is in the log, omits these episodes only: the rest of the dashboard, such as the upload, must work.
        failed: worst_failed(app, &visibility, row)
            .await
            .unwrap_or_default(),
    }))
}

/// The failed episodes with the most violations, then with the most late answers: first the worst one of each task, then others. A problem
/// if there are no replays, or none any more.
async fn worst_failed(
    app: &App,
    visibility: &Visibility,
    row: &BoardRow,
) -> Result<Vec<FailedEpisode>, Problem> {
    let clips = Clips::find(app, visibility, row.evaluation).await?;
    let mut summaries = clips.episodes().await?.episodes;
    summaries.retain(|summary| !summary.success && summary.has_clips());
    summaries.sort_by_key(|summary| Reverse(badness(summary)));
    let mut tasks = Vec::new();
    let (mut worst, others): (Vec<EpisodeIndexEntry>, Vec<EpisodeIndexEntry>) =
        summaries.into_iter().partition(|summary| {
            let is_first = !tasks.contains(&summary.task);
            tasks.push(summary.task);
            is_first
        });
    worst.extend(others);
    worst.truncate(MAX_FAILED);
    let mut failed = Vec::new();
    for summary in worst {
        let episode = clips.episode(summary.task, summary.episode).await?;
        failed.push(FailedEpisode {
            task: summary.task,
            episode: summary.episode,
            path: page_path(row.evaluation, summary.task, summary.episode),
            violations: summary.violations.len(),
            end_reason: plain_end(&summary, &episode.motion.header.contacts),
            still: Still::new(&episode.motion, None),
        });
    }
    Ok(failed)
}

/// What orders failed episodes, the worst one last: the number of violations, then of late answers.
fn badness(summary: &EpisodeIndexEntry) -> (usize, u32) {
    (summary.violations.len(), summary.late_answers)
}
