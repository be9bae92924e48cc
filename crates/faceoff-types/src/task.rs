//! Tasks of a competition, each of which an agent plays in many episodes.

use crate::short_name::short_name;
use indexmap::IndexMap;

/// The length of a control step of air hockey, in seconds (docs/rules.md, "What is played"). Other competitions have their own.
pub const CONTROL_STEP_S: f64 = 0.02;

/// Control steps of the longest episode of air hockey.
pub const EPISODE_STEPS: u32 = 500;

/// Maximum number of episodes per task in a run: a hundred times those of the original challenge's qualifying stage. With so many, a
/// success rate is known to ±0.3 %. Scoring holds all outcomes of a run in memory, some 300 bytes each.
pub const MAX_EPISODES_PER_TASK: u32 = 100_000;

/// Values by task, in the order of the competition's tasks.
pub type TaskMap<V> = IndexMap<Task, V>;

short_name! {
    /// The name of a task. [`Competition`](crate::Competition) defines which tasks exist, and their order.
    Task, "a task"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_keep_the_order_of_tasks() {
        let text = r#"{"push":1,"catch":2}"#;
        let map: TaskMap<u32> = serde_json::from_str(text).unwrap();
        assert_eq!(serde_json::to_string(&map).unwrap(), text);
    }
}
