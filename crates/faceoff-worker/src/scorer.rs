//! Scoring: the recordings of an evaluation's shards become its dataset. It reads and writes files that no remote worker may
//! access, so only the slots of the server's own process have a scorer.

use crate::{evaluator::Evaluator, local_files::LocalFiles};
use anyhow::Context as _;
use faceoff_wire::job::{EvaluationMeta, JobReport};
use std::path::{Path, PathBuf};

/// Scores evaluations with the files of the local store.
#[derive(Debug, Clone)]
pub(crate) struct Scorer {
    pub(crate) files: LocalFiles,
}

impl Scorer {
    /// Merges the shards' recordings into the dataset, scores them and stores the dataset. `folder` is for temporary files.
    pub(crate) fn score(
        &self,
        evaluator: &dyn Evaluator,
        folder: &Path,
        meta: &EvaluationMeta,
        recordings: &[String],
        dataset: &str,
    ) -> anyhow::Result<JobReport> {
        let recordings = self.fetch_recordings(recordings, folder)?;
        let archive = folder.join("dataset.zip");
        let clips = folder.join("clips");
        let assembled = evaluator.assemble(meta, &recordings, &archive, &clips)?;
        self.files
            .store_dataset(dataset, &archive, assembled.has_clips.then_some(&*clips))
            .context("storing the dataset")?;
        Ok(JobReport::Scoring {
            dataset: dataset.to_owned(),
            blake3: assembled.archive.blake3,
            result: Box::new(assembled.result),
        })
    }

    /// Copies each recording into its own folder.
    fn fetch_recordings(&self, keys: &[String], into: &Path) -> anyhow::Result<Vec<PathBuf>> {
        let mut folders = Vec::with_capacity(keys.len());
        for (position, key) in keys.iter().enumerate() {
            let folder = into.join(format!("shard-{position:05}"));
            fs_err::create_dir(&folder)?;
            self.files
                .fetch_recording(key, &folder)
                .with_context(|| format!("fetching the recording {key}"))?;
            folders.push(folder);
        }
        Ok(folders)
    }
}
