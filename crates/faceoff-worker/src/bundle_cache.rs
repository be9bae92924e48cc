use crate::{evaluator::Evaluator, lease::Progress, server::WorkServer};
use anyhow::Context as _;
use faceoff_runner::{
    PlatformFault,
    bundle::{Bundle, BundleError},
};
use faceoff_wire::work::AgentOrder;
use fs_err as fs;
use std::path::{Path, PathBuf};

/// What a team's archive turned out to be.
#[derive(Debug)]
pub(crate) enum Unpacked {
    Bundle(Bundle),
    /// No bundle, by the team's fault; the text says what is wrong.
    Invalid(String),
}

/// The bundle that a slot used last, unpacked: a slot plays many shards of one agent in a row.
#[derive(Debug)]
pub(crate) struct BundleCache {
    folder: PathBuf,
    /// the archive's hash, and what was unpacked from it
    held: Option<(String, Bundle)>,
}

impl BundleCache {
    pub(crate) fn new(slot_folder: &Path) -> Self {
        Self {
            folder: slot_folder.join("bundle"),
            held: None,
        }
    }

    /// The unpacked bundle, fetched if it is not the one held. Its bytes are the ones that were
    /// uploaded: the hash is checked on every fetch, and agents see the folder read-only. An error is
    /// ours, or `progress` has stopped.
    pub(crate) fn get(
        &mut self,
        agent: &AgentOrder,
        evaluator: &dyn Evaluator,
        server: &dyn WorkServer,
        progress: &Progress,
    ) -> anyhow::Result<Unpacked> {
        if let Some((hash, held)) = &self.held
            && *hash == agent.bundle.blake3
        {
            return Ok(Unpacked::Bundle(held.clone()));
        }
        self.held = None;
        let fetched = self.fetch(agent, evaluator, server, progress);
        // What is of no use must not keep the room that the next one needs.
        if !matches!(fetched, Ok(Unpacked::Bundle(_)))
            && self.folder.exists()
            && let Err(error) = fs::remove_dir_all(&self.folder)
        {
            tracing::warn!(%error, "a part of a bundle is left");
        }
        let unpacked = fetched?;
        if let Unpacked::Bundle(bundle) = &unpacked {
            self.held = Some((agent.bundle.blake3.clone(), bundle.clone()));
        }
        Ok(unpacked)
    }

    fn fetch(
        &self,
        agent: &AgentOrder,
        evaluator: &dyn Evaluator,
        server: &dyn WorkServer,
        progress: &Progress,
    ) -> anyhow::Result<Unpacked> {
        if self.folder.exists() {
            fs::remove_dir_all(&self.folder)?;
        }
        let unpacked = self.folder.join("unpacked");
        fs::create_dir_all(&unpacked)?;
        let archive = self.folder.join("archive");
        server
            .fetch_bundle(&agent.bundle, &archive)
            .context("fetching the bundle")?;
        anyhow::ensure!(
            blake3_of(&archive)? == agent.bundle.blake3,
            "the stored bundle is not the uploaded one"
        );
        let opened = evaluator.unpack(&archive, &unpacked, &agent.limits.bundle, &|| {
            progress.stopped()
        });
        let bundle = match opened {
            Ok(bundle) => bundle,
            Err(BundleError::Invalid(reason)) => {
                // What was refused is not kept until the next bundle comes.
                fs::remove_dir_all(&self.folder)?;
                return Ok(Unpacked::Invalid(reason));
            }
            Err(BundleError::Cancelled) => return Err(PlatformFault::Cancelled.into()),
            Err(error @ BundleError::Io { .. }) => {
                return Err(error).context("unpacking the bundle");
            }
        };
        fs::remove_file(&archive)?;
        Ok(Unpacked::Bundle(bundle))
    }
}

/// BLAKE3 of a file, 64 hexadecimal digits.
fn blake3_of(file: &Path) -> anyhow::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(fs::File::open(file)?)?;
    Ok(hasher.finalize().to_string())
}
