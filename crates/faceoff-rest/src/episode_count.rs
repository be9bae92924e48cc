//! Checks the number of episodes per task that a request asks for.

use faceoff_service::problem::Problem;
use faceoff_types::MAX_EPISODES_PER_TASK;

/// The number of episodes per task, if it is valid.
pub(super) fn checked_episodes(episodes: u32) -> Result<u32, Problem> {
    if (1..=MAX_EPISODES_PER_TASK).contains(&episodes) {
        return Ok(episodes);
    }
    let detail = format!("expected 1 to {MAX_EPISODES_PER_TASK}, got {episodes}");
    Err(Problem::invalid("episodes_per_task", detail))
}
