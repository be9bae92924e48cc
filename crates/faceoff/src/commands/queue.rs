//! Text about the position of an evaluation in the queue.

use faceoff_api::views::queue::QueueView;

/// Position in the queue and expected end.
pub fn queue_text(queue: &QueueView) -> String {
    let expected = match queue.expected_at {
        Some(end) => format!(
            "expected to finish at {}",
            end.strftime("%Y-%m-%d %H:%M UTC")
        ),
        None => "finish time unknown".to_owned(),
    };
    format!("position {} of {}, {expected}", queue.position, queue.total)
}
