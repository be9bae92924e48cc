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

/// The bundles that a slot used last, unpacked: a slot plays many shards of one agent in a row, and games of two.
/// No more are held than the work at hand needs, since each takes room.
#[derive(Debug)]
pub(crate) struct BundleCache {
    places: [Place; 2],
}

/// Where one bundle is unpacked.
#[derive(Debug)]
struct Place {
    folder: PathBuf,
    /// the archive's hash, and what was unpacked from it
    held: Option<(String, Bundle)>,
}

impl BundleCache {
    pub(crate) fn new(slot_folder: &Path) -> Self {
        let place = |name| Place {
            folder: slot_folder.join(name),
            held: None,
        };
        Self {
            places: [place("bundle-1"), place("bundle-2")],
        }
    }

    /// The unpacked bundle, fetched if it is not held. All others are forgotten, but the one that is used `beside` it. Its bytes are the ones that were
    /// uploaded: the hash is checked on every fetch, and agents see the folder read-only. An error is
    /// ours, or `progress` has stopped.
    pub(crate) fn get(
        &mut self,
        agent: &AgentOrder,
        beside: Option<&AgentOrder>,
        evaluator: &dyn Evaluator,
        server: &dyn WorkServer,
        progress: &Progress,
    ) -> anyhow::Result<Unpacked> {
        let mut found = None;
        let mut free = None;
        for place in &mut self.places {
            if let Some(bundle) = place.holds(agent) {
                found = Some(bundle);
            } else if beside.is_none_or(|beside| place.holds(beside).is_none()) {
                place.forget()?;
                // The first that is free: one agent alone is always in the same place.
                free = free.or(Some(place));
            }
        }
        match (found, free) {
            (Some(bundle), _) => Ok(Unpacked::Bundle(bundle)),
            (None, Some(place)) => place.take(agent, evaluator, server, progress),
            (None, None) => anyhow::bail!("both places of a slot hold the same bundle"),
        }
    }
}

impl Place {
    /// The bundle, if it is here.
    fn holds(&self, agent: &AgentOrder) -> Option<Bundle> {
        let (hash, held) = self.held.as_ref()?;
        (*hash == agent.bundle.blake3).then(|| held.clone())
    }

    fn forget(&mut self) -> anyhow::Result<()> {
        self.held = None;
        if self.folder.exists() {
            fs::remove_dir_all(&self.folder)?;
        }
        Ok(())
    }

    /// Fetches a bundle into this place, where nothing is.
    fn take(
        &mut self,
        agent: &AgentOrder,
        evaluator: &dyn Evaluator,
        server: &dyn WorkServer,
        progress: &Progress,
    ) -> anyhow::Result<Unpacked> {
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
pub(crate) fn blake3_of(file: &Path) -> anyhow::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(fs::File::open(file)?)?;
    Ok(hasher.finalize().to_string())
}
