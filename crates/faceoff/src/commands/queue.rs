use faceoff_api::views::queue::QueueView;

/// Where something stands in the queue, in words.
pub fn in_queue(queue: &QueueView) -> String {
    let expected = match queue.expected_at {
        Some(at) => format!("expected to be over {}", at.strftime("%Y-%m-%d %H:%M UTC")),
        None => "nobody can tell yet when it will be over".to_owned(),
    };
    format!(
        "number {} of {} to be over, {expected}",
        queue.place, queue.of
    )
}
