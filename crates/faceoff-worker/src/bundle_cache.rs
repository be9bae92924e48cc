//! The cache of a slot's unpacked bundles. A *bundle* is what a team submits: an archive or container image with its agent.

use crate::{evaluator::Evaluator, files::FileStore, lease::Progress};
use anyhow::Context as _;
use faceoff_runner::{
    PlatformFault,
    bundle::{Bundle, BundleError},
};
use faceoff_wire::job::AgentSpec;
use fs_err as fs;
use std::path::{Path, PathBuf};

/// The result of unpacking a team's bundle.
#[derive(Debug)]
pub(crate) enum UnpackResult {
    Bundle(Bundle),
    /// The bundle is not valid, by the team's fault; the text says what is wrong.
    Invalid(String),
}

/// The unpacked bundles that a slot used last. A slot often runs many shards of one agent in a row, and games of two
/// agents. The cache holds no more bundles than the current job needs, since each takes disk space.
#[derive(Debug)]
pub(crate) struct BundleCache {
    entries: [Entry; 2],
}

/// A folder for one unpacked bundle.
#[derive(Debug)]
struct Entry {
    folder: PathBuf,
    /// The archive's hash, and the unpacked bundle.
    bundle: Option<(String, Bundle)>,
}

impl BundleCache {
    pub(crate) fn new(slot_folder: &Path) -> Self {
        let entry = |name| Entry {
            folder: slot_folder.join(name),
            bundle: None,
        };
        Self {
            entries: [entry("bundle-1"), entry("bundle-2")],
        }
    }

    /// Returns the unpacked bundle of `agent`, and fetches it if it is not in the cache. All other bundles are removed,
    /// except that of the `opponent` in a game. The content is what was uploaded: the hash is checked on every fetch, and
    /// agents see the folder read-only. An error is a platform fault, or the slot must stop (see `progress`).
    pub(crate) fn get(
        &mut self,
        agent: &AgentSpec,
        opponent: Option<&AgentSpec>,
        evaluator: &dyn Evaluator,
        files: &dyn FileStore,
        progress: &Progress,
    ) -> anyhow::Result<UnpackResult> {
        // An entry is free if it holds the bundle of neither agent.
        let mut found = None;
        let mut free = None;
        for entry in &mut self.entries {
            if let Some(bundle) = entry.get(agent) {
                found = Some(bundle);
            } else if opponent.is_none_or(|opponent| entry.get(opponent).is_none()) {
                entry.clear()?;
                // The first free entry, so that a single agent is always in the same one.
                free = free.or(Some(entry));
            }
        }
        match (found, free) {
            (Some(bundle), _) => Ok(UnpackResult::Bundle(bundle)),
            (None, Some(entry)) => entry.fill(agent, evaluator, files, progress),
            (None, None) => anyhow::bail!("both cache entries of a slot hold the same bundle"),
        }
    }
}

impl Entry {
    /// The agent's bundle, if this entry holds it.
    fn get(&self, agent: &AgentSpec) -> Option<Bundle> {
        let (hash, bundle) = self.bundle.as_ref()?;
        (*hash == agent.bundle.blake3).then(|| bundle.clone())
    }

    fn clear(&mut self) -> anyhow::Result<()> {
        self.bundle = None;
        if self.folder.exists() {
            fs::remove_dir_all(&self.folder)?;
        }
        Ok(())
    }

    /// Fetches a bundle into this entry, which must be empty.
    fn fill(
        &mut self,
        agent: &AgentSpec,
        evaluator: &dyn Evaluator,
        files: &dyn FileStore,
        progress: &Progress,
    ) -> anyhow::Result<UnpackResult> {
        let fetched = self.fetch(agent, evaluator, files, progress);
        // An invalid or partial bundle must not take space that the next one needs.
        if !matches!(fetched, Ok(UnpackResult::Bundle(_)))
            && self.folder.exists()
            && let Err(error) = fs::remove_dir_all(&self.folder)
        {
            tracing::warn!(%error, "a partial bundle could not be removed");
        }
        let unpacked = fetched?;
        if let UnpackResult::Bundle(bundle) = &unpacked {
            self.bundle = Some((agent.bundle.blake3.clone(), bundle.clone()));
        }
        Ok(unpacked)
    }

    fn fetch(
        &self,
        agent: &AgentSpec,
        evaluator: &dyn Evaluator,
        files: &dyn FileStore,
        progress: &Progress,
    ) -> anyhow::Result<UnpackResult> {
        let unpacked = self.folder.join("unpacked");
        fs::create_dir_all(&unpacked)?;
        let archive = self.folder.join("archive");
        files
            .fetch_bundle(&agent.bundle, &archive)
            .context("fetching the bundle")?;
        anyhow::ensure!(
            blake3_of(&archive)? == agent.bundle.blake3,
            "the stored bundle is not the uploaded one"
        );
        let opened = evaluator.unpack(&archive, &unpacked, &agent.limits.bundle, &|| {
            progress.must_stop()
        });
        let bundle = match opened {
            Ok(bundle) => bundle,
            Err(BundleError::Invalid(reason)) => {
                // An invalid bundle is removed at once.
                fs::remove_dir_all(&self.folder)?;
                return Ok(UnpackResult::Invalid(reason));
            }
            Err(BundleError::Cancelled) => return Err(PlatformFault::Cancelled.into()),
            Err(error @ BundleError::Io { .. }) => {
                return Err(error).context("unpacking the bundle");
            }
        };
        fs::remove_file(&archive)?;
        Ok(UnpackResult::Bundle(bundle))
    }
}

/// BLAKE3 of a file, 64 hexadecimal digits.
pub(crate) fn blake3_of(file: &Path) -> anyhow::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(fs::File::open(file)?)?;
    Ok(hasher.finalize().to_string())
}
