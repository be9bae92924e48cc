//! Of an ablation's episodes those are kept that do not end as in the ideal simulator, beside how they ended there.

use anyhow::Context as _;
use faceoff_replay::{select, sheet_of};
use faceoff_store::{AblationState, Artifacts, Store, StoreError};
use faceoff_types::{AblationId, Profile, Task};
use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
};

/// By profile the packs of its shards, or a pack of what is kept.
type ByProfile<T> = BTreeMap<Profile, T>;

/// Joins the parts of ablations that are over, and removes them. What fails is told, and tried again by the next call.
pub(crate) async fn join_parts(store: &Store) {
    let ablations = match store.artifacts().ablations_in_parts().await {
        Ok(ablations) => ablations,
        Err(error) => {
            tracing::warn!(%error, "the parts of ablations could not be listed");
            return;
        }
    };
    for ablation in ablations {
        if let Err(error) = settle(store, ablation).await {
            tracing::warn!(%ablation, error = format!("{error:#}"), "the clips of an ablation could not be joined");
        }
    }
}

async fn settle(store: &Store, id: AblationId) -> anyhow::Result<()> {
    let state = match store.ablation(id).await {
        Ok(ablation) => Some(ablation.state),
        // Of a season whose database was put back to an earlier time.
        Err(StoreError::NotFound(_)) => None,
        Err(error) => return Err(error.into()),
    };
    let artifacts = store.artifacts();
    match state {
        Some(AblationState::Open { .. }) => return Ok(()),
        // A part may come late, of a worker that had lost its lease: what is joined stays.
        Some(AblationState::Finished { .. }) if !is_joined(artifacts, id).await? => {
            let parts = parts(artifacts, id).await?;
            let kept = tokio::task::spawn_blocking(move || kept(&parts)).await??;
            // The ideal's says that all are there.
            for (profile, pack) in kept.into_iter().rev() {
                let key = Artifacts::ablation_clips(id, profile);
                artifacts.put_bytes(&key, pack).await?;
            }
        }
        Some(AblationState::Finished { .. } | AblationState::Failed { .. }) | None => {}
    }
    let parts = Artifacts::ablation_parts(id);
    Ok(artifacts.delete_folder(&parts).await?)
}

async fn is_joined(artifacts: &Artifacts, id: AblationId) -> anyhow::Result<bool> {
    let ideal = Artifacts::ablation_clips(id, Profile::Ideal);
    Ok(artifacts.bytes_of(&ideal).await?.is_some())
}

async fn parts(artifacts: &Artifacts, id: AblationId) -> anyhow::Result<ByProfile<Vec<PathBuf>>> {
    let mut parts: ByProfile<Vec<PathBuf>> = BTreeMap::new();
    for (profile, key) in artifacts.parts_of_ablation(id).await? {
        parts
            .entry(profile)
            .or_default()
            .push(artifacts.path_of(&key)?);
    }
    Ok(parts)
}

fn kept(parts: &ByProfile<Vec<PathBuf>>) -> anyhow::Result<ByProfile<Vec<u8>>> {
    let ideal = parts
        .get(&Profile::Ideal)
        .context("there are no clips of the ideal simulator")?;
    let ideal_sheet = sheet_of(ideal)?;
    let mut of_ideal: BTreeSet<(Task, u32)> = BTreeSet::new();
    let mut packs = BTreeMap::new();
    for (profile, parts) in parts
        .iter()
        .filter(|(profile, _)| **profile != Profile::Ideal)
    {
        let differing = sheet_of(parts)?.ended_otherwise(&ideal_sheet);
        if !differing.is_empty() {
            packs.insert(*profile, select(parts, &differing, Vec::new())?);
            of_ideal.extend(differing);
        }
    }
    packs.insert(Profile::Ideal, select(ideal, &of_ideal, Vec::new())?);
    Ok(packs)
}
