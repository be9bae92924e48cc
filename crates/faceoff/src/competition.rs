//! The competition that this program runs.

use faceoff_airhockey::AirHockey;
use faceoff_episode::Simulator;
use faceoff_types::{
    Competition, InvalidWeights, Profile, Task, TaskWeights, UnknownProfile, UnknownTask,
};
use std::sync::{Arc, LazyLock};

static SIMULATOR: LazyLock<Arc<AirHockey>> = LazyLock::new(faceoff_airhockey::simulator);

/// The only competition that is compiled in.
pub fn competition() -> &'static Arc<Competition> {
    SIMULATOR.competition()
}

/// Its simulator.
pub fn simulator() -> Arc<dyn Simulator> {
    SIMULATOR.clone()
}

/// Parses a task on the command line.
///
/// # Errors
/// If the competition has no such task.
pub fn parse_task(name: &str) -> Result<Task, UnknownTask> {
    competition().find_task(name)
}

/// Parses a profile, a set of perturbations, on the command line.
///
/// # Errors
/// If the competition has no such profile.
pub fn parse_profile(name: &str) -> Result<Profile, UnknownProfile> {
    competition().find_profile(name)
}

/// Parses weights on the command line: numbers in the order of the tasks.
///
/// # Errors
/// If there is not a number for each task, or they do not sum to 1.
pub fn parse_weights(text: &str) -> Result<TaskWeights, InvalidWeights> {
    TaskWeights::parse(text, competition().task_names())
}
