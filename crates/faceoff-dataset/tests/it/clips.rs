//! Compares the clips for replays with the dataset that was recorded with them.

use crate::recordings::{Evaluation, swing_arm};
use arrow_array::{Array, Int64Array, cast::AsArray, types::Float64Type};
use faceoff_airhockey::{DEFEND, EE, HIT, JOINT_POS, JOINT_VEL, LINK, PREPARE, simulator};
use faceoff_dataset::{Dataset, assemble};
use faceoff_replay::{Clip, ClipKey, ContactWith, Pack};
use faceoff_types::Task;
use std::path::PathBuf;

const SHARDS: [(Task, std::ops::Range<u32>); 4] =
    [(HIT, 0..2), (DEFEND, 0..3), (DEFEND, 3..6), (PREPARE, 0..2)];

/// Distance of a robot's base from the centre of the table: observations are in the base frame, clips in the table frame.
const BASE_X_M: f64 = 1.51;

/// A recorded evaluation with its dataset and the pack of its clips.
struct Fixture {
    evaluation: Evaluation,
    dataset: Dataset,
    clips: PathBuf,
    pack: Pack,
}

fn fixture(name: &str) -> Fixture {
    let evaluation = Evaluation::play(Some(swing_arm), &SHARDS);
    let clips = evaluation.dir.path().join(name);
    let archive = evaluation.archive();
    let assembled = assemble(
        &evaluation.meta,
        &evaluation.shards,
        &archive,
        Some(&clips),
        simulator().as_ref(),
    );
    assert!(assembled.unwrap().has_clips);
    Fixture {
        dataset: Dataset::open(&archive, simulator().competition()).unwrap(),
        pack: Pack::open(&clips).unwrap(),
        evaluation,
        clips,
    }
}

fn clip(pack: &Pack, key: ClipKey) -> Clip {
    Clip::read(&pack.clip(key).unwrap().expect("the clip is there")).unwrap()
}

#[test]
fn samples_match_the_dataset_within_their_resolution() {
    let fixture = fixture("clips");
    for report in &fixture.evaluation.reports {
        for outcome in &report.outcomes {
            let (task, episode) = (outcome.task, outcome.episode);
            let rows = fixture.dataset.episode(task, episode, None).unwrap();
            let motion = clip(&fixture.pack, ClipKey::motion(task, episode));
            let observed = clip(&fixture.pack, ClipKey::observed(task, episode));
            assert_eq!(motion.header.samples, outcome.steps + 1);
            assert_eq!(motion.column("opponent_q_1").is_some(), task == HIT);
            let mut compared = 0;
            let float = |name: &str| rows[name].as_primitive::<Float64Type>().values().to_vec();
            for column in motion.columns.iter().chain(&observed.columns) {
                let name = column.name.as_str();
                let (expected, skip): (Vec<f64>, usize) = match name {
                    // Observations before each step; the last sample follows the last step.
                    "seen_x" => (
                        float("obs_puck_x").iter().map(|x| x - BASE_X_M).collect(),
                        0,
                    ),
                    "seen_y" => (float("obs_puck_y"), 0),
                    "seen_yaw" => (float("obs_puck_yaw"), 0),
                    "computation_time" => {
                        let times: &Int64Array = rows["computation_time_ns"].as_primitive();
                        (
                            times.values().iter().map(|ns| *ns as f64 * 1e-9).collect(),
                            0,
                        )
                    }
                    _ if name.starts_with("command_") => {
                        let joint: usize = name["command_".len()..].parse().unwrap();
                        let actions = rows["action"].as_list::<i32>();
                        let commanded = (0..actions.len()).map(|row| {
                            actions
                                .value(row)
                                .as_primitive::<Float64Type>()
                                .value(joint - 1)
                        });
                        (commanded.collect(), 0)
                    }
                    // The states after the steps; the first sample is the initial state.
                    _ => (float(name), 1),
                };
                let found: Vec<f64> = column.values().skip(skip).collect();
                assert!(
                    found.len() >= expected.len(),
                    "{name}: {} values",
                    found.len()
                );
                for (step, (found, expected)) in found.iter().zip(&expected).enumerate() {
                    assert!(
                        (found - expected).abs() <= 0.5001 * column.scale,
                        "{task} {episode}, {name} of step {step}: {found}, recorded {expected}"
                    );
                    compared += 1;
                }
            }
            assert!(compared > 25 * outcome.steps, "{compared} numbers compared");
        }
    }
}

#[test]
fn contacts_are_near_the_neighbouring_samples() {
    let fixture = fixture("clips");
    let mut bodies = Vec::new();
    for (task, range) in SHARDS {
        for episode in range {
            let motion = clip(&fixture.pack, ClipKey::motion(task, episode));
            let positions: Vec<[f64; 2]> = {
                let column = |name: &str| motion.column(name).unwrap().values();
                column("puck_x")
                    .zip(column("puck_y"))
                    .map(Into::into)
                    .collect()
            };
            for contact in &motion.header.contacts {
                let step = (contact.t / motion.header.step_s).floor() as usize;
                for [x, y] in positions[step..=step + 1].iter() {
                    let distance = (x - contact.x).hypot(y - contact.y);
                    assert!(
                        distance < 0.1,
                        "{task} {episode}: {contact:?} is {distance} m from a neighbouring sample"
                    );
                }
                if contact.body == ContactWith::Rim {
                    // The rims are at |y| = 0.52 m and |x| = 0.97 m; the puck's radius is 0.03 m.
                    let is_near_rim = contact.y.abs() > 0.45 || contact.x.abs() > 0.9;
                    assert!(is_near_rim, "{contact:?}");
                }
                bodies.push(contact.body);
            }
            assert!(motion.header.contacts.is_sorted_by(|a, b| a.t <= b.t));
        }
    }
    assert!(bodies.contains(&ContactWith::Rim), "{bodies:?}");
    assert!(bodies.contains(&ContactWith::Mallet), "{bodies:?}");
}

#[test]
fn clip_index_matches_the_dataset_for_each_episode() {
    let fixture = fixture("clips");
    let index = fixture.pack.clip_index().unwrap();
    let outcomes: Vec<_> = fixture
        .evaluation
        .reports
        .iter()
        .flat_map(|report| &report.outcomes)
        .collect();
    assert_eq!(index.episodes.len(), outcomes.len());
    let violations = fixture.dataset.violations().unwrap();
    let mut compared = 0;
    for outcome in &outcomes {
        let summary = index.summary(outcome.task, outcome.episode).unwrap();
        assert_eq!(
            (summary.steps, summary.success, summary.end),
            (outcome.steps, outcome.success, outcome.end)
        );
        assert!(!summary.end_description.is_empty());
        let motion = clip(
            &fixture.pack,
            ClipKey::motion(outcome.task, outcome.episode),
        );
        assert_eq!(
            motion.header.end.unwrap().description,
            summary.end_description
        );
        let task_violations = &violations.tasks[&outcome.task];
        for name in [EE, LINK, JOINT_POS, JOINT_VEL] {
            let recorded = task_violations.constraints[&name]
                .iter()
                .find(|violation| violation.episode == outcome.episode);
            let found = summary
                .violations
                .iter()
                .find(|violation| violation.constraint == name);
            match (recorded, found) {
                (None, None) => {}
                (Some(recorded), Some(found)) => {
                    assert_eq!(found.from, recorded.first_step + 1);
                    assert_eq!(found.samples, recorded.steps);
                    assert_eq!(found.max_excess, recorded.max);
                    compared += 1;
                }
                (recorded, found) => panic!("{name}: {recorded:?} but {found:?}"),
            }
        }
    }
    assert!(compared > 0, "no violation in the recording");
    for (task, times) in &index.times {
        let steps: u32 = outcomes
            .iter()
            .filter(|outcome| outcome.task == *task)
            .map(|outcome| outcome.steps)
            .sum();
        let counted: u64 = times.bins().map(|(_, _, count)| count).sum();
        assert_eq!(counted, u64::from(steps), "{task}");
    }
}

#[test]
fn clips_are_at_most_a_quarter_of_the_dataset_size() {
    let fixture = fixture("clips");
    let dataset_bytes = std::fs::metadata(fixture.evaluation.archive())
        .unwrap()
        .len();
    let clips_bytes = std::fs::metadata(&fixture.clips).unwrap().len();
    assert!(
        4 * clips_bytes <= dataset_bytes,
        "clips {clips_bytes} bytes, dataset {dataset_bytes}"
    );
}

#[test]
fn clips_are_the_same_bytes_for_any_order_of_shards() {
    let mut fixture = fixture("clips");
    let second_pack = fixture.evaluation.dir.path().join("again");
    fixture.evaluation.shards.reverse();
    assemble(
        &fixture.evaluation.meta,
        &fixture.evaluation.shards,
        &fixture.evaluation.archive(),
        Some(&second_pack),
        simulator().as_ref(),
    )
    .unwrap();
    assert!(std::fs::read(&fixture.clips).unwrap() == std::fs::read(second_pack).unwrap());
}

#[test]
fn truncated_or_overwritten_pack_is_refused() {
    let fixture = fixture("clips");
    let bytes = std::fs::read(&fixture.clips).unwrap();
    let path = fixture.evaluation.dir.path().join("damaged");
    let opening_error = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Pack::open(&path).err().map(|error| error.to_string())
    };
    for length in [0, 10, 31, bytes.len() / 2, bytes.len() - 1] {
        let message = opening_error(&bytes[..length]).expect("it is cut off");
        assert!(message.contains("cut off"), "{message}");
    }
    let mut other = bytes.clone();
    other[0] ^= 1;
    assert!(
        opening_error(&other)
            .unwrap()
            .contains("it is not a pack of clips")
    );
    // The offset of the last clip, in the last 12 bytes of the index. A footer of 16 bytes follows the index.
    let mut other = bytes.clone();
    let offset_field = bytes.len() - 16 - 12;
    other[offset_field + 4] = 0xff;
    assert!(opening_error(&other).unwrap().contains("index is damaged"));
    assert!(opening_error(&bytes).is_none());
    // The first clip begins after the 16 bytes that identify a pack. A clip of zeros is refused.
    let mut other = bytes.clone();
    other[16..80].fill(0);
    std::fs::write(&path, &other).unwrap();
    let pack = Pack::open(&path).unwrap();
    let first = pack.clip(ClipKey::motion(HIT, 0)).unwrap().unwrap();
    let message = Clip::read(&first).unwrap_err().to_string();
    assert!(message.contains("is not a clip"), "{message}");
}

#[test]
fn shards_of_the_previous_layout_have_no_clips() {
    let evaluation = Evaluation::play(Some(swing_arm), &[(PREPARE, 0..2)]);
    let shard = &evaluation.shards[0];
    std::fs::remove_file(shard.join("clips")).unwrap();
    let path = shard.join("shard.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let mut file: serde_json::Value = serde_json::from_str(&text).unwrap();
    file["schema"] = "faceoff-shard/4".into();
    file["files"].as_object_mut().unwrap().remove("clips");
    std::fs::write(&path, file.to_string()).unwrap();
    let clips = evaluation.dir.path().join("clips");
    let assembled = assemble(
        &evaluation.meta,
        &evaluation.shards,
        &evaluation.archive(),
        Some(&clips),
        simulator().as_ref(),
    )
    .unwrap();
    assert!(!assembled.has_clips);
    assert!(!clips.exists());
}
