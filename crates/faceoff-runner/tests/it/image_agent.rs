//! An agent that is a container image, from the archive to its verdict.

use crate::{
    agents::sandboxed,
    archives::write,
    image_archives::{HOLDS_A_POSE, HOLDS_A_POSE_TOML, shell_agent},
};
use faceoff_runner::{
    AgentEnvironment, SmokeDefect, SmokeReport, SmokeSpec,
    bundle::{BundleLimits, unpack},
    smoke,
};
use faceoff_sandbox::{Isolation, Layer};
use faceoff_types::{AgentFaultKind, Seed};

fn report_in(env: &AgentEnvironment) -> SmokeReport {
    let dir = tempfile::tempdir().unwrap();
    let image = shell_agent(HOLDS_A_POSE_TOML, HOLDS_A_POSE);
    let archive = write(dir.path(), "ours.tar.gz", &image.docker().gz());
    let limits = BundleLimits::default();
    let bundle = unpack(&archive, &dir.path().join("bundle"), &limits, &|| false).unwrap();
    let seed = Seed::from_number(0);
    let spec = SmokeSpec {
        seed,
        mismatch_seed: seed.model_mismatch(),
    };
    smoke(&spec, &bundle, env, &|| false).expect("the platform works")
}

fn refusal(env: &AgentEnvironment) -> String {
    match report_in(env).defect {
        Some(SmokeDefect::Fault { fault, .. }) => match fault.fault {
            AgentFaultKind::CannotStart { detail } => detail,
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_image_plays_with_its_variables_and_those_of_its_manifest() {
    let report = report_in(&sandboxed());
    assert_eq!(report.defect, None, "{}", report.log);
    assert_eq!(report.log, "toml /opt/bin own\n".repeat(3));
}

#[test]
fn an_image_that_cannot_be_run_here_is_told_why() {
    let mut forbidden = sandboxed();
    forbidden.images = false;
    let told = refusal(&forbidden);
    assert_eq!(
        told,
        "the runtime \"image\" of agent.toml is not offered here; offered: native, python3"
    );
    for isolation in [
        Isolation::None,
        Isolation::Sandboxed {
            given_up: vec![Layer::Namespaces],
        },
    ] {
        let mut open = sandboxed();
        open.isolation = isolation;
        let told = refusal(&open);
        assert!(told.contains("runs in the sandbox only"), "{told}");
    }
}
