//! A server that is killed repeatedly with `kill -9`: the dataset equals that of an undisturbed run. The server runs an
//! evaluation in *shards* (jobs of some episodes) and commits each shard's results to its database. The moments of the kills
//! are drawn in advance and counted in entries of the server's log, so they are the same on quick and slow machines.

use crate::{Team, without_times};
use arrow_array::RecordBatch;
use bytes::Bytes;
use faceoff_tests::{
    bundle::{self, copy_folder},
    server::Server,
};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;
use std::{
    collections::BTreeSet,
    io::{Cursor, Read as _},
    time::{Duration, Instant},
};

/// Episodes per task. The shards of three tasks outnumber [`KILLS`]; each server process commits at most one shard.
const EPISODES: u32 = 10;
/// One episode per shard: many commits for the kills to hit.
const CONFIG: &str = concat!(
    include_str!("../long_time_limits.toml"),
    r#"
[evaluation]
episodes_per_task = 10
episodes_per_shard = 1
[workers]
slots = 1
"#
);
/// Number of server processes that end with `kill -9`.
const KILLS: u64 = 28;
/// Columns and fields that no run can reproduce.
const NON_REPRODUCIBLE: [&str; 8] = [
    "computation_time_ns",
    "host_time_ns",
    "cpu_time_ns",
    "computation_time_mean_s",
    "computation_time_max_s",
    "times_blake3",
    "host_noise_reruns",
    // they include computation time; `results.json` has the counts of the other violations
    "penalty_points",
];

/// The random number with this index, uniform in [0, 1). The generator is SplitMix64.
pub(crate) fn draw(index: u64) -> f64 {
    let mut x = index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// When a server process is killed.
#[derive(Debug, Clone, Copy)]
enum KillMoment {
    /// This many log entries later: after the start of the process, or after the event of another variant.
    AfterEntries(u32),
    /// This many log entries after a shard was started: while it runs or is committed.
    AfterStart(u32),
    /// Some time after a shard was started.
    DuringShard,
    /// This many log entries after a shard was committed.
    AfterCommit(u32),
}

impl KillMoment {
    /// The moment for the server process with this number.
    fn draw(process: u64) -> Self {
        // A server's start logs about 30 entries, a shard 6 until it starts and 8 until it is committed. The server may be
        // ahead of the test by the entries that the pipe between them holds: about 7.
        let entries_below = |limit: u32| (f64::from(limit) * draw(process)) as u32;
        match process % 4 {
            0 => Self::AfterCommit(entries_below(5)),
            1 => Self::AfterStart(entries_below(13)),
            2 => Self::DuringShard,
            _ => Self::AfterEntries(entries_below(45)),
        }
    }

    /// Whether this entry of the log is the moment. Must be called for each entry, in order, because it counts them.
    fn is_reached(&mut self, event: &Event) -> bool {
        *self = match (*self, event) {
            (Self::AfterEntries(0), _) | (Self::DuringShard, Event::Started(_)) => return true,
            (Self::AfterEntries(entries), _) => Self::AfterEntries(entries - 1),
            (Self::AfterStart(entries), Event::Started(_))
            | (Self::AfterCommit(entries), Event::Committed(_)) => Self::AfterEntries(entries),
            (unchanged, _) => unchanged,
        };
        false
    }
}

/// An entry of the server's log, as far as it concerns shards.
enum Event {
    /// A shard with this description has started.
    Started(String),
    /// The results of a shard with this description are in the database.
    Committed(String),
    /// Another entry, mostly a statement of the database.
    Other,
}

impl Event {
    /// # Panics
    /// If all shards are complete and the evaluation is being scored: later kills would test nothing.
    fn parse(entry: &Value) -> Self {
        let text = |field: &str| entry["fields"][field].as_str().unwrap_or_default();
        let description = text("description");
        assert!(
            !description.starts_with("scoring"),
            "the run has ended too early"
        );
        match text("message") {
            "started" => Self::Started(description.to_owned()),
            "committed" => Self::Committed(description.to_owned()),
            _ => Self::Other,
        }
    }
}

/// The zip archive of a dataset.
pub(crate) type Archive = zip::ZipArchive<Cursor<Vec<u8>>>;

/// Waits until the evaluation is finished. Returns its result and its dataset.
pub(crate) fn wait_for_outcome(server: &Server, team: &Team, evaluation: &str) -> (Value, Archive) {
    let finished = team.wait_until_finished(server, evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    let dataset = server.get(&format!("{evaluation}/dataset"), Some(&team.token));
    assert_eq!(dataset.status(), 200);
    let bytes = dataset.bytes().expect("the download completes").to_vec();
    let archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("a dataset is a zip");
    // The download has released the seed, so the result includes it from now on.
    let finished = team.wait_until_finished(server, evaluation);
    (finished["result"].clone(), archive)
}

fn read_file(archive: &mut Archive, name: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    archive
        .by_name(name)
        .unwrap_or_else(|error| panic!("{name}: {error}"))
        .read_to_end(&mut bytes)
        .expect("an archive can be unpacked");
    bytes
}

/// A table without the columns that no run can reproduce, in batches.
fn table(archive: &mut Archive, name: &str) -> Vec<RecordBatch> {
    let bytes = Bytes::from(read_file(archive, name));
    let reader = ParquetRecordBatchReaderBuilder::try_new(bytes)
        .and_then(|reader| reader.build())
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    let without_non_reproducible = |batch: RecordBatch| {
        let schema = batch.schema();
        let columns: Vec<usize> = (0..batch.num_columns())
            .filter(|column| !NON_REPRODUCIBLE.contains(&schema.field(*column).name().as_str()))
            .collect();
        batch.project(&columns).expect("these columns are there")
    };
    reader
        .map(|batch| {
            without_non_reproducible(batch.unwrap_or_else(|error| panic!("{name}: {error}")))
        })
        .collect()
}

/// A file of a dataset without parts that depend on computation times: the hashes of the other files, and the list of slow
/// episodes.
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

fn row_count(table: &[RecordBatch]) -> usize {
    table.iter().map(RecordBatch::num_rows).sum()
}

/// Asserts that two runs from the same data folder have equal scores and datasets, without non-reproducible parts.
/// Returns the number of episodes.
pub(crate) fn assert_same(
    (result, mut dataset): (Value, Archive),
    (expected, mut expected_dataset): (Value, Archive),
) -> usize {
    assert_eq!(without_times(&result), without_times(&expected));
    for name in ["episodes.parquet", "steps.parquet"] {
        let (one, other) = (
            table(&mut dataset, name),
            table(&mut expected_dataset, name),
        );
        assert_eq!(row_count(&one), row_count(&other), "{name}");
        assert_eq!(differing_columns(&one, &other), [""; 0], "{name}");
    }
    let episodes = table(&mut dataset, "episodes.parquet");
    // The logs are equal: the agent got no fault.
    assert_eq!(
        String::from_utf8_lossy(&read_file(&mut dataset, "agent.log")),
        String::from_utf8_lossy(&read_file(&mut expected_dataset, "agent.log")),
    );
    for name in ["manifest.json", "violations.json"] {
        let [one, other] = [&mut dataset, &mut expected_dataset].map(|dataset| {
            let file = read_file(dataset, name);
            without_slow_episodes(serde_json::from_slice(&file).expect("it is JSON"))
        });
        assert_eq!(one, other, "{name}");
    }
    row_count(&episodes)
}

#[test]
fn repeatedly_killed_server_ends_run_like_undisturbed_one() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let [killed_data, undisturbed_data] =
        ["killed", "undisturbed"].map(|name| scratch.path().join(name));
    let striker = bundle::example_agent("striker", scratch.path());

    // Two servers with copies of one data folder: the same season secret, day, team and evaluation.
    let server = Server::start(&killed_data, CONFIG);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &striker);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = team.evaluate(&server, &submission);
    server.kill();
    copy_folder(&killed_data, &undisturbed_data);

    let started = Instant::now();
    let server = Server::start(&undisturbed_data, CONFIG);
    let expected = wait_for_outcome(&server, &team, &evaluation);
    server.kill();
    let time_per_episode = started.elapsed() / (3 * EPISODES);

    let mut committed = BTreeSet::new();
    for process in 0..KILLS {
        let mut moment = KillMoment::draw(process);
        let pause = match moment {
            // Mostly before the end of the episode, whose duration the undisturbed run has measured.
            KillMoment::DuringShard => time_per_episode.mul_f64(1.2 * draw(process)),
            _ => Duration::ZERO,
        };
        let is_reached = |entry: &Value| {
            let event = Event::parse(entry);
            match &event {
                Event::Started(shard) => assert!(
                    !committed.contains(shard),
                    "process {process} repeats {shard}, which was committed"
                ),
                Event::Committed(shard) => drop(committed.insert(shard.clone())),
                Event::Other => {}
            }
            moment.is_reached(&event)
        };
        Server::start_and_kill(&killed_data, CONFIG, is_reached, pause);
    }
    // Every fourth process lasts until a commit.
    assert!(committed.len() as u64 >= KILLS / 4, "{committed:?}");
    let server = Server::start(&killed_data, CONFIG);
    let episodes = assert_same(wait_for_outcome(&server, &team, &evaluation), expected);
    assert_eq!(episodes, 3 * EPISODES as usize);
}
