//! What replays are drawn from, against the dataset that was recorded with it.

use crate::played::{Evaluation, moving};
use arrow_array::{Array, Int64Array, cast::AsArray, types::Float64Type};
use faceoff_dataset::{Dataset, assemble};
use faceoff_replay::{Clip, ContactWith, Group, Key, Pack};
use faceoff_types::Task;
use std::path::PathBuf;

const SHARDS: [(Task, std::ops::Range<u32>); 4] = [
    (Task::Hit, 0..2),
    (Task::Defend, 0..3),
    (Task::Defend, 3..6),
    (Task::Prepare, 0..2),
];

struct Made {
    evaluation: Evaluation,
    dataset: Dataset,
    clips: PathBuf,
    pack: Pack,
}

fn made(name: &str) -> Made {
    let evaluation = Evaluation::play(Some(moving), &SHARDS);
    let clips = evaluation.dir.path().join(name);
    let archive = evaluation.archive();
    let made = assemble(&evaluation.meta, &evaluation.shards, &archive, Some(&clips));
    assert!(made.unwrap().clips);
    Made {
        dataset: Dataset::open(&archive).unwrap(),
        pack: Pack::open(&clips).unwrap(),
        evaluation,
        clips,
    }
}

fn clip(pack: &Pack, key: Key) -> Clip {
    Clip::read(&pack.clip(key).unwrap().expect("the clip is there")).unwrap()
}

#[test]
fn samples_are_the_datasets_to_their_resolution() {
    let made = made("clips");
    for report in &made.evaluation.reports {
        for outcome in &report.outcomes {
            let (task, episode) = (outcome.task, outcome.episode);
            let rows = made.dataset.episode(task, episode, None).unwrap();
            let motion = clip(&made.pack, Key::motion(task, episode));
            let observed = clip(&made.pack, Key::observed(task, episode));
            assert_eq!(motion.header.samples, outcome.steps + 1);
            assert_eq!(motion.column("opponent_q_1").is_some(), task == Task::Hit);
            let mut compared = 0;
            let float = |name: &str| rows[name].as_primitive::<Float64Type>().values().to_vec();
            for column in motion.columns.iter().chain(&observed.columns) {
                let name = column.name.as_str();
                let (expected, skip): (Vec<f64>, usize) = match name {
                    // What the agent was told before each step; the last one follows the last step.
                    "seen_x" => (float("obs_puck_x").iter().map(|x| x - 1.51).collect(), 0),
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
                        let asked = (0..actions.len()).map(|row| {
                            actions
                                .value(row)
                                .as_primitive::<Float64Type>()
                                .value(joint - 1)
                        });
                        (asked.collect(), 0)
                    }
                    // The states after the steps, behind the initial one.
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
fn contacts_lie_on_the_way_between_the_samples() {
    let made = made("clips");
    let mut with = Vec::new();
    for (task, range) in SHARDS {
        for episode in range {
            let motion = clip(&made.pack, Key::motion(task, episode));
            let places: Vec<[f64; 2]> = {
                let column = |name: &str| motion.column(name).unwrap().values();
                column("puck_x")
                    .zip(column("puck_y"))
                    .map(Into::into)
                    .collect()
            };
            for contact in &motion.header.contacts {
                let step = (contact.t / motion.header.step_s).floor() as usize;
                for [x, y] in places[step..=step + 1].iter() {
                    let distance = (x - contact.x).hypot(y - contact.y);
                    assert!(
                        distance < 0.1,
                        "{task} {episode}: {contact:?} is {distance} m from a sample beside it"
                    );
                }
                if contact.what == ContactWith::Rim {
                    let at_rim = contact.y.abs() > 0.45 || contact.x.abs() > 0.9;
                    assert!(at_rim, "{contact:?}");
                }
                with.push(contact.what);
            }
            assert!(motion.header.contacts.is_sorted_by(|a, b| a.t <= b.t));
        }
    }
    assert!(with.contains(&ContactWith::Rim), "{with:?}");
    assert!(with.contains(&ContactWith::Mallet), "{with:?}");
}

#[test]
fn the_sheet_has_a_line_for_each_episode_that_says_what_the_dataset_says() {
    let made = made("clips");
    let sheet = made.pack.clip_index().unwrap();
    let outcomes: Vec<_> = made
        .evaluation
        .reports
        .iter()
        .flat_map(|report| &report.outcomes)
        .collect();
    assert_eq!(sheet.episodes.len(), outcomes.len());
    let violations = made.dataset.violations().unwrap();
    let mut broken = 0;
    for outcome in &outcomes {
        let line = sheet.line(outcome.task, outcome.episode).unwrap();
        assert_eq!(
            (line.steps, line.success, line.end),
            (outcome.steps, outcome.success, outcome.end)
        );
        assert!(!line.why.is_empty());
        let motion = clip(&made.pack, Key::motion(outcome.task, outcome.episode));
        assert_eq!(motion.header.end.unwrap().why, line.why);
        let of_task = &violations.tasks[&outcome.task];
        for (group, recorded) in [
            (Group::Ee, &of_task.ee),
            (Group::Link, &of_task.link),
            (Group::JointPos, &of_task.joint_pos),
            (Group::JointVel, &of_task.joint_vel),
        ] {
            let recorded = recorded.iter().find(|one| one.episode == outcome.episode);
            let told = line.broken.iter().find(|broken| broken.group == group);
            match (recorded, told) {
                (None, None) => {}
                (Some(recorded), Some(told)) => {
                    assert_eq!(told.from, recorded.first_step + 1);
                    assert_eq!(told.samples, recorded.steps);
                    assert_eq!(told.worst, recorded.max);
                    broken += 1;
                }
                (recorded, told) => panic!("{group:?}: {recorded:?} but {told:?}"),
            }
        }
    }
    assert!(broken > 0, "something was broken");
    for (task, times) in &sheet.times {
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
fn clips_take_at_most_a_quarter_of_the_dataset() {
    let made = made("clips");
    let of_dataset = std::fs::metadata(made.evaluation.archive()).unwrap().len();
    let of_clips = std::fs::metadata(&made.clips).unwrap().len();
    assert!(
        4 * of_clips <= of_dataset,
        "clips {of_clips} bytes, dataset {of_dataset}"
    );
}

#[test]
fn the_same_shards_give_the_same_bytes_in_any_order() {
    let mut made = made("clips");
    let again = made.evaluation.dir.path().join("again");
    made.evaluation.shards.reverse();
    assemble(
        &made.evaluation.meta,
        &made.evaluation.shards,
        &made.evaluation.archive(),
        Some(&again),
    )
    .unwrap();
    assert!(std::fs::read(&made.clips).unwrap() == std::fs::read(again).unwrap());
}

#[test]
fn a_pack_that_is_cut_or_overwritten_is_refused() {
    let made = made("clips");
    let bytes = std::fs::read(&made.clips).unwrap();
    let path = made.evaluation.dir.path().join("damaged");
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Pack::open(&path).err().map(|error| error.to_string())
    };
    for length in [0, 10, 31, bytes.len() / 2, bytes.len() - 1] {
        let why = refused(&bytes[..length]).expect("it is cut off");
        assert!(why.contains("cut off"), "{why}");
    }
    let mut other = bytes.clone();
    other[0] ^= 1;
    assert!(refused(&other).unwrap().contains("does not begin as one"));
    // The last clip's place, in the index.
    let mut other = bytes.clone();
    let place = bytes.len() - 16 - 12;
    other[place + 4] = 0xff;
    assert!(refused(&other).unwrap().contains("index is damaged"));
    assert!(refused(&bytes).is_none());
    // A clip of zeros is no clip.
    let mut other = bytes.clone();
    other[16..80].fill(0);
    std::fs::write(&path, &other).unwrap();
    let pack = Pack::open(&path).unwrap();
    let first = pack.clip(Key::motion(Task::Hit, 0)).unwrap().unwrap();
    let why = Clip::read(&first).unwrap_err().to_string();
    assert!(why.contains("is no clip"), "{why}");
}

#[test]
fn shards_of_the_layout_before_are_joined_without_clips() {
    let evaluation = Evaluation::play(Some(moving), &[(Task::Prepare, 0..2)]);
    let shard = &evaluation.shards[0];
    std::fs::remove_file(shard.join("clips")).unwrap();
    let path = shard.join("shard.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let mut file: serde_json::Value = serde_json::from_str(&text).unwrap();
    file["schema"] = "faceoff-shard/4".into();
    file["files"].as_object_mut().unwrap().remove("clips");
    std::fs::write(&path, file.to_string()).unwrap();
    let clips = evaluation.dir.path().join("clips");
    let made = assemble(
        &evaluation.meta,
        &evaluation.shards,
        &evaluation.archive(),
        Some(&clips),
    )
    .unwrap();
    assert!(!made.clips);
    assert!(!clips.exists());
}
