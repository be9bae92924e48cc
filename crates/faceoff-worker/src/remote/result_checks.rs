//! Checks of recordings from remote workers. They are simulated again before they count: for a shard, a random sample of
//! its episodes; for a game, all of it.

use crate::bundle_cache::blake3_of;
use anyhow::Context as _;
use faceoff_dataset::{
    DatasetError, RecordingError,
    game::{GAME_FILE, GameRecording, side_file, verify_game},
    verify::{VerifyError, verify_shard},
};
use faceoff_episode::Simulator;
use faceoff_store::Artifacts;
use faceoff_types::{EpisodeOutcome, Side};
use faceoff_wire::{
    grant::{ExpectedRecording, Grant, GrantKey},
    job::{GameFiles, JobReport},
};
use std::{ops::Range, path::Path, sync::Arc};
use uuid::Uuid;

/// Configuration of the checks.
#[derive(Debug, Clone)]
pub(super) struct ResultChecks {
    /// Number of episodes per shard that are simulated again; 0: no checks.
    pub(super) checked_episodes: u32,
    /// The server's secret, from which the sample is drawn.
    pub(super) key: GrantKey,
    pub(super) simulator: Arc<dyn Simulator>,
}

impl ResultChecks {
    /// The first difference between a result and what the simulator computes, described for organisers; `None` if none is
    /// found. An error is a platform fault.
    pub(super) fn find_difference(
        &self,
        grant: &Grant,
        report: &JobReport,
        artifacts: &Artifacts,
    ) -> anyhow::Result<Option<String>> {
        if self.checked_episodes == 0 {
            return Ok(None);
        }
        if let Some(difference) = fault_count_difference(grant, report) {
            return Ok(Some(difference));
        }
        let checked = match (report, &grant.expected_recording) {
            (
                JobReport::Shard {
                    outcomes,
                    recording: Some(key),
                    ..
                },
                ExpectedRecording::Shard(spec),
            ) => {
                let sample = self.sample(grant.nonce, played_episodes(&spec.episodes, outcomes));
                let folder = artifacts.local_path(key)?;
                verify_shard(&folder, spec, outcomes, &sample, self.simulator.as_ref())
                    .map(|()| None)
            }
            (
                JobReport::Game {
                    score,
                    recording: Some(files),
                    ..
                },
                ExpectedRecording::Game(spec),
            ) => {
                let folder = artifacts.local_path(&files.key)?;
                if let Some(difference) = file_difference(&folder, files)? {
                    return Ok(Some(difference));
                }
                (|| {
                    let recording = GameRecording::open(&folder)?;
                    if recording.manifest().spec != *spec {
                        return Ok(Some(
                            "the recording is of another game than the job".to_owned(),
                        ));
                    }
                    let verified = verify_game(&recording, &|_| {})?;
                    let expected = serde_json::to_string(&verified.score);
                    let reported = serde_json::to_string(score);
                    Ok(match (expected, reported) {
                        (Ok(expected), Ok(reported)) if same_json(&expected, &reported) => None,
                        _ => Some("the recording and the report have different scores".to_owned()),
                    })
                })()
            }
            _ => return Ok(None),
        };
        match checked {
            Ok(difference) => Ok(difference),
            Err(error) if is_platform_fault(&error) => {
                Err(error).context("checking the recording of a remote worker")
            }
            Err(error) => Ok(Some(error.to_string())),
        }
    }

    /// The episodes to simulate again. They are drawn from the server's secret and the lease's nonce, so workers cannot
    /// predict them, and they are the same on each call for a lease.
    fn sample(&self, nonce: Uuid, episodes: Range<u32>) -> Vec<u32> {
        let mut remaining: Vec<u32> = episodes.collect();
        let mut drawn = Vec::new();
        for draw in 0..self.checked_episodes {
            let Ok(count) = u64::try_from(remaining.len()) else {
                break;
            };
            if count == 0 {
                break;
            }
            let index = self.key.draw(nonce, draw) % count;
            let index = usize::try_from(index).unwrap_or_default();
            drawn.push(remaining.swap_remove(index));
        }
        drawn
    }
}

/// A contradiction between the agent faults of a report and its claim that faults ended the shard.
fn fault_count_difference(grant: &Grant, report: &JobReport) -> Option<String> {
    let (
        JobReport::Shard {
            outcomes,
            stopped_by_faults,
            ..
        },
        ExpectedRecording::Shard(spec),
    ) = (report, &grant.expected_recording)
    else {
        return None;
    };
    let faults = outcomes.iter().filter(|outcome| outcome.fault.is_some());
    let faults = u32::try_from(faults.count()).unwrap_or(u32::MAX);
    let expected = faults > spec.max_faults;
    (*stopped_by_faults != expected).then(|| {
        format!(
            "the report says that faults {} the shard, but it has {faults}, and more than {} end it",
            if *stopped_by_faults { "ended" } else { "did not end" },
            spec.max_faults
        )
    })
}

/// The episodes of a shard that were played: only the first ones if faults ended it.
fn played_episodes(episodes: &Range<u32>, outcomes: &[EpisodeOutcome]) -> Range<u32> {
    let count = u32::try_from(outcomes.len()).unwrap_or(u32::MAX);
    episodes.start..episodes.end.min(episodes.start.saturating_add(count))
}

/// Equality as JSON, regardless of the order of keys.
fn same_json(a: &str, b: &str) -> bool {
    let value = serde_json::from_str::<serde_json::Value>;
    matches!((value(a), value(b)), (Ok(a), Ok(b)) if a == b)
}

/// A game file that is missing or does not have the hash of the report.
fn file_difference(folder: &Path, reported: &GameFiles) -> anyhow::Result<Option<String>> {
    let [first, second] = &reported.side_blake3;
    let files = [
        (GAME_FILE, &reported.game_blake3),
        (side_file(Side::First), first),
        (side_file(Side::Second), second),
    ];
    for (name, expected) in files {
        let path = folder.join(name);
        if !path.exists() {
            return Ok(Some(format!("{name} was not stored")));
        }
        if blake3_of(&path)? != *expected {
            return Ok(Some(format!("{name} does not have the hash of the report")));
        }
    }
    Ok(None)
}

/// Is the error due to this host, and not to the recording?
fn is_platform_fault(error: &VerifyError) -> bool {
    match error {
        VerifyError::Dataset(DatasetError::Io(_))
        | VerifyError::Recording(RecordingError::Io(_) | RecordingError::FullDisk(_))
        | VerifyError::Job(_)
        | VerifyError::Threads(_) => true,
        VerifyError::Dataset(_) | VerifyError::Recording(_) | VerifyError::Differs(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_depends_on_secret_and_lease() {
        let sample_for = |secret: u8, nonce: u128, checked_episodes: u32, range: Range<u32>| {
            let key = GrantKey::from_secret(&[secret; 32]);
            let checks = ResultChecks {
                checked_episodes,
                key,
                simulator: faceoff_airhockey::simulator(),
            };
            checks.sample(Uuid::from_u128(nonce), range)
        };
        let sample = sample_for(1, 1, 3, 50..100);
        assert_eq!(sample, sample_for(1, 1, 3, 50..100));
        assert_eq!(sample.len(), 3);
        assert!(sample.iter().all(|episode| (50..100).contains(episode)));
        // No repetitions, and at most all episodes.
        let mut all = sample_for(1, 1, 9, 0..4);
        all.sort_unstable();
        assert_eq!(all, [0, 1, 2, 3]);
        assert!(sample_for(1, 1, 3, 5..5).is_empty());
        // Over many leases, all episodes are drawn.
        let mut seen: Vec<u32> = (0..500)
            .flat_map(|nonce| sample_for(1, nonce, 2, 0..50))
            .collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 50);
        let samples = |secret| {
            (0..10)
                .map(|nonce| sample_for(secret, nonce, 2, 0..50))
                .collect::<Vec<_>>()
        };
        assert_ne!(samples(1), samples(2));
    }
}
