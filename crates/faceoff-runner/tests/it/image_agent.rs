//! An agent that is a container image, from the archive to the verdict.

use crate::{
    agents::sandboxed_environment,
    archives::write,
    image_archives::{POSE_HOLDING_MANIFEST, POSE_HOLDING_SCRIPT, shell_agent},
};
use faceoff_runner::{
    AgentEnvironment, ValidationFailure, ValidationReport, ValidationSpec,
    bundle::{BundleLimits, unpack},
    validate,
};
use faceoff_sandbox::{Isolation, Layer};
use faceoff_types::{AgentFaultKind, Seed};

/// The report of the validation of [`POSE_HOLDING_SCRIPT`].
fn report_in(env: &AgentEnvironment) -> ValidationReport {
    let dir = tempfile::tempdir().unwrap();
    let image = shell_agent(POSE_HOLDING_MANIFEST, POSE_HOLDING_SCRIPT);
    let archive = write(dir.path(), "ours.tar.gz", &image.docker().gz());
    let limits = BundleLimits::default();
    let bundle = unpack(&archive, &dir.path().join("bundle"), &limits, &|| false).unwrap();
    let seed = Seed::from_number(0);
    let spec = ValidationSpec {
        ruleset: faceoff_airhockey::RULESET,
        profile: faceoff_airhockey::EVALUATION,
        perturbations: Default::default(),
        episodes_per_task: 1000,
        episodes_per_shard: 50,
        tasks: faceoff_airhockey::TASKS.to_vec(),
        seed,
        mismatch_seed: seed.model_mismatch(),
    };
    validate(&spec, &bundle, env, &|| false).expect("the platform works")
}

/// The reason why the agent cannot start.
fn refusal(env: &AgentEnvironment) -> String {
    match report_in(env).failure {
        Some(ValidationFailure::Fault { fault, .. }) => match fault.fault {
            AgentFaultKind::CannotStart { detail } => detail,
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    }
}

#[test]
fn image_agent_gets_image_and_manifest_variables() {
    let report = report_in(&sandboxed_environment());
    assert_eq!(report.failure, None, "{}", report.log);
    // The agent prints $MODE, $PATH and $OWN at the end of each of three tasks.
    assert_eq!(report.log, "toml /opt/bin own\n".repeat(3));
}

#[test]
fn unsupported_image_is_refused_with_a_reason() {
    let mut forbidden = sandboxed_environment();
    forbidden.images = false;
    let reason = refusal(&forbidden);
    assert_eq!(
        reason,
        "the runtime \"image\" of agent.toml is not offered here; offered: native, python3"
    );
    for isolation in [
        Isolation::None,
        Isolation::Sandboxed {
            disabled_layers: vec![Layer::Namespaces],
        },
    ] {
        let mut unsupported = sandboxed_environment();
        unsupported.isolation = isolation;
        let reason = refusal(&unsupported);
        assert!(reason.contains("runs in the sandbox only"), "{reason}");
    }
}
