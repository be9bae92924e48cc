//! Text about the position of an evaluation in the queue.

use super::output::time_text;
use faceoff_api::views::queue::QueueView;

/// Position in the queue and expected end.
pub fn queue_text(queue: &QueueView) -> String {
    let expected = match queue.expected_at {
        Some(end) => format!("expected to finish at {}", time_text(end)),
        None => "finish time unknown".to_owned(),
    };
    format!("position {} of {}, {expected}", queue.position, queue.total)
}
