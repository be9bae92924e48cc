//! Stores the clips of ablations. An *ablation* plays the same episodes in several simulator profiles. Each of its shards
//! stores a *part*, a pack with the clips (motions for replays) of its episodes. This module keeps the clips of episodes that end
//! differently than in the ideal simulator, and the clips of the same episodes in the ideal simulator.

use anyhow::Context as _;
use faceoff_replay::{merged_index, select_episodes};
use faceoff_store::{Ablation, AblationState, Artifacts, Store, StoreError};
use faceoff_types::{AblationId, Profile, ProfileMap, Task};
use std::{collections::HashSet, path::PathBuf};

/// Joins the parts of each finished ablation into one pack per profile, and removes the parts. `ideal` is the profile
/// of the ideal simulator. Failures are logged, and retried by the next call.
pub(crate) async fn join_parts(store: &Store, ideal: Profile) {
    let ablations = match store.artifacts().ablations_with_parts().await {
        Ok(ablations) => ablations,
        Err(error) => {
            tracing::warn!(%error, "the parts of ablations could not be listed");
            return;
        }
    };
    for ablation in ablations {
        if let Err(error) = join_ablation(store, ablation, ideal).await {
            tracing::warn!(%ablation, error = format!("{error:#}"), "the clips of an ablation could not be joined");
        }
    }
}

async fn join_ablation(store: &Store, id: AblationId, ideal: Profile) -> anyhow::Result<()> {
    let ablation = match store.ablation(id).await {
        Ok(ablation) => Some(ablation),
        // The database may have been restored to a state before this ablation. Then the parts are only removed.
        Err(StoreError::NotFound(_)) => None,
        Err(error) => return Err(error.into()),
    };
    let artifacts = store.artifacts();
    match ablation {
        Some(Ablation {
            state: AblationState::Unfinished { .. },
            ..
        }) => return Ok(()),
        // If the clips are joined already, a worker that had lost its lease may have stored a part late. Then the parts are only removed.
        Some(Ablation {
            state: AblationState::Finished { .. },
            runs,
            ..
        }) if !is_joined(artifacts, id, ideal).await? => {
            let run = runs.values().next().context("it has no runs")?;
            let tasks = store.run_plan(*run).await?.tasks;
            let parts = parts_by_profile(artifacts, id, &tasks).await?;
            let packs = tokio::task::spawn_blocking(move || select_clips(&parts, ideal)).await??;
            // The pack of the ideal profile comes last: its presence means that all packs are stored.
            for (profile, pack) in packs {
                let key = Artifacts::ablation_clips_key(id, profile);
                artifacts.put_bytes(&key, pack).await?;
            }
        }
        Some(_) | None => {}
    }
    let parts_folder = Artifacts::ablation_parts_prefix(id);
    Ok(artifacts.delete_folder(&parts_folder).await?)
}

async fn is_joined(artifacts: &Artifacts, id: AblationId, ideal: Profile) -> anyhow::Result<bool> {
    let ideal = Artifacts::ablation_clips_key(id, ideal);
    Ok(artifacts.size_bytes(&ideal).await?.is_some())
}

/// The files of the parts, in the order of tasks and episodes.
async fn parts_by_profile(
    artifacts: &Artifacts,
    id: AblationId,
    tasks: &[Task],
) -> anyhow::Result<ProfileMap<Vec<PathBuf>>> {
    let mut listed = artifacts.list_ablation_parts(id).await?;
    listed.sort_by_key(|part| {
        let position = tasks.iter().position(|task| *task == part.task);
        (position, part.first_episode)
    });
    let mut parts: ProfileMap<Vec<PathBuf>> = ProfileMap::new();
    for part in listed {
        parts
            .entry(part.profile)
            .or_default()
            .push(artifacts.local_path(&part.key)?);
    }
    Ok(parts)
}

/// The pack of each profile's episodes that end differently than in the ideal simulator. The ideal profile's pack has all
/// their counterparts, and is the last. Profiles without a difference have no pack.
fn select_clips(
    parts: &ProfileMap<Vec<PathBuf>>,
    ideal_profile: Profile,
) -> anyhow::Result<Vec<(Profile, Vec<u8>)>> {
    let ideal = parts
        .get(&ideal_profile)
        .context("there are no clips of the ideal simulator")?;
    let ideal_index = merged_index(ideal)?;
    let mut ideal_episodes: HashSet<(Task, u32)> = HashSet::new();
    let mut packs = Vec::new();
    for (profile, parts) in parts
        .iter()
        .filter(|(profile, _)| **profile != ideal_profile)
    {
        let differing = merged_index(parts)?.differing_ends(&ideal_index);
        if !differing.is_empty() {
            let pack = select_episodes(parts, &differing, Vec::new())?;
            packs.push((*profile, pack));
            ideal_episodes.extend(differing);
        }
    }
    let pack = select_episodes(ideal, &ideal_episodes, Vec::new())?;
    packs.push((ideal_profile, pack));
    Ok(packs)
}
