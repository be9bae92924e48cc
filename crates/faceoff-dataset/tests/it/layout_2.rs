//! What the version before left, commit e67a08c: its archives are read, and its shards joined.

use crate::{
    played::{Evaluation, fixture, play, spec, table},
    verify::check,
};
use arrow_array::{RecordBatch, cast::AsArray, types::Int64Type};
use faceoff_dataset::{Dataset, DatasetError, Layout};
use faceoff_types::Task;
use faceoff_wire::job::ShardSpec;
use parquet::{
    basic::Encoding,
    file::reader::{FileReader, SerializedFileReader},
};
use std::{fs, path::Path};

const ARCHIVE: &str = "dataset-layout-2.zip";

#[test]
fn an_archive_is_read_and_verified() {
    let dataset = Dataset::open(&fixture(ARCHIVE)).unwrap();
    assert_eq!(dataset.layout(), Layout::Two);
    let verified = check(&fixture(ARCHIVE), 2).unwrap();
    assert_eq!((verified.episodes, verified.steps), (4, 548));
    assert_eq!(verified.result, dataset.results().unwrap());

    let episodes = dataset.episodes().unwrap();
    let steps: Vec<_> = episodes
        .iter()
        .map(|record| {
            (
                record.outcome.task,
                record.outcome.episode,
                record.outcome.steps,
            )
        })
        .collect();
    let (hit, defend) = (Task::Hit, Task::Defend);
    assert_eq!(
        steps,
        [
            (hit, 0, 134),
            (hit, 1, 185),
            (defend, 0, 176),
            (defend, 1, 53)
        ]
    );
    let lazily = Dataset::open_unread(&fixture(ARCHIVE)).unwrap();
    for (task, episode, steps) in steps {
        let rows = lazily.episode(task, episode, None).unwrap();
        assert_eq!(rows.num_rows(), steps as usize);
    }
}

#[test]
fn a_broken_seal_is_refused() {
    let good = fs::read(fixture(ARCHIVE)).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("dataset.zip");
    let tail = good.len() - 2048;
    let places = (0..128)
        .chain((128..tail).step_by(tail / 200))
        .chain(tail..good.len());
    let flipped = places.map(|at| {
        let mut bytes = good.clone();
        bytes[at] ^= 1 << (at % 8);
        bytes
    });
    let cut = [0, good.len() / 2, good.len() - 1].map(|length| good[..length].to_vec());
    let longer = [&good[..], b"x"].concat();
    for (index, bytes) in flipped.chain(cut).chain([longer]).enumerate() {
        fs::write(&path, bytes).unwrap();
        let opened = Dataset::open(&path);
        assert!(
            matches!(
                opened,
                Err(DatasetError::Altered(_) | DatasetError::Unreadable(_))
            ),
            "{index}: {opened:?}"
        );
    }
    fs::write(&path, &good).unwrap();
    Dataset::open(&path).unwrap();
}

#[test]
fn a_shard_of_an_evaluation_under_way_is_joined() {
    let old = fixture("shard-layout-2");
    let text = fs::read(old.join("shard.json")).unwrap();
    let file: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let played: ShardSpec = serde_json::from_value(file["spec"].clone()).unwrap();
    let mut evaluation = Evaluation::play(None, &[]);
    evaluation.meta.ruleset = played.ruleset;
    evaluation.meta.profile = played.profile;
    evaluation.meta.seed = played.seed;
    evaluation.meta.mismatch_seed = played.mismatch_seed;

    // One more shard, played by this version.
    let next = evaluation.dir.path().join("next");
    let further = ShardSpec {
        episodes: played.episodes.end..played.episodes.end + 1,
        ..played.clone()
    };
    assert_eq!(further.task, spec(Task::Defend, 0..1).task);
    play(&further, Some(crate::played::holding), &next);
    evaluation.shards = vec![old.clone(), next.clone()];
    let evaluation = evaluation.assembled();

    assert_eq!(check(&evaluation.archive(), 2).unwrap().episodes, 3);
    let steps = evaluation.folder().join("steps.parquet");
    let joined = table(&steps);
    let (first, second) = (
        table(&old.join("steps.parquet")),
        table(&next.join("steps.parquet")),
    );
    let rows = first.num_rows();
    // The host's time was not told apart then.
    let mut old_columns = columns(&joined.slice(0, rows));
    let (_, host_times) = old_columns.remove(
        old_columns
            .iter()
            .position(|(name, _)| name == "host_time_ns")
            .unwrap(),
    );
    assert!(
        host_times
            .as_primitive::<Int64Type>()
            .iter()
            .all(|time| time == Some(0))
    );
    assert_eq!(old_columns, columns(&first));
    assert_eq!(
        columns(&joined.slice(rows, second.num_rows())),
        columns(&second)
    );
    only_floats_are_split_by_bytes(&steps);
}

/// By name; nullability and metadata apart.
fn columns(batch: &RecordBatch) -> Vec<(String, arrow_array::ArrayRef)> {
    let schema = batch.schema();
    let names = schema.fields().iter().map(|field| field.name().clone());
    names.zip(batch.columns().iter().cloned()).collect()
}

/// DuckDB and pyarrow 15 cannot read integers that are.
fn only_floats_are_split_by_bytes(path: &Path) {
    let reader = SerializedFileReader::new(fs::File::open(path).unwrap()).unwrap();
    for group in reader.metadata().row_groups() {
        for column in group.columns() {
            let split = column.encodings().any(|e| e == Encoding::BYTE_STREAM_SPLIT);
            let float = column.column_type() == parquet::basic::Type::DOUBLE;
            assert_eq!(split, float, "{}", column.column_path());
        }
    }
}
