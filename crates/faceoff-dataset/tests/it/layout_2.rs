//! Tests that recordings in layout 2 of earlier versions (written by commit e67a08c) are read, verified and joined.

use crate::{
    recordings::{Evaluation, fixture, play, spec, table},
    verify::check,
};
use arrow_array::{RecordBatch, cast::AsArray, types::Int64Type};
use faceoff_airhockey::{DEFEND, HIT, simulator};
use faceoff_dataset::{Dataset, DatasetError, Layout};
use faceoff_wire::job::ShardSpec;
use parquet::{
    basic::Encoding,
    file::reader::{FileReader, SerializedFileReader},
};
use std::{fs, path::Path};

const ARCHIVE: &str = "dataset-layout-2.zip";

#[test]
fn archive_is_read_and_verified() {
    let dataset = Dataset::open(&fixture(ARCHIVE), simulator().competition()).unwrap();
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
    let (hit, defend) = (HIT, DEFEND);
    assert_eq!(
        steps,
        [
            (hit, 0, 134),
            (hit, 1, 185),
            (defend, 0, 176),
            (defend, 1, 53)
        ]
    );
    let lazy_dataset = Dataset::open_lazily(&fixture(ARCHIVE), simulator().competition()).unwrap();
    for (task, episode, steps) in steps {
        let rows = lazy_dataset.episode(task, episode, None).unwrap();
        assert_eq!(rows.num_rows(), steps as usize);
    }
}

#[test]
fn broken_seal_is_refused() {
    let intact = fs::read(fixture(ARCHIVE)).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("dataset.zip");
    // Every byte at both ends, where the archive's structure is, and some of the rest.
    let tail = intact.len() - 2048;
    let offsets = (0..128)
        .chain((128..tail).step_by(tail / 200))
        .chain(tail..intact.len());
    let flipped = offsets.map(|offset| {
        let mut bytes = intact.clone();
        bytes[offset] ^= 1 << (offset % 8);
        bytes
    });
    let truncated = [0, intact.len() / 2, intact.len() - 1].map(|length| intact[..length].to_vec());
    let longer = [&intact[..], b"x"].concat();
    for (index, bytes) in flipped.chain(truncated).chain([longer]).enumerate() {
        fs::write(&path, bytes).unwrap();
        let opened = Dataset::open(&path, simulator().competition());
        assert!(
            matches!(
                opened,
                Err(DatasetError::Altered(_) | DatasetError::Unreadable(_))
            ),
            "{index}: {opened:?}"
        );
    }
    fs::write(&path, &intact).unwrap();
    Dataset::open(&path, simulator().competition()).unwrap();
}

#[test]
fn shard_of_a_running_evaluation_is_joined() {
    let old = fixture("shard-layout-2");
    let text = fs::read(old.join("shard.json")).unwrap();
    let file: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let played: ShardSpec = serde_json::from_value(file["spec"].clone()).unwrap();
    let mut evaluation = Evaluation::play(None, &[]);
    evaluation.meta.ruleset = played.ruleset;
    evaluation.meta.profile = played.profile;
    evaluation.meta.seed = played.seed;
    evaluation.meta.mismatch_seed = played.mismatch_seed;

    // One more shard, recorded by this version.
    let next = evaluation.dir.path().join("next");
    let next_spec = ShardSpec {
        episodes: played.episodes.end..played.episodes.end + 1,
        ..played.clone()
    };
    assert_eq!(next_spec.task, spec(DEFEND, 0..1).task);
    play(&next_spec, Some(crate::recordings::hold_still), &next);
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
    // Layout 2 did not record host interference.
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
    assert_only_floats_are_split_by_bytes(&steps);
}

/// Columns by name, without nullability and metadata.
fn columns(batch: &RecordBatch) -> Vec<(String, arrow_array::ArrayRef)> {
    let schema = batch.schema();
    let names = schema.fields().iter().map(|field| field.name().clone());
    names.zip(batch.columns().iter().cloned()).collect()
}

/// DuckDB and pyarrow 15 cannot read integers that are split by bytes.
fn assert_only_floats_are_split_by_bytes(path: &Path) {
    let reader = SerializedFileReader::new(fs::File::open(path).unwrap()).unwrap();
    for group in reader.metadata().row_groups() {
        for column in group.columns() {
            let split = column
                .encodings()
                .any(|encoding| encoding == Encoding::BYTE_STREAM_SPLIT);
            let float = column.column_type() == parquet::basic::Type::DOUBLE;
            assert_eq!(split, float, "{}", column.column_path());
        }
    }
}
