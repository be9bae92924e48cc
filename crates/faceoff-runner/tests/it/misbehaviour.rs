//! What agents do wrong, and the verdict on each.

use crate::agents::{Agent, impatient, sandboxed};
use faceoff_runner::{AgentEnvironment, PlatformFault, SmokeReport, smoke};
use faceoff_types::{AgentFaultKind, Phase};

fn verdict_in(agent: &Agent, env: &AgentEnvironment) -> (AgentFaultKind, SmokeReport) {
    let report = smoke(&agent.bundle, env, &|| false).expect("the platform works");
    let fault = report.fault.clone().expect("a fault");
    (fault.fault, report)
}

fn verdict(hooks: &str) -> (AgentFaultKind, SmokeReport) {
    verdict_in(&Agent::with(hooks), &sandboxed())
}

#[test]
fn a_behaving_agent_passes_the_smoke_run() {
    let report = smoke(&Agent::behaving().bundle, &sandboxed(), &|| false).unwrap();
    assert_eq!(
        report,
        SmokeReport {
            fault: None,
            log: "goodbye\n".repeat(3)
        }
    );
}

#[test]
fn a_smoke_run_stops_when_it_is_told_to() {
    let asked = std::cell::Cell::new(0);
    let stop_at_the_third_step = || {
        asked.set(asked.get() + 1);
        asked.get() == 3
    };
    let stopped = smoke(
        &Agent::behaving().bundle,
        &sandboxed(),
        &stop_at_the_third_step,
    );
    assert!(matches!(stopped, Err(PlatformFault::Cancelled)));
    assert_eq!(asked.get(), 3);
}

#[test]
fn rubbish_is_quoted() {
    let (kind, report) = verdict("def on_step(step, answer): return 'Traceback: x'");
    assert!(matches!(kind, AgentFaultKind::NotJson { .. }), "{kind:?}");
    let fault = report.fault.unwrap();
    assert_eq!((fault.episode, fault.step), (Some(0), Some(0)));
    assert_eq!(fault.line.as_deref(), Some("Traceback: x"));
    assert!(
        report
            .log
            .contains("[faceoff] hit, episode 0, step 0: the answer is not a JSON object")
    );
}

#[test]
fn prints_between_the_lines_are_quoted() {
    let (kind, report) = verdict("say('loading the model')");
    assert!(matches!(kind, AgentFaultKind::NotJson { .. }), "{kind:?}");
    let fault = report.fault.unwrap();
    assert_eq!(
        (fault.episode, fault.line.as_deref()),
        (None, Some("loading the model"))
    );
}

#[test]
fn an_answer_before_the_question_is_a_fault() {
    // The first answer and the one to the step that was not asked yet come in one write.
    let (kind, report) = verdict(
        "def on_step(step, answer):\n    \
         return json.dumps(answer) + '\\n' + json.dumps({**answer, 'step': step + 1})",
    );
    let AgentFaultKind::WrongMessage { expected, .. } = &kind else {
        panic!("{kind:?}")
    };
    assert!(
        expected.starts_with("no output before the next question"),
        "{expected}"
    );
    assert!(report.fault.unwrap().line.unwrap().contains("\"step\": 1"));
}

#[test]
fn a_wrong_step_is_named() {
    let (kind, _) =
        verdict("def on_step(step, answer): return json.dumps({**answer, 'step': step + 5})");
    let AgentFaultKind::WrongMessage { expected, got } = kind else {
        panic!("{kind:?}")
    };
    assert_eq!(
        (expected.as_str(), got.as_str()),
        ("act with step 0", "act with step 5")
    );
}

#[test]
fn a_wrong_shape_is_named() {
    let (kind, _) = verdict(
        "def on_step(step, answer): return json.dumps({**answer, 'action': [[0] * 6] * 2})",
    );
    assert_eq!(
        kind,
        AgentFaultKind::WrongShape {
            expected: "[2][7]".into(),
            got: "[2][6]".into()
        }
    );
}

#[test]
fn nan_is_not_finite() {
    let (kind, _) = verdict(
        "def on_step(step, answer): return json.dumps({**answer, 'action': [[float('nan')] * 7] * 2})",
    );
    assert_eq!(kind, AgentFaultKind::NonFinite);
}

#[test]
fn a_number_that_no_action_needs_is_named() {
    let (kind, report) = verdict(
        "def on_step(step, answer):\n    \
         answer['action'][1][2] = 1.7e308\n    return json.dumps(answer)",
    );
    assert_eq!(
        kind,
        AgentFaultKind::TooLarge {
            place: "action[1][2]".into(),
            value: 1.7e308,
            limit: 1e4
        }
    );
    assert!(report.fault.unwrap().line.unwrap().contains("1.7e+308"));
}

#[test]
fn silence_times_out() {
    let agent = Agent::with("def on_step(step, answer): return None");
    let (kind, report) = verdict_in(&agent, &impatient());
    assert_eq!(
        kind,
        AgentFaultKind::TimedOut {
            phase: Phase::Step,
            limit_s: 0.5
        }
    );
    assert_eq!(report.fault.unwrap().step, Some(0));
}

#[test]
fn a_line_without_newline_times_out() {
    let agent = Agent::with(
        "def on_step(step, answer):\n    sys.stdout.write(json.dumps(answer)); sys.stdout.flush()",
    );
    let (kind, _) = verdict_in(&agent, &impatient());
    assert_eq!(
        kind,
        AgentFaultKind::TimedOut {
            phase: Phase::Step,
            limit_s: 0.5
        }
    );
}

#[test]
fn a_line_without_end_is_too_long() {
    let (kind, report) = verdict(
        "def on_step(step, answer):\n    sys.stdout.write('x' * 200_000); sys.stdout.flush()",
    );
    assert_eq!(
        kind,
        AgentFaultKind::LineTooLong {
            limit_bytes: 65_536
        }
    );
    assert_eq!(report.fault.unwrap().line.unwrap().chars().count(), 400);
}

#[test]
fn closing_the_output_is_a_fault() {
    let agent = Agent::with("def on_step(step, answer):\n    os.close(1); time.sleep(3600)");
    let mut env = sandboxed();
    // It will not exit: nothing is gained by waiting for it.
    env.time.bye_s = 0.5;
    let (kind, _) = verdict_in(&agent, &env);
    assert_eq!(kind, AgentFaultKind::ClosedOutput);
}

#[test]
fn exits_and_signals_are_told_apart() {
    let (kind, report) = verdict("def on_step(step, answer): raise ValueError('my bug')");
    assert_eq!(kind, AgentFaultKind::Exited { code: 1 });
    assert!(report.log.contains("ValueError: my bug"), "{}", report.log);
    let (kind, _) = verdict("import ctypes\ndef on_step(step, answer): ctypes.string_at(0)");
    assert_eq!(kind, AgentFaultKind::Signalled { signal: 11 });
    let (kind, report) = verdict("def on_reset(episode): sys.exit(0)");
    assert_eq!(kind, AgentFaultKind::Exited { code: 0 });
    let fault = report.fault.unwrap();
    assert_eq!((fault.episode, fault.step), (Some(0), None));
}

#[test]
fn a_wrong_ready_is_named() {
    for (hooks, expected_got) in [
        ("INTERPOLATION = 9", "ready with interpolation 9"),
        (
            "INTERPOLATION = 'cubic'",
            "ready with interpolation \"cubic\"",
        ),
    ] {
        let (kind, _) = verdict(hooks);
        let AgentFaultKind::WrongMessage { got, .. } = kind else {
            panic!("{kind:?}")
        };
        assert_eq!(got, expected_got);
    }
    let agent = Agent::behaving().manifest(|manifest| manifest.interpolation = Some(5));
    let (kind, _) = verdict_in(&agent, &sandboxed());
    let AgentFaultKind::WrongMessage { expected, got } = kind else {
        panic!("{kind:?}")
    };
    assert_eq!(expected, "ready with interpolation 5, as agent.toml says");
    assert_eq!(got, "ready with interpolation 3");
}

#[test]
fn eating_memory_exceeds_a_limit() {
    // Before it answers: whatever the machine does meanwhile, the step cannot end otherwise.
    let (kind, _) =
        verdict("def on_step(step, answer):\n    hoard = [b'x' * (1 << 20) for _ in range(600)]");
    let AgentFaultKind::LimitExceeded { limit, .. } = &kind else {
        panic!("{kind:?}")
    };
    assert_eq!(limit, "memory");
}

#[test]
fn a_fork_bomb_ends_in_a_verdict() {
    // Every child forks on, and none ends: sooner or later a fork of the agent itself fails.
    let (kind, report) = verdict(
        "import signal\n\
         def on_step(step, answer):\n    \
         agent = os.getpid()\n    \
         try:\n        \
         while True: os.fork()\n    \
         finally:\n        \
         while os.getpid() != agent: signal.pause()",
    );
    assert!(
        matches!(
            kind,
            AgentFaultKind::Exited { .. } | AgentFaultKind::LimitExceeded { .. }
        ),
        "{kind:?} {}",
        report.log
    );
}

#[test]
fn what_cannot_be_started_is_named() {
    let missing =
        Agent::behaving().manifest(|manifest| manifest.command = vec!["./no-such-program".into()]);
    let (kind, _) = verdict_in(&missing, &sandboxed());
    assert!(
        matches!(&kind, AgentFaultKind::CannotStart { detail } if detail.contains("no-such-program")),
        "{kind:?}"
    );
    let runtime = Agent::behaving().manifest(|manifest| manifest.runtime = "matlab".into());
    let (kind, _) = verdict_in(&runtime, &sandboxed());
    let AgentFaultKind::CannotStart { detail } = kind else {
        panic!("{kind:?}")
    };
    assert!(
        detail.contains("\"matlab\"") && detail.contains("offered: native, python3"),
        "{detail}"
    );
}
