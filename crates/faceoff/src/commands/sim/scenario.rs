//! The scenario of `faceoff sim trace`, parsed and checked field by field: the initial state of puck and robots, and the actions of
//! the robots or the motion of a mallet.

use anyhow::{Context as _, Result, bail, ensure};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{AirHockeyProfile, Interpolation, JOINTS, MalletState, model::INITIAL_Q};
use faceoff_types::Seed;
use serde::Deserialize;
use serde_json::Value;
use std::io::Read;

/// Longest scenario file, longer than the trajectories of a whole game at 1 kHz.
const INPUT_LIMIT_BYTES: u64 = 512 << 20;

/// Longest scenario; a game takes 900 s.
const DURATION_LIMIT_MS: u64 = 1_000_000;

/// Largest accepted number, in SI units.
const NUMBER_LIMIT: f64 = 1e4;

/// The fields of the file, before they are checked.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScenario {
    task: Option<AirHockeyTask>,
    profile: Option<AirHockeyProfile>,
    seed: Option<Value>,
    /// Number of robots.
    robots: Option<u32>,
    puck: Vec<f64>,
    joints: Option<Vec<Vec<f64>>>,
    interpolation: Option<Vec<Interpolation>>,
    actions: Option<Vec<Vec<Value>>>,
    mallet: Option<Vec<Vec<f64>>>,
    duration_ms: u64,
    every_ms: Option<u64>,
}

#[derive(Debug)]
pub struct Scenario {
    /// Adds the task's opponent, terminations and success.
    pub task: Option<AirHockeyTask>,
    /// Perturbations of the world.
    pub profile: AirHockeyProfile,
    /// Used as evaluation seed and as episode seed.
    pub seed: Seed,
    /// [x, y, yaw, vx, vy, yaw rate].
    pub puck: [f64; 6],
    /// Initial joint positions (rad) of each robot.
    pub joints: Vec<[f64; JOINTS]>,
    /// How each robot interpolates between its actions.
    pub interpolation: Vec<Interpolation>,
    /// Actions by robot and control step, row-major.
    pub actions: Vec<Vec<Vec<f64>>>,
    /// Prescribed states of the first robot's mallet, one per ms; its arm then stays where it is.
    pub mallet: Vec<MalletState>,
    /// Duration of the scenario, ms.
    pub duration_ms: u64,
    /// Time between two lines of the output, ms.
    pub every_ms: u64,
}

impl Scenario {
    pub fn read(input: impl Read) -> Result<Self> {
        let mut text = String::new();
        let length = input
            .take(INPUT_LIMIT_BYTES + 1)
            .read_to_string(&mut text)
            .context("standard input: expected a scenario in UTF-8")? as u64;
        ensure!(
            length <= INPUT_LIMIT_BYTES,
            "the scenario is longer than {INPUT_LIMIT_BYTES} bytes"
        );
        let mut json = serde_json::Deserializer::from_str(&text);
        let raw: RawScenario = serde_path_to_error::deserialize(&mut json)
            .map_err(|error| match error.path().to_string().as_str() {
                "." => anyhow::anyhow!("{}", error.inner()),
                path => anyhow::anyhow!("{path}: {}", error.inner()),
            })
            .context("expected a scenario, one JSON object")?;
        json.end()
            .context("expected one scenario, got more after it")?;
        Self::check(raw)
    }

    fn check(raw: RawScenario) -> Result<Self> {
        let robots = match (raw.task, raw.robots) {
            (Some(AirHockeyTask::Hit), None | Some(2)) | (None, Some(2)) => 2,
            (Some(AirHockeyTask::Hit), Some(other)) => {
                bail!("robots: expected 2, as hit has an opponent, got {other}")
            }
            (Some(_) | None, None | Some(1)) => 1,
            (Some(task), Some(other)) => bail!("robots: expected 1 with task {task}, got {other}"),
            (None, Some(other)) => bail!("robots: expected 1 or 2, got {other}"),
        };
        // The simulator commands the opponent of hit.
        let robots_with_actions = if raw.task == Some(AirHockeyTask::Hit) {
            1
        } else {
            robots
        };
        let joints = parse_joints(&raw.joints.unwrap_or_default(), robots)?;
        let interpolation =
            complete_interpolations(&raw.interpolation.unwrap_or_default(), robots_with_actions)?;
        let actions = parse_actions(&raw.actions.unwrap_or_default(), &interpolation)?;
        let mallet = raw
            .mallet
            .unwrap_or_default()
            .iter()
            .enumerate()
            .map(|(index, row)| {
                let [x, y, z, vx, vy] = to_array(row, || format!("mallet[{index}]"))?;
                Ok(MalletState {
                    position: [x, y, z],
                    velocity: [vx, vy],
                })
            })
            .collect::<Result<_>>()?;
        ensure!(
            (1..=DURATION_LIMIT_MS).contains(&raw.duration_ms),
            "duration_ms: expected 1 to {DURATION_LIMIT_MS}, got {}",
            raw.duration_ms
        );
        let every_ms = raw.every_ms.unwrap_or(1);
        ensure!(every_ms >= 1, "every_ms: expected at least 1, got 0");
        Ok(Self {
            task: raw.task,
            profile: raw.profile.unwrap_or(AirHockeyProfile::Ideal),
            seed: parse_seed(raw.seed)?,
            puck: to_array(&raw.puck, || "puck".to_owned())?,
            joints,
            interpolation,
            actions,
            mallet,
            duration_ms: raw.duration_ms,
            every_ms,
        })
    }
}

fn parse_seed(value: Option<Value>) -> Result<Seed> {
    let text = match value {
        None | Some(Value::Null) => "0".to_owned(),
        Some(Value::Number(number)) => number.to_string(),
        Some(Value::String(text)) => text,
        Some(other) => bail!(
            "seed: expected a number or 64 hexadecimal digits, got {}",
            json_type(&other)
        ),
    };
    text.parse().with_context(|| format!("seed: {text}"))
}

/// The joint positions of each robot; those that are left out are the initial ones of episodes.
fn parse_joints(raw: &[Vec<f64>], robots: usize) -> Result<Vec<[f64; JOINTS]>> {
    ensure!(
        raw.len() <= robots,
        "joints: expected at most {robots} robots, got {}",
        raw.len()
    );
    let mut joints = vec![INITIAL_Q; robots];
    for (robot, positions) in raw.iter().enumerate() {
        joints[robot] = to_array(positions, || format!("joints[{robot}]"))?;
    }
    Ok(joints)
}

/// The interpolation of each robot; those that are left out are cubic.
fn complete_interpolations(raw: &[Interpolation], robots: usize) -> Result<Vec<Interpolation>> {
    ensure!(
        raw.len() <= robots,
        "interpolation: expected at most {robots} robots with actions, got {}",
        raw.len()
    );
    let mut all = vec![Interpolation::Cubic; robots];
    all[..raw.len()].copy_from_slice(raw);
    Ok(all)
}

fn parse_actions(
    raw: &[Vec<Value>],
    interpolation: &[Interpolation],
) -> Result<Vec<Vec<Vec<f64>>>> {
    ensure!(
        raw.len() <= interpolation.len(),
        "actions: expected at most {} robots with actions, got {}",
        interpolation.len(),
        raw.len()
    );
    let mut all = vec![Vec::new(); interpolation.len()];
    for (robot, steps) in raw.iter().enumerate() {
        for (step, action) in steps.iter().enumerate() {
            let field = || format!("actions[{robot}][{step}]");
            let shape = interpolation[robot].shape();
            let len = interpolation[robot].len();
            let mut flat = Vec::with_capacity(len);
            // The recordings of the reference simulator (`tests/reference`) concatenate the rows of an action.
            let input_shape = match action {
                Value::Array(items) if items.len() == len => &[len][..],
                _ => shape,
            };
            flatten(action, input_shape, &mut flat).with_context(|| {
                let shape: String = shape.iter().map(|n| format!("[{n}]")).collect();
                format!("{}: expected numbers of shape {shape}", field())
            })?;
            check_finite(&flat, field)?;
            all[robot].push(flat);
        }
    }
    Ok(all)
}

/// Appends the numbers of nested lists of this shape to `flat`.
fn flatten(value: &Value, shape: &[usize], flat: &mut Vec<f64>) -> Result<()> {
    match (value, shape) {
        (Value::Number(number), []) => {
            flat.push(number.as_f64().context("a number that is too large")?);
            Ok(())
        }
        (Value::Array(items), [length, inner @ ..]) => {
            ensure!(
                items.len() == *length,
                "got {} items instead of {length}",
                items.len()
            );
            items.iter().try_for_each(|item| flatten(item, inner, flat))
        }
        (other, []) => bail!("got {} instead of a number", json_type(other)),
        (other, _) => bail!("got {} instead of a list", json_type(other)),
    }
}

fn to_array<const N: usize>(numbers: &[f64], field: impl Fn() -> String) -> Result<[f64; N]> {
    check_finite(numbers, &field)?;
    numbers
        .try_into()
        .ok()
        .with_context(|| format!("{}: expected {N} numbers, got {}", field(), numbers.len()))
}

fn check_finite(numbers: &[f64], field: impl Fn() -> String) -> Result<()> {
    // NaN is refused, too.
    match numbers
        .iter()
        .find(|number| number.is_nan() || number.abs() > NUMBER_LIMIT)
    {
        None => Ok(()),
        Some(number) => {
            bail!(
                "{}: expected finite numbers within ±{NUMBER_LIMIT}, got {number}",
                field()
            )
        }
    }
}

fn json_type(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(json: &str) -> String {
        format!("{:#}", Scenario::read(json.as_bytes()).unwrap_err())
    }

    #[test]
    fn minimal_scenario_has_one_robot_in_the_initial_pose() {
        let scenario =
            Scenario::read(r#"{"puck": [0, 0, 0, 1, 0, 0], "duration_ms": 10}"#.as_bytes())
                .unwrap();
        assert_eq!(scenario.joints, [INITIAL_Q]);
        assert_eq!(scenario.interpolation, [Interpolation::Cubic]);
        assert_eq!(scenario.every_ms, 1);
    }

    #[test]
    fn action_rows_may_be_concatenated() {
        let numbers: Vec<f64> = (0..14).map(f64::from).collect();
        let action = |action: Value| {
            let scenario = serde_json::json!({
                "puck": [0, 0, 0, 0, 0, 0], "duration_ms": 20, "actions": [[action]],
            });
            let scenario = Scenario::read(scenario.to_string().as_bytes()).unwrap();
            scenario.actions[0][0].clone()
        };
        let rows = serde_json::json!([&numbers[..7], &numbers[7..]]);
        assert_eq!(action(rows), numbers);
        assert_eq!(action(serde_json::json!(numbers)), numbers);
    }

    #[test]
    fn error_names_field_and_expectation() {
        let puck = r#""puck": [0, 0, 0, 0, 0, 0], "duration_ms": 10"#;
        for (json, expected) in [
            (
                r#"{"puck": [0, 0], "duration_ms": 10}"#.to_owned(),
                "puck: expected 6 numbers, got 2",
            ),
            (
                r#"{"puck": [0, 0, 0, 0, 0, 1e999], "duration_ms": 1}"#.to_owned(),
                "puck",
            ),
            (r#"{"duration_ms": 10}"#.to_owned(), "missing field `puck`"),
            (
                r#"{"puck": [0, 0, 0, 0, 0, 0], "duration_ms": -1}"#.to_owned(),
                "duration_ms",
            ),
            (format!(r#"{{{puck}, "task": "juggle"}}"#), "task"),
            (
                format!(r#"{{{puck}, "robots": 3}}"#),
                "robots: expected 1 or 2, got 3",
            ),
            (
                format!(r#"{{{puck}, "interpolation": [6]}}"#),
                "interpolation[0]: unknown interpolation 6: expected 1, 2, 3",
            ),
            (
                format!(r#"{{{puck}, "actions": [[[[1, 2]]]]}}"#),
                "actions[0][0]: expected numbers of shape [2][7]",
            ),
            (
                format!(r#"{{{puck}, "actions": [[], []]}}"#),
                "actions: expected at most 1 robots",
            ),
            (
                format!(r#"{{{puck}, "mallet": [[1, 2, 3]]}}"#),
                "mallet[0]: expected 5 numbers, got 3",
            ),
            (
                format!(r#"{{{puck}, "every_ms": 0}}"#),
                "every_ms: expected at least 1",
            ),
            (
                format!(r#"{{{puck}, "pucks": 2}}"#),
                "unknown field `pucks`",
            ),
            ("[".to_owned(), "one JSON object"),
        ] {
            let message = error(&json);
            assert!(message.contains(expected), "{json}: {message}");
        }
    }
}
