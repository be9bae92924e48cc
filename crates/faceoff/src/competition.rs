//! The competition that this program runs.

use faceoff_airhockey::AirHockey;
use faceoff_api::requests::read_perturbations;
use faceoff_episode::Simulator;
use faceoff_sim::export::{ExportedModel, mjcf, urdf};
use faceoff_types::{
    Competition, InvalidWeights, Magnitudes, Profile, Task, TaskWeights, UnknownProfile,
    UnknownTask,
};
use std::sync::{Arc, LazyLock};

static SIMULATOR: LazyLock<Arc<AirHockey>> = LazyLock::new(faceoff_airhockey::simulator);

/// The only competition that is compiled in.
pub fn competition() -> &'static Arc<Competition> {
    SIMULATOR.competition()
}

/// The simulator of [`competition`].
pub fn simulator() -> Arc<dyn Simulator> {
    SIMULATOR.clone()
}

/// Models of the robot for other programs: file name, description, and content.
pub fn robot_model_files() -> [(&'static str, &'static str, String); 2] {
    [
        (
            "robot.urdf",
            "The robot arm with its mallet, for simulators that read URDF",
            urdf(ExportedModel::Plant),
        ),
        (
            "robot.mjcf.xml",
            "Robot arm, table and puck, for MuJoCo",
            mjcf(ExportedModel::Plant),
        ),
    ]
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

/// Reads a JSON file with magnitudes of perturbations.
///
/// # Errors
/// If the file cannot be read, or the competition does not have such magnitudes.
pub fn read_magnitudes(path: &str) -> Result<Magnitudes, String> {
    let mut magnitudes = read_perturbations(path)?;
    let checked = competition().check_magnitudes(&mut magnitudes);
    checked.map_err(|error| error.to_string())?;
    Ok(magnitudes)
}

/// Parses weights on the command line: numbers in the order of the tasks.
///
/// # Errors
/// If there is not a number for each task, or they do not sum to 1.
pub fn parse_weights(text: &str) -> Result<TaskWeights, InvalidWeights> {
    TaskWeights::parse(text, competition().task_names())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magnitudes_of_a_file_are_checked() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let read = |text: &str| {
            std::fs::write(file.path(), text).unwrap();
            read_magnitudes(file.path().to_str().unwrap())
        };
        assert!(read("{}").unwrap().is_empty());
        for (text, words) in [
            (
                r#"{"tracking_loss":{"probability":2}}"#,
                "tracking_loss.probability: expected a number from 0 to 1, got 2",
            ),
            (
                r#"{"tracking_loss":{"chance":0.5}}"#,
                "tracking_loss.chance: unknown, expected one of probability, steps",
            ),
            (r#"{"rain":{}}"#, "rain: unknown"),
            ("{", "EOF"),
        ] {
            let refused = read(text).unwrap_err();
            assert!(refused.contains(words), "{refused}");
        }
    }
}
