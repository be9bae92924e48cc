//! `kill -9` again and again, at moments drawn in advance: the dataset is the one of a run that nobody
//! disturbed.

use crate::{Team, without_times};
use arrow_array::RecordBatch;
use bytes::Bytes;
use faceoff_tests::{bundle, server::Server};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;
use std::{
    fs,
    io::{Cursor, Read as _},
    path::Path,
    thread,
    time::{Duration, Instant},
};

const EPISODES: u32 = 8;
/// One episode per shard: many commits for the kills to hit.
const CONFIG: &str = r#"
[evaluation]
episodes_per_task = 8
episodes_per_shard = 1
[workers]
slots = 1
"#;
/// A server's lives that end with `kill -9`.
const KILLS: u64 = 28;
/// What no run can repeat.
const TIMES: [&str; 7] = [
    "computation_time_ns",
    "cpu_time_ns",
    "computation_time_mean_s",
    "computation_time_max_s",
    "times_blake3",
    "host_noise_reruns",
    // of which computation time is a part; `results.json` has the counts of the others
    "penalty_points",
];

/// The n-th draw, uniform in [0, 1): SplitMix64.
fn draw(n: u64) -> f64 {
    let mut x = n.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a scratch folder can be made");
    for entry in fs::read_dir(from).expect("a folder can be read") {
        let entry = entry.expect("a folder can be read");
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            copy_folder(&from, &to);
        } else {
            fs::copy(&from, &to).expect("a scratch file can be copied");
        }
    }
}

type Archive = zip::ZipArchive<Cursor<Vec<u8>>>;

/// Waits for the score and downloads the dataset.
fn outcome(server: &Server, team: &Team, evaluation: &str) -> (Value, Archive) {
    let finished = team.finished(server, evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    let dataset = server.get(&format!("{evaluation}/dataset"), Some(&team.token));
    assert_eq!(dataset.status(), 200);
    let bytes = dataset.bytes().expect("the download completes").to_vec();
    let archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("a dataset is a zip");
    // again: with the dataset the seed is released
    let finished = team.finished(server, evaluation);
    (finished["result"].clone(), archive)
}

fn file(archive: &mut Archive, name: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    archive
        .by_name(name)
        .unwrap_or_else(|error| panic!("{name}: {error}"))
        .read_to_end(&mut bytes)
        .expect("an archive can be unpacked");
    bytes
}

/// A table without the columns that no run can repeat, in parts.
fn table(archive: &mut Archive, name: &str) -> Vec<RecordBatch> {
    let bytes = Bytes::from(file(archive, name));
    let reader = ParquetRecordBatchReaderBuilder::try_new(bytes)
        .and_then(|reader| reader.build())
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    let part = |batch: RecordBatch| {
        let schema = batch.schema();
        let kept: Vec<usize> = (0..batch.num_columns())
            .filter(|column| !TIMES.contains(&schema.field(*column).name().as_str()))
            .collect();
        batch.project(&kept).expect("these columns are there")
    };
    reader
        .map(|batch| part(batch.unwrap_or_else(|error| panic!("{name}: {error}"))))
        .collect()
}

/// A file of a dataset without what follows from computation times: the other files' hashes, and the
/// list of slow episodes.
fn without_slow_episodes(mut file: Value) -> Value {
    if let Some(fields) = file.as_object_mut() {
        fields.remove("files");
    }
    if let Some(tasks) = file.get_mut("tasks").and_then(Value::as_object_mut) {
        for task in tasks.values_mut().filter_map(Value::as_object_mut) {
            task.remove("computation_time");
        }
    }
    file
}

/// The names of the columns in which two tables of the same length differ.
fn differing_columns(one: &[RecordBatch], other: &[RecordBatch]) -> Vec<String> {
    let names = |table: &[RecordBatch]| {
        let schema = table.first().expect("a table has rows").schema();
        schema
            .fields()
            .iter()
            .map(|field| field.name().clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(names(one), names(other));
    let mut differing = names(one);
    differing.retain(|name| {
        one.iter()
            .zip(other)
            .any(|(one, other)| one.column_by_name(name) != other.column_by_name(name))
    });
    differing
}

fn rows(table: &[RecordBatch]) -> usize {
    table.iter().map(RecordBatch::num_rows).sum()
}

#[test]
fn killed_at_any_moment_a_run_ends_as_an_undisturbed_one() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (killed, undisturbed) = (scratch.path().join("killed"), scratch.path().join("calm"));
    let striker = bundle::reference("striker", scratch.path());

    // Two servers with one past: the same season secret, day, team and evaluation.
    let server = Server::start(&killed, CONFIG);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &striker);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = team.evaluate(&server, &submission);
    server.kill();
    copy_folder(&killed, &undisturbed);

    let started = Instant::now();
    let server = Server::start(&undisturbed, CONFIG);
    let (expected, mut expected_dataset) = outcome(&server, &team, &evaluation);
    server.kill();
    let per_episode = started.elapsed() / (3 * EPISODES);

    // Less than one episode on average, so that the run outlasts all kills on a fast and a slow machine.
    // Every fourth is killed while it starts.
    let mut done = 0;
    for life in 0..KILLS {
        let lifetime = per_episode.mul_f64(1.5 * draw(life));
        if life % 4 == 3 {
            Server::start_and_kill(&killed, CONFIG, lifetime.min(Duration::from_millis(200)));
            continue;
        }
        let server = Server::start(&killed, CONFIG);
        let before: Value = server
            .get(&evaluation, Some(&team.token))
            .json()
            .expect("the API speaks JSON");
        let episodes = before["progress"]["episodes_done"]
            .as_u64()
            .unwrap_or_else(|| panic!("life {life}: the run is over too early: {before:#}"));
        assert!(episodes >= done, "life {life} lost episodes: {before:#}");
        done = episodes;
        // Not to wait for something: this is the moment that was drawn.
        thread::sleep(lifetime);
        server.kill();
    }
    assert!(done > 0, "no life was long enough for an episode");
    let server = Server::start(&killed, CONFIG);
    let (result, mut dataset) = outcome(&server, &team, &evaluation);

    assert_eq!(without_times(&result), without_times(&expected));
    for name in ["episodes.parquet", "steps.parquet"] {
        let (one, other) = (
            table(&mut dataset, name),
            table(&mut expected_dataset, name),
        );
        assert_eq!(rows(&one), rows(&other), "{name}");
        assert_eq!(differing_columns(&one, &other), [""; 0], "{name}");
    }
    let episodes = table(&mut dataset, "episodes.parquet");
    assert_eq!(rows(&episodes), 3 * EPISODES as usize);
    // No fault in it: nothing was blamed on the agent.
    assert_eq!(
        String::from_utf8_lossy(&file(&mut dataset, "agent.log")),
        String::from_utf8_lossy(&file(&mut expected_dataset, "agent.log")),
    );
    for name in ["manifest.json", "violations.json"] {
        let [one, other] = [&mut dataset, &mut expected_dataset].map(|dataset| {
            let file = file(dataset, name);
            without_slow_episodes(serde_json::from_slice(&file).expect("it is JSON"))
        });
        assert_eq!(one, other, "{name}");
    }
}
