//! Tests that reading one episode accesses only a small part of the table.

use super::*;
use crate::table::{ShardTable, StepRows, TableWriter, join};
use bytes::Bytes;
use faceoff_airhockey::{DEFEND, HIT, simulator};
use faceoff_episode::{AnswerTiming, StateColumns, StepRow, World};
use faceoff_types::{EpisodeEnd, Violations};
use parquet::file::reader::Length;
use std::{
    any::Any,
    io::Read,
    path::Path,
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
};

/// A table that records its accesses.
#[derive(Clone)]
struct RecordingTable {
    table: Bytes,
    /// Bytes read so far.
    bytes_read: Arc<AtomicU64>,
    /// Start and end of each access.
    ranges: Arc<Mutex<Vec<(u64, u64)>>>,
}

struct RecordingReader {
    table: RecordingTable,
    position: u64,
}

impl RecordingTable {
    fn new(path: &Path) -> Self {
        Self {
            table: std::fs::read(path).unwrap().into(),
            bytes_read: Arc::default(),
            ranges: Arc::default(),
        }
    }

    fn record(&self, start: u64, bytes: u64) {
        self.bytes_read.fetch_add(bytes, Ordering::Relaxed);
        self.ranges.lock().unwrap().push((start, start + bytes));
    }
}

impl Read for RecordingReader {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let read = self
            .table
            .table
            .slice(self.position as usize..)
            .as_ref()
            .read(out)?;
        self.table.record(self.position, read as u64);
        self.position += read as u64;
        Ok(read)
    }
}

impl Length for RecordingTable {
    fn len(&self) -> u64 {
        self.table.len() as u64
    }
}

impl ChunkReader for RecordingTable {
    type T = RecordingReader;

    fn get_read(&self, start: u64) -> Result<Self::T> {
        Ok(RecordingReader {
            table: self.clone(),
            position: start,
        })
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        self.record(start, length as u64);
        Ok(self.table.slice(start as usize..start as usize + length))
    }
}

/// A world whose numbers rarely repeat, so that they compress as badly as measurements.
struct NoisyWorld {
    /// Observation, state and limits.
    numbers: Vec<f64>,
}

/// Numbers of an observation.
const OBSERVED: usize = 20;
/// Numbers of a state that are in every row.
const STATE: usize = 25;
/// Numbers of a state in episodes with an opponent.
const OPPONENT: usize = 10;

impl NoisyWorld {
    fn new() -> Self {
        let numbers = (0..OBSERVED + STATE + 4).map(|index| f64::from(index as u32));
        let mut world = Self {
            numbers: numbers.collect(),
        };
        world.step(&[]);
        world
    }
}

impl World for NoisyWorld {
    fn steps(&self) -> u32 {
        0
    }
    fn observation(&self) -> &[f64] {
        &self.numbers[..OBSERVED]
    }
    fn step(&mut self, _: &[f64]) -> Option<EpisodeEnd> {
        for number in &mut self.numbers {
            *number = (*number * 1e3 + 0.37).sin();
        }
        None
    }
    fn divergence(&self) -> Option<String> {
        None
    }
    fn success(&self) -> bool {
        false
    }
    fn violations(&self) -> Violations {
        Violations::default()
    }
    fn record_state(&self, columns: &mut dyn StateColumns) {
        columns.put(&self.numbers[OBSERVED..][..STATE]);
        columns.put_absent(OPPONENT);
    }
    fn constraint_values(&self) -> &[f64] {
        &self.numbers[OBSERVED + STATE..]
    }
    fn as_any(&self) -> &dyn Any {
        self
    }
}

/// Writes the step tables of shards with `episodes` episodes of `steps` steps; each becomes a row group.
fn write_shards(dir: &Path, task: Task, shards: u32, episodes: u32, steps: u32) -> Vec<ShardTable> {
    let mut world = NoisyWorld::new();
    (0..shards)
        .map(|shard| {
            let path = dir.join(format!("{task}-{shard}.parquet"));
            let mut rows = StepRows::new(task, &simulator().competition().recording);
            let mut writer = TableWriter::create(&path, rows.schema()).unwrap();
            for episode in shard * episodes..(shard + 1) * episodes {
                rows.begin(episode);
                for step in 0..steps {
                    world.step(&[]);
                    rows.observe(world.observation());
                    rows.push(&StepRow {
                        step,
                        action: &world.numbers[..14],
                        timing: AnswerTiming {
                            computation_time_s: 1e-3,
                            host_time_s: 0.0,
                            cpu_time_s: None,
                        },
                        next_observation: world.observation(),
                        world: &world,
                    });
                }
                writer.write(rows.take()).unwrap();
            }
            writer.finish().unwrap();
            ShardTable::Current(path)
        })
        .collect()
}

fn join_shards(dir: &Path, tables: &[ShardTable]) -> RecordingTable {
    let path = dir.join("joined.parquet");
    join(tables, dir, std::fs::File::create(&path).unwrap()).unwrap();
    RecordingTable::new(&path)
}

#[test]
fn read_accesses_one_row_group_of_many() {
    let dir = tempfile::tempdir().unwrap();
    let mut tables = write_shards(dir.path(), HIT, 40, 2, 60);
    tables.extend(write_shards(dir.path(), DEFEND, 40, 2, 60));
    let table = join_shards(dir.path(), &tables);
    let metadata = ParquetMetaDataReader::new()
        .parse_and_finish(&table)
        .unwrap();
    assert_eq!(metadata.num_row_groups(), 80);
    let bytes_of_group = |group: usize| -> (u64, u64) {
        let columns = metadata.row_group(group).columns().iter();
        let columns = columns.map(|column| column.byte_range());
        columns.fold((u64::MAX, 0), |(start, end), (column, length)| {
            (start.min(column), end.max(column + length))
        })
    };
    table.ranges.lock().unwrap().clear();
    // Two episodes per shard: episode 33 is in the 17th shard of the second task.
    let rows = episode(table.clone(), DEFEND, 33, None, simulator().competition()).unwrap();
    assert_eq!(rows.num_rows(), 60);
    let accessed: Vec<usize> = (0..80)
        .filter(|group| {
            let (start, end) = bytes_of_group(*group);
            let ranges = table.ranges.lock().unwrap();
            ranges.iter().any(|(from, to)| *from < end && start < *to)
        })
        .collect();
    assert_eq!(accessed, [40 + 16]);
}

#[test]
fn read_accesses_few_pages_of_a_row_group() {
    let dir = tempfile::tempdir().unwrap();
    let tables = write_shards(dir.path(), HIT, 1, 60, 500);
    let table = join_shards(dir.path(), &tables);
    let metadata = ParquetMetaDataReader::new()
        .parse_and_finish(&table)
        .unwrap();
    assert_eq!(
        metadata.num_row_groups(),
        1,
        "30,000 rows are one row group"
    );
    table.bytes_read.store(0, Ordering::Relaxed);
    let rows = episode(table.clone(), HIT, 31, None, simulator().competition()).unwrap();
    assert_eq!(rows.num_rows(), 500);
    let (read, all) = (table.bytes_read.load(Ordering::Relaxed), table.len());
    assert!(read < all / 8, "{read} of {all} bytes");
}
