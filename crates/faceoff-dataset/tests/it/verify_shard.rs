//! What another machine says it recorded, before anything is made of it.

use crate::{
    forgery::{Forgery, flipped},
    played::{moving, play, spec},
};
use faceoff_dataset::{
    ShardReport,
    verify::{VerifyError, verify_shard},
};
use faceoff_types::{Seed, Task};
use faceoff_wire::job::ShardSpec;
use serde_json::Value;
use std::{fs, path::Path};

struct Played {
    folder: tempfile::TempDir,
    spec: ShardSpec,
    report: ShardReport,
}

fn played() -> Played {
    let folder = tempfile::tempdir().unwrap();
    let spec = spec(Task::Defend, 4..8);
    let report = play(&spec, Some(moving), folder.path());
    Played {
        folder,
        spec,
        report,
    }
}

/// The sizes and hashes of `shard.json` become those of the files.
fn reseal(folder: &Path) {
    let path = folder.join("shard.json");
    let mut shard: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    for (name, digest) in shard["files"].as_object_mut().unwrap() {
        let bytes = fs::read(folder.join(name)).unwrap();
        digest["bytes"] = bytes.len().into();
        digest["blake3"] = blake3::hash(&bytes).to_hex().to_string().into();
    }
    fs::write(&path, serde_json::to_vec(&shard).unwrap()).unwrap();
}

fn told(found: Result<(), VerifyError>) -> String {
    found.unwrap_err().to_string()
}

#[test]
fn what_was_played_is_found_to_be_what_is_simulated() {
    let all = played();
    for sample in [&[][..], &[4], &[5, 7], &[4, 5, 6, 7]] {
        verify_shard(all.folder.path(), &all.spec, &all.report.outcomes, sample).unwrap();
    }
}

#[test]
fn a_number_of_a_sampled_episode_that_is_not_the_simulators_is_found() {
    let all = played();
    let steps = Forgery::of(all.folder.path());
    let first = all.report.outcomes[0].steps;
    // A bit of the second episode's first step.
    steps.table("steps.parquet", |rows| {
        flipped(&rows, "puck_x", first as usize)
    });
    reseal(steps.dir.path());
    let verify =
        |sample: &[u32]| verify_shard(steps.dir.path(), &all.spec, &all.report.outcomes, sample);
    let found = told(verify(&[4, 5]));
    assert!(
        found.contains("episode 5, step 0") && found.contains("puck_x"),
        "{found}"
    );
    // The others are not simulated: this is what a sample leaves out.
    verify(&[4, 6]).unwrap();
}

#[test]
fn outcomes_that_no_row_tells_are_found_without_a_sample() {
    let all = played();
    let mut claimed = all.report.outcomes.clone();
    claimed[3].success = !claimed[3].success;
    let verify = |folder: &Path, outcomes| told(verify_shard(folder, &all.spec, outcomes, &[]));
    assert!(verify(all.folder.path(), &claimed).contains("other outcomes"));
    // The recording's own report says so, too.
    let lied = Forgery::of(all.folder.path());
    let mut report: Value =
        serde_json::from_slice(&fs::read(lied.path("report.json")).unwrap()).unwrap();
    report["outcomes"] = serde_json::to_value(&claimed).unwrap();
    fs::write(
        lied.path("report.json"),
        serde_json::to_vec(&report).unwrap(),
    )
    .unwrap();
    assert!(verify(lied.dir.path(), &claimed).contains("report.json has"));
    reseal(lied.dir.path());
    let found = verify(lied.dir.path(), &claimed);
    assert!(found.contains("episode 7, outcome"), "{found}");
    // One that says less than was ordered, and does not say that faults ended it.
    let fewer = told(verify_shard(
        all.folder.path(),
        &all.spec,
        &all.report.outcomes[..3],
        &[],
    ));
    assert!(fewer.contains("other outcomes"), "{fewer}");
}

#[test]
fn another_order_s_recording_is_none_of_this_one() {
    let all = played();
    let others = [
        ShardSpec {
            seed: Seed::from_number(8),
            ..all.spec.clone()
        },
        ShardSpec {
            episodes: 0..4,
            ..all.spec.clone()
        },
    ];
    for other in others {
        let found = verify_shard(all.folder.path(), &other, &all.report.outcomes, &[]);
        assert!(told(found).contains("other episodes than the order"));
    }
    let none = tempfile::tempdir().unwrap();
    let found = verify_shard(none.path(), &all.spec, &all.report.outcomes, &[4]);
    assert!(told(found).contains("damaged or incomplete"));
}
