//! What another machine has recorded is simulated again before it counts: of a shard some episodes that nobody knows before, of a game
//! all of it.

use crate::bundle_cache::blake3_of;
use anyhow::Context as _;
use faceoff_dataset::{
    DatasetError, RecordingError,
    game::{GAME_FILE, GameRecording, side_file, verify_game},
    verify::{VerifyError, verify_shard},
};
use faceoff_store::Artifacts;
use faceoff_types::{EpisodeOutcome, Side};
use faceoff_wire::{
    grant::{Grant, GrantKey, Plays},
    work::{StoredGame, WorkReport},
};
use std::{ops::Range, path::Path};
use uuid::Uuid;

/// How recordings of other machines are checked.
#[derive(Debug, Clone)]
pub(super) struct Checks {
    /// Episodes of each shard that are simulated again; 0: nothing is checked.
    pub(super) episodes: u32,
    pub(super) key: GrantKey,
}

impl Checks {
    /// What shows that a report and its recording are not what the simulator gives, in words for organisers; `None`: nothing does. An error
    /// is ours.
    pub(super) fn difference(
        &self,
        grant: &Grant,
        report: &WorkReport,
        artifacts: &Artifacts,
    ) -> anyhow::Result<Option<String>> {
        if self.episodes == 0 {
            return Ok(None);
        }
        if let Some(difference) = other_end(grant, report) {
            return Ok(Some(difference));
        }
        let found = match (report, &grant.plays) {
            (
                WorkReport::Play {
                    outcomes,
                    recording: Some(key),
                    ..
                },
                Plays::Shard(spec),
            ) => {
                let sample = self.sample(grant.nonce, played(&spec.episodes, outcomes));
                verify_shard(&artifacts.path_of(key)?, spec, outcomes, &sample).map(|()| None)
            }
            (
                WorkReport::Game {
                    score,
                    recording: Some(stored),
                    ..
                },
                Plays::Game(spec),
            ) => {
                let folder = artifacts.path_of(&stored.key)?;
                if let Some(difference) = other_file(&folder, stored)? {
                    return Ok(Some(difference));
                }
                (|| {
                    let recording = GameRecording::open(&folder)?;
                    if recording.manifest().spec != *spec {
                        return Ok(Some(
                            "the recording is of another game than the order".to_owned(),
                        ));
                    }
                    let verified = verify_game(&recording, &|_| {})?;
                    let expected = serde_json::to_string(&verified.score);
                    let reported = serde_json::to_string(score);
                    Ok(match (expected, reported) {
                        (Ok(expected), Ok(reported)) if same_json(&expected, &reported) => None,
                        _ => Some("the recording and the report tell of other scores".to_owned()),
                    })
                })()
            }
            _ => return Ok(None),
        };
        match found {
            Ok(difference) => Ok(difference),
            Err(error) if is_ours(&error) => {
                Err(error).context("checking what another machine has recorded")
            }
            Err(error) => Ok(Some(error.to_string())),
        }
    }

    /// Which of the episodes are simulated again: drawn of what no worker knows, so that none can be spared, and the same if it is asked
    /// again.
    fn sample(&self, nonce: Uuid, episodes: Range<u32>) -> Vec<u32> {
        let mut left: Vec<u32> = episodes.collect();
        let mut drawn = Vec::new();
        for number in 0..self.episodes {
            let Ok(count) = u64::try_from(left.len()) else {
                break;
            };
            if count == 0 {
                break;
            }
            let index = self.key.draw(nonce, number) % count;
            let index = usize::try_from(index).unwrap_or_default();
            drawn.push(left.swap_remove(index));
        }
        drawn
    }
}

/// Were there as many faults of the agent as a report that ends its evaluation for them says?
fn other_end(grant: &Grant, report: &WorkReport) -> Option<String> {
    let (
        WorkReport::Play {
            outcomes,
            stopped_by_faults,
            ..
        },
        Plays::Shard(spec),
    ) = (report, &grant.plays)
    else {
        return None;
    };
    let faults = outcomes.iter().filter(|outcome| outcome.fault.is_some());
    let faults = u32::try_from(faults.count()).unwrap_or(u32::MAX);
    let expected = faults > spec.max_faults;
    (*stopped_by_faults != expected).then(|| {
        format!(
            "the report says that faults {} the shard, and it has {faults} where more than {} end it",
            if *stopped_by_faults { "ended" } else { "did not end" },
            spec.max_faults
        )
    })
}

/// The episodes of a shard that were played: the first ones, if faults ended it.
fn played(episodes: &Range<u32>, outcomes: &[EpisodeOutcome]) -> Range<u32> {
    let count = u32::try_from(outcomes.len()).unwrap_or(u32::MAX);
    episodes.start..episodes.end.min(episodes.start.saturating_add(count))
}

/// As JSON, whatever the order of keys.
fn same_json(a: &str, b: &str) -> bool {
    let value = serde_json::from_str::<serde_json::Value>;
    matches!((value(a), value(b)), (Ok(a), Ok(b)) if a == b)
}

/// Do a game's files hash to what its report says?
fn other_file(folder: &Path, stored: &StoredGame) -> anyhow::Result<Option<String>> {
    let [first, second] = &stored.side_blake3;
    let files = [
        (GAME_FILE, &stored.game_blake3),
        (side_file(Side::First), first),
        (side_file(Side::Second), second),
    ];
    for (name, expected) in files {
        let path = folder.join(name);
        if !path.exists() {
            return Ok(Some(format!("{name} was not stored")));
        }
        if blake3_of(&path)? != *expected {
            return Ok(Some(format!("{name} is not what the report says")));
        }
    }
    Ok(None)
}

/// Is it our disk or our memory that failed, and not the recording?
fn is_ours(error: &VerifyError) -> bool {
    match error {
        VerifyError::Dataset(DatasetError::Io(_))
        | VerifyError::Recording(RecordingError::Io(_) | RecordingError::FullDisk(_))
        | VerifyError::Workers(_) => true,
        VerifyError::Dataset(_) | VerifyError::Recording(_) | VerifyError::Differs(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_drawn_of_the_servers_secret_and_the_lease() {
        let of = |secret: u8, nonce: u128, episodes: u32, range: Range<u32>| {
            let key = GrantKey::of(&[secret; 32]);
            Checks { episodes, key }.sample(Uuid::from_u128(nonce), range)
        };
        let sample = of(1, 1, 3, 50..100);
        assert_eq!(sample, of(1, 1, 3, 50..100));
        assert_eq!(sample.len(), 3);
        assert!(sample.iter().all(|episode| (50..100).contains(episode)));
        // Each at most once, and no more than there are.
        let mut all = of(1, 1, 9, 0..4);
        all.sort_unstable();
        assert_eq!(all, [0, 1, 2, 3]);
        assert!(of(1, 1, 3, 5..5).is_empty());
        // Over many leases each episode has its turn.
        let mut seen: Vec<u32> = (0..500).flat_map(|nonce| of(1, nonce, 2, 0..50)).collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 50);
        let others = |secret| {
            (0..10)
                .map(|nonce| of(secret, nonce, 2, 0..50))
                .collect::<Vec<_>>()
        };
        assert_ne!(others(1), others(2));
    }
}
