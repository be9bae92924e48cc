//! Stores the clips of ablations. An *ablation* plays the same episodes in several simulator profiles. Each of its shards
//! stores a *part*, a pack with the clips (motions for replays) of its episodes. Kept are the clips of the episodes that end
//! differently than in the ideal simulator, with their ideal counterparts.

use anyhow::Context as _;
use faceoff_replay::{merged_index, select_episodes};
use faceoff_store::{Ablation, AblationState, Artifacts, Store, StoreError};
use faceoff_types::{AblationId, Profile, Task};
use std::{
    collections::{BTreeMap, HashSet},
    path::PathBuf,
};

/// A value per simulator profile: the parts of its shards, or the pack of the selected episodes.
type ByProfile<T> = BTreeMap<Profile, T>;

/// Joins the parts of each finished ablation into one pack per profile, and removes the parts. Failures are logged, and
/// retried by the next call.
pub(crate) async fn join_parts(store: &Store) {
    let ablations = match store.artifacts().ablations_with_parts().await {
        Ok(ablations) => ablations,
        Err(error) => {
            tracing::warn!(%error, "the parts of ablations could not be listed");
            return;
        }
    };
    for ablation in ablations {
        if let Err(error) = join_ablation(store, ablation).await {
            tracing::warn!(%ablation, error = format!("{error:#}"), "the clips of an ablation could not be joined");
        }
    }
}

async fn join_ablation(store: &Store, id: AblationId) -> anyhow::Result<()> {
    let ablation = match store.ablation(id).await {
        Ok(ablation) => Some(ablation),
        // The files are newer than the database if it was restored to an earlier state.
        Err(StoreError::NotFound(_)) => None,
        Err(error) => return Err(error.into()),
    };
    let artifacts = store.artifacts();
    match ablation {
        Some(Ablation {
            state: AblationState::Open { .. },
            ..
        }) => return Ok(()),
        // A worker that had lost its lease may add a late part: joined clips are not changed.
        Some(Ablation {
            state: AblationState::Finished { .. },
            runs,
            ..
        }) if !is_joined(artifacts, id).await? => {
            let run = runs.values().next().context("it has no runs")?;
            let tasks = store.run_plan(*run).await?.tasks;
            let parts = parts_by_profile(artifacts, id, &tasks).await?;
            let packs = tokio::task::spawn_blocking(move || select_clips(&parts)).await??;
            // The pack of the ideal profile comes last: its presence means that all packs are stored.
            for (profile, pack) in packs.into_iter().rev() {
                let key = Artifacts::ablation_clips_key(id, profile);
                artifacts.put_bytes(&key, pack).await?;
            }
        }
        Some(_) | None => {}
    }
    let parts_folder = Artifacts::ablation_parts_prefix(id);
    Ok(artifacts.delete_folder(&parts_folder).await?)
}

async fn is_joined(artifacts: &Artifacts, id: AblationId) -> anyhow::Result<bool> {
    let ideal = Artifacts::ablation_clips_key(id, Profile::Ideal);
    Ok(artifacts.size_bytes(&ideal).await?.is_some())
}

/// The files of the parts, in the order of tasks and episodes.
async fn parts_by_profile(
    artifacts: &Artifacts,
    id: AblationId,
    tasks: &[Task],
) -> anyhow::Result<ByProfile<Vec<PathBuf>>> {
    let mut listed = artifacts.list_ablation_parts(id).await?;
    listed.sort_by_key(|part| {
        let position = tasks.iter().position(|task| *task == part.task);
        (position, part.first_episode)
    });
    let mut parts: ByProfile<Vec<PathBuf>> = BTreeMap::new();
    for part in listed {
        parts
            .entry(part.profile)
            .or_default()
            .push(artifacts.local_path(&part.key)?);
    }
    Ok(parts)
}

/// The pack of each profile's episodes that end differently than in the ideal simulator. The ideal profile's pack has all
/// their counterparts. Profiles without a difference have no pack.
fn select_clips(parts: &ByProfile<Vec<PathBuf>>) -> anyhow::Result<ByProfile<Vec<u8>>> {
    let ideal = parts
        .get(&Profile::Ideal)
        .context("there are no clips of the ideal simulator")?;
    let ideal_index = merged_index(ideal)?;
    let mut ideal_episodes: HashSet<(Task, u32)> = HashSet::new();
    let mut packs = BTreeMap::new();
    for (profile, parts) in parts
        .iter()
        .filter(|(profile, _)| **profile != Profile::Ideal)
    {
        let differing = merged_index(parts)?.differing_ends(&ideal_index);
        if !differing.is_empty() {
            packs.insert(*profile, select_episodes(parts, &differing, Vec::new())?);
            ideal_episodes.extend(differing);
        }
    }
    packs.insert(
        Profile::Ideal,
        select_episodes(ideal, &ideal_episodes, Vec::new())?,
    );
    Ok(packs)
}
