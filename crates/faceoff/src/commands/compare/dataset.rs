use anyhow::{Context, bail, ensure};
use arrow_array::{Array, Float64Array, RecordBatch, StringArray, UInt32Array, cast::AsArray};
use bytes::Bytes;
use faceoff_scoring::EpisodeSummary;
use faceoff_types::{ComputationTime, EpisodeOutcome, Violations};
use faceoff_wire::dataset::{DATASET_SCHEMA, DatasetManifest};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::{
    fs::{self, File},
    io::Read,
    path::{Path, PathBuf},
};
use zip::ZipArchive;

const MANIFEST: &str = "manifest.json";
const EPISODES: &str = "episodes.parquet";

/// What a comparison needs of a dataset.
pub(super) struct Dataset {
    pub(super) manifest: DatasetManifest,
    pub(super) summary: EpisodeSummary,
}

/// Where its files are.
enum Source {
    Archive(Box<ZipArchive<File>>),
    Folder(PathBuf),
}

impl Source {
    fn open(path: &Path) -> anyhow::Result<Self> {
        let archive = if path.is_dir() {
            path.join("dataset.zip")
        } else {
            path.to_owned()
        };
        if path.is_dir() && !archive.exists() {
            ensure!(
                path.join(MANIFEST).exists(),
                "expected dataset.zip, or {MANIFEST} and {EPISODES}; the folder has neither"
            );
            return Ok(Self::Folder(path.to_owned()));
        }
        let file =
            File::open(&archive).with_context(|| format!("opening {}", archive.display()))?;
        let archive = ZipArchive::new(file)
            .with_context(|| format!("{} is no dataset", archive.display()))?;
        Ok(Self::Archive(Box::new(archive)))
    }

    fn read(&mut self, name: &str) -> anyhow::Result<Vec<u8>> {
        match self {
            Self::Archive(archive) => {
                let mut entry = archive
                    .by_name(name)
                    .with_context(|| format!("no {name}"))?;
                let mut bytes = Vec::new();
                entry
                    .read_to_end(&mut bytes)
                    .with_context(|| format!("unpacking {name}"))?;
                Ok(bytes)
            }
            Self::Folder(folder) => {
                fs::read(folder.join(name)).with_context(|| format!("reading {name}"))
            }
        }
    }
}

impl Dataset {
    /// Reads the manifest and the table of episodes, and holds the one to the other.
    pub(super) fn open(path: &Path) -> anyhow::Result<Self> {
        let mut source = Source::open(path)?;
        let manifest: DatasetManifest = serde_json::from_slice(&source.read(MANIFEST)?)
            .with_context(|| format!("{MANIFEST} is not understood"))?;
        ensure!(
            manifest.schema == DATASET_SCHEMA,
            "expected the layout {DATASET_SCHEMA}, found {}",
            manifest.schema
        );
        let bytes = source.read(EPISODES)?;
        let told = manifest
            .files
            .get(EPISODES)
            .with_context(|| format!("{MANIFEST} does not list {EPISODES}"))?;
        ensure!(
            blake3::hash(&bytes).to_hex().as_str() == told.blake3,
            "{EPISODES} is not the one that {MANIFEST} lists: its hash differs"
        );
        let outcomes = outcomes(bytes.into()).with_context(|| format!("reading {EPISODES}"))?;
        let summary = EpisodeSummary::of(&outcomes)?;
        for (task, episodes) in &manifest.episodes {
            let found = summary
                .tasks
                .get(task)
                .map_or(0, |task| task.successes.episodes());
            ensure!(
                found == *episodes,
                "{MANIFEST} tells of {episodes} episodes of {task}, {EPISODES} has {found}"
            );
        }
        Ok(Self { manifest, summary })
    }
}

fn outcomes(bytes: Bytes) -> anyhow::Result<Vec<EpisodeOutcome>> {
    let mut outcomes = Vec::new();
    for batch in ParquetRecordBatchReaderBuilder::try_new(bytes)?.build()? {
        let batch = batch?;
        let (tasks, ends, faults) = (
            text(&batch, "task")?,
            text(&batch, "end")?,
            text(&batch, "fault")?,
        );
        let count = |name| column::<UInt32Array>(&batch, name, |array| array.as_primitive_opt());
        let flag = |name| column(&batch, name, |array| array.as_boolean_opt());
        let seconds = |name| column::<Float64Array>(&batch, name, |array| array.as_primitive_opt());
        let (episodes, steps, success) = (count("episode")?, count("steps")?, flag("success")?);
        let (ee, link) = (flag("violated_ee")?, flag("violated_link")?);
        let (joint_pos, joint_vel) = (flag("violated_joint_pos")?, flag("violated_joint_vel")?);
        let mean_s = seconds("computation_time_mean_s")?;
        let max_s = seconds("computation_time_max_s")?;
        for row in 0..batch.num_rows() {
            let end = ends.value(row);
            outcomes.push(EpisodeOutcome {
                task: tasks.value(row).parse()?,
                episode: episodes.value(row),
                steps: steps.value(row),
                end: serde_json::from_value(end.into())
                    .with_context(|| format!("end {end:?} is unknown"))?,
                success: success.value(row),
                violations: Violations {
                    ee: ee.value(row),
                    link: link.value(row),
                    joint_pos: joint_pos.value(row),
                    joint_vel: joint_vel.value(row),
                },
                computation_time: ComputationTime {
                    mean_s: mean_s.value(row),
                    max_s: max_s.value(row),
                },
                fault: if faults.is_null(row) {
                    None
                } else {
                    Some(serde_json::from_str(faults.value(row)).context("a fault")?)
                },
            });
        }
    }
    Ok(outcomes)
}

fn text<'a>(batch: &'a RecordBatch, name: &str) -> anyhow::Result<&'a StringArray> {
    column(batch, name, |array| array.as_string_opt())
}

fn column<'a, T>(
    batch: &'a RecordBatch,
    name: &str,
    cast: impl FnOnce(&'a dyn Array) -> Option<&'a T>,
) -> anyhow::Result<&'a T> {
    let array = batch
        .column_by_name(name)
        .with_context(|| format!("there is no column {name}"))?;
    match cast(array.as_ref()) {
        Some(array) => Ok(array),
        None => bail!("the column {name} holds {}", array.data_type()),
    }
}
