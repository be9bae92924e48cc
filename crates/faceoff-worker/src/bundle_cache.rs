use crate::evaluator::Evaluator;
use faceoff_runner::bundle::{Bundle, BundleError, BundleLimits};
use faceoff_store::{BundleRef, Store};
use std::{fs, path::PathBuf};
use tokio::runtime::Handle;

/// Why a bundle cannot be had.
#[derive(Debug)]
pub(crate) enum FetchError {
    /// The archive is the team's fault; the text says what is wrong.
    Invalid(String),
    /// Ours.
    Platform(String),
}

/// The bundle that a slot used last, unpacked: a slot plays many shards of one agent in a row.
#[derive(Debug)]
pub(crate) struct BundleCache {
    folder: PathBuf,
    /// the archive's hash, and what was unpacked from it
    held: Option<(String, Bundle)>,
}

impl BundleCache {
    pub(crate) fn new(slot_folder: &std::path::Path) -> Self {
        Self {
            folder: slot_folder.join("bundle"),
            held: None,
        }
    }

    /// The unpacked bundle, fetched if it is not the one held. Its bytes are the ones that were
    /// uploaded: the hash is checked on every fetch, and agents see the folder read-only.
    pub(crate) fn get(
        &mut self,
        bundle: &BundleRef,
        evaluator: &dyn Evaluator,
        limits: &BundleLimits,
        store: &Store,
        handle: &Handle,
    ) -> Result<Bundle, FetchError> {
        if let Some((hash, held)) = &self.held
            && *hash == bundle.blake3
        {
            return Ok(held.clone());
        }
        self.held = None;
        let unpacked = self.fetch(bundle, evaluator, limits, store, handle)?;
        self.held = Some((bundle.blake3.clone(), unpacked.clone()));
        Ok(unpacked)
    }

    fn fetch(
        &self,
        bundle: &BundleRef,
        evaluator: &dyn Evaluator,
        limits: &BundleLimits,
        store: &Store,
        handle: &Handle,
    ) -> Result<Bundle, FetchError> {
        let ours = |what: &str, error: &dyn std::fmt::Display| {
            FetchError::Platform(format!("{what}: {error}"))
        };
        if self.folder.exists() {
            fs::remove_dir_all(&self.folder).map_err(|e| ours("removing the last bundle", &e))?;
        }
        let unpacked = self.folder.join("unpacked");
        fs::create_dir_all(&unpacked).map_err(|e| ours("making room for a bundle", &e))?;
        let archive = self.folder.join("archive");
        handle
            .block_on(store.artifacts().get_to_file(&bundle.key, &archive))
            .map_err(|e| ours("fetching the bundle", &e))?;
        let mut hasher = blake3::Hasher::new();
        fs::File::open(&archive)
            .and_then(|file| hasher.update_reader(file).map(|_| ()))
            .map_err(|e| ours("reading the bundle", &e))?;
        if hasher.finalize().to_string() != bundle.blake3 {
            return Err(FetchError::Platform(
                "the stored bundle is not the uploaded one".into(),
            ));
        }
        let result = match evaluator.unpack(&archive, &unpacked, limits) {
            Ok(bundle) => bundle,
            Err(BundleError::Invalid(reason)) => return Err(FetchError::Invalid(reason)),
            Err(error @ BundleError::Io { .. }) => {
                return Err(ours("unpacking the bundle", &error));
            }
        };
        fs::remove_file(&archive).map_err(|e| ours("removing the unpacked archive", &e))?;
        Ok(result)
    }
}
