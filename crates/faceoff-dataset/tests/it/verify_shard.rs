//! Verification of a shard's recording from a remote worker.

use crate::{
    forgery::{Forgery, flipped},
    recordings::{play, spec, swing_arm},
};
use faceoff_airhockey::{DEFEND, simulator};
use faceoff_dataset::{
    ShardReport,
    verify::{VerifyError, verify_shard},
};
use faceoff_types::Seed;
use faceoff_wire::job::ShardSpec;
use serde_json::Value;
use std::{fs, path::Path};

/// The folder of a recorded shard with its specification and report.
struct RecordedShard {
    folder: tempfile::TempDir,
    spec: ShardSpec,
    report: ShardReport,
}

fn record_shard() -> RecordedShard {
    let folder = tempfile::tempdir().unwrap();
    let spec = spec(DEFEND, 4..8);
    let report = play(&spec, Some(swing_arm), folder.path());
    RecordedShard {
        folder,
        spec,
        report,
    }
}

/// Updates the sizes and hashes in `shard.json`.
fn update_shard_file(folder: &Path) {
    let path = folder.join("shard.json");
    let mut shard: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    for (name, digest) in shard["files"].as_object_mut().unwrap() {
        let bytes = fs::read(folder.join(name)).unwrap();
        digest["bytes"] = bytes.len().into();
        digest["blake3"] = blake3::hash(&bytes).to_hex().to_string().into();
    }
    fs::write(&path, serde_json::to_vec(&shard).unwrap()).unwrap();
}

fn error_text(found: Result<(), VerifyError>) -> String {
    found.unwrap_err().to_string()
}

#[test]
fn genuine_recording_verifies_with_any_sample() {
    let recorded = record_shard();
    for sample in [&[][..], &[4], &[5, 7], &[4, 5, 6, 7]] {
        verify_shard(
            recorded.folder.path(),
            &recorded.spec,
            &recorded.report.outcomes,
            sample,
            simulator().as_ref(),
        )
        .unwrap();
    }
}

#[test]
fn changed_number_in_a_sampled_episode_is_found() {
    let recorded = record_shard();
    let steps = Forgery::copy_of(recorded.folder.path());
    let first = recorded.report.outcomes[0].steps;
    // A flipped bit in the first step of the second episode.
    steps.change_table("steps.parquet", |rows| {
        flipped(&rows, "puck_x", first as usize)
    });
    update_shard_file(steps.dir.path());
    let verify = |sample: &[u32]| {
        verify_shard(
            steps.dir.path(),
            &recorded.spec,
            &recorded.report.outcomes,
            sample,
            simulator().as_ref(),
        )
    };
    let found = error_text(verify(&[4, 5]));
    assert!(
        found.contains("episode 5, step 0") && found.contains("puck_x"),
        "{found}"
    );
    // Episodes outside of the sample are not simulated, so the change is not found.
    verify(&[4, 6]).unwrap();
}

#[test]
fn outcomes_that_differ_from_the_rows_are_found() {
    let recorded = record_shard();
    let mut claimed = recorded.report.outcomes.clone();
    claimed[3].success = !claimed[3].success;
    let verify = |folder: &Path, outcomes| {
        error_text(verify_shard(
            folder,
            &recorded.spec,
            outcomes,
            &[],
            simulator().as_ref(),
        ))
    };
    assert!(verify(recorded.folder.path(), &claimed).contains("different outcomes"));
    // With the same claim in the recording's report.
    let forged = Forgery::copy_of(recorded.folder.path());
    let mut report: Value =
        serde_json::from_slice(&fs::read(forged.path("report.json")).unwrap()).unwrap();
    report["outcomes"] = serde_json::to_value(&claimed).unwrap();
    fs::write(
        forged.path("report.json"),
        serde_json::to_vec(&report).unwrap(),
    )
    .unwrap();
    assert!(verify(forged.dir.path(), &claimed).contains("report.json has"));
    update_shard_file(forged.dir.path());
    let found = verify(forged.dir.path(), &claimed);
    assert!(found.contains("episode 7, outcome"), "{found}");
    // Fewer outcomes than episodes of the job, not ended by faults.
    let fewer = error_text(verify_shard(
        recorded.folder.path(),
        &recorded.spec,
        &recorded.report.outcomes[..3],
        &[],
        simulator().as_ref(),
    ));
    assert!(fewer.contains("different outcomes"), "{fewer}");
}

#[test]
fn recording_of_another_job_is_refused() {
    let recorded = record_shard();
    let others = [
        ShardSpec {
            seed: Seed::from_number(8),
            ..recorded.spec.clone()
        },
        ShardSpec {
            episodes: 0..4,
            ..recorded.spec.clone()
        },
    ];
    for other in others {
        let found = verify_shard(
            recorded.folder.path(),
            &other,
            &recorded.report.outcomes,
            &[],
            simulator().as_ref(),
        );
        assert!(error_text(found).contains("other episodes than the job"));
    }
    let empty_folder = tempfile::tempdir().unwrap();
    let found = verify_shard(
        empty_folder.path(),
        &recorded.spec,
        &recorded.report.outcomes,
        &[4],
        simulator().as_ref(),
    );
    assert!(error_text(found).contains("damaged or incomplete"));
}
