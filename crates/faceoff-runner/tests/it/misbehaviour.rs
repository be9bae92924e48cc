//! Misbehaving agents in a validation: each misbehaviour is an agent fault of its own kind.

use crate::agents::{Agent, sandboxed_environment, short_step_limit_environment};
use faceoff_airhockey::{DEFEND, HIT, TASKS};
use faceoff_runner::{
    AgentEnvironment, PlatformFault, VALIDATION_STEPS, ValidationFailure, ValidationReport,
    ValidationSpec, validate,
};
use faceoff_types::{AgentFault, AgentFaultKind, Phase, Seed};

/// A validation with the seed of this number.
fn spec(number: u64) -> ValidationSpec {
    let seed = Seed::from_number(number);
    ValidationSpec {
        ruleset: faceoff_airhockey::RULESET,
        profile: faceoff_airhockey::EVALUATION,
        perturbations: Default::default(),
        episodes_per_task: 1000,
        episodes_per_shard: 50,
        tasks: faceoff_airhockey::TASKS.to_vec(),
        seed,
        mismatch_seed: seed.model_mismatch(),
    }
}

/// The report of the agent's validation.
fn report_in(agent: &Agent, env: &AgentEnvironment) -> ValidationReport {
    validate(&spec(0), &agent.bundle, env, &|| false).expect("the platform works")
}

/// The fault that ended the agent's validation, and the report.
fn validation_fault_in(
    agent: &Agent,
    env: &AgentEnvironment,
) -> (AgentFaultKind, ValidationReport) {
    let report = report_in(agent, env);
    (fault(&report).fault, report)
}

fn fault(report: &ValidationReport) -> AgentFault {
    match &report.failure {
        Some(ValidationFailure::Fault { fault, .. }) => fault.clone(),
        other => panic!("expected a fault, got {other:?}"),
    }
}

/// As [`validation_fault_in`], for an agent with these hooks in the usual sandbox.
fn validation_fault(hooks: &str) -> (AgentFaultKind, ValidationReport) {
    validation_fault_in(&Agent::with_hooks(hooks), &sandboxed_environment())
}

#[test]
fn behaving_agent_passes_the_validation() {
    let report = report_in(&Agent::behaving(), &sandboxed_environment());
    assert_eq!(report.failure, None);
    assert_eq!(report.log, "goodbye\n".repeat(3));
    for (timing, task) in report.timing.iter().zip(TASKS) {
        assert_eq!(timing.task, task);
        assert!(timing.steps >= VALIDATION_STEPS, "{timing:?}");
        assert!(
            0.0 < timing.mean_s && timing.p99_s <= timing.max_s,
            "{timing:?}"
        );
    }
    assert_eq!(report.timing.len(), 3);
}

#[test]
fn validation_length_and_episodes_depend_on_the_seed() {
    let agent = Agent::with_hooks(
        "def on_reset(episode): print('reset', episode, file=sys.stderr)\n\
         def on_step(step, answer):\n    \
         if step == 0: print(answer['action'][0][0], file=sys.stderr)\n    \
         return json.dumps(answer)",
    );
    let run = |number| {
        let report = validate(
            &spec(number),
            &agent.bundle,
            &sandboxed_environment(),
            &|| false,
        )
        .unwrap();
        assert_eq!(report.failure, None, "{}", report.log);
        let steps: Vec<u32> = report.timing.iter().map(|timing| timing.steps).collect();
        (steps, report.log)
    };
    let (steps, log) = run(1);
    assert_eq!(run(1), (steps.clone(), log.clone()));
    let (other_steps, other_log) = run(2);
    assert_ne!(other_steps, steps);
    assert_ne!(other_log, log);
}

/// A validation plays the shards of an evaluation in order, from a random one, and each with a new process. It stops when it has
/// enough steps, so the last shard may be incomplete.
#[test]
fn validation_plays_shards_of_the_stage() {
    let agent = Agent::with_hooks(
        "print('start', file=sys.stderr)\n\
         def on_reset(episode): print(episode, file=sys.stderr)",
    );
    for number in 0..3 {
        let spec = ValidationSpec {
            tasks: vec![DEFEND],
            episodes_per_task: 5,
            episodes_per_shard: 2,
            ..spec(number)
        };
        let report = validate(&spec, &agent.bundle, &sandboxed_environment(), &|| false).unwrap();
        assert_eq!(report.failure, None, "{}", report.log);
        assert_eq!(report.timing.len(), 1);
        let lines = report.log.split_whitespace();
        let lines: Vec<_> = lines.filter(|line| *line != "goodbye").collect();
        // The episodes that each process has played.
        let processes: Vec<_> = lines.split(|line| *line == "start").skip(1).collect();
        let shards = [&["0", "1"][..], &["2", "3"], &["4"]];
        let (last, complete) = processes.split_last().unwrap();
        let first = shards
            .iter()
            .position(|shard| shard.starts_with(&[processes[0][0]]));
        let in_order = shards.iter().cycle().skip(first.unwrap());
        for (process, shard) in complete.iter().zip(in_order.clone()) {
            assert_eq!(process, shard, "{lines:?}");
        }
        let last_shard = in_order.clone().nth(complete.len()).unwrap();
        assert!(last_shard.starts_with(last), "{lines:?}");
    }
}

#[test]
fn slow_mean_answer_fails_the_validation() {
    // Every answer is within its own limit, and no machine is so fast that answers take no time.
    let mut env = sandboxed_environment();
    env.time.mean_s = 1e-9;
    let report = report_in(&Agent::behaving(), &env);
    let Some(failure @ ValidationFailure::TooSlow { timing, .. }) = &report.failure else {
        panic!("{:?}", report.failure)
    };
    assert_eq!((timing.task, report.timing.len()), (HIT, 1));
    assert!(failure.to_string().contains("too slow"), "{failure}");
}

#[test]
fn exceeded_time_budget_is_a_fault() {
    // Independent of other load: three answers cannot take less time.
    let mut env = sandboxed_environment();
    env.time.episode_extra_s = 0.5;
    let slow =
        Agent::with_hooks("def on_step(step, answer): time.sleep(0.3); return json.dumps(answer)");
    let (kind, report) = validation_fault_in(&slow, &env);
    assert!(
        matches!(kind, AgentFaultKind::TimeBudget { phase: Phase::Step, used_s, limit_s }
            if used_s > limit_s && limit_s < 0.7),
        "{kind:?}"
    );
    let step = fault(&report).step.expect("the fault is in an episode");
    assert!((1..=2).contains(&step), "{step}");

    let mut env = sandboxed_environment();
    (env.time.resets_extra_s, env.time.reset_mean_s) = (0.5, 1e-9);
    let slow = Agent::with_hooks("def on_reset(episode): time.sleep(1.0)");
    let (kind, report) = validation_fault_in(&slow, &env);
    assert!(
        matches!(
            kind,
            AgentFaultKind::TimeBudget {
                phase: Phase::Reset,
                ..
            }
        ),
        "{kind:?}"
    );
    assert_eq!(fault(&report).step, None);
}

#[test]
fn validation_stops_when_cancelled() {
    let checks = std::cell::Cell::new(0);
    let is_cancelled_at_third_check = || {
        checks.set(checks.get() + 1);
        checks.get() == 3
    };
    let stopped = validate(
        &spec(0),
        &Agent::behaving().bundle,
        &sandboxed_environment(),
        &is_cancelled_at_third_check,
    );
    assert!(matches!(stopped, Err(PlatformFault::Cancelled)));
    assert_eq!(checks.get(), 3);
}

#[test]
fn fault_quotes_an_invalid_answer() {
    let (kind, report) = validation_fault("def on_step(step, answer): return 'Traceback: x'");
    assert!(matches!(kind, AgentFaultKind::NotJson { .. }), "{kind:?}");
    let fault = fault(&report);
    assert_eq!((fault.episode.is_some(), fault.step), (true, Some(0)));
    assert_eq!(fault.line.as_deref(), Some("Traceback: x"));
    assert!(
        report
            .log
            .contains(", step 0: the answer is not a JSON object")
    );
}

#[test]
fn fault_quotes_a_printed_line() {
    let (kind, report) = validation_fault("say('loading the model')");
    assert!(matches!(kind, AgentFaultKind::NotJson { .. }), "{kind:?}");
    let fault = fault(&report);
    assert_eq!(
        (fault.episode, fault.line.as_deref()),
        (None, Some("loading the model"))
    );
}

#[test]
fn answer_before_the_question_is_a_fault() {
    // One write contains the first answer and the answer to a step that was not sent yet.
    let (kind, report) = validation_fault(
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
    assert!(fault(&report).line.unwrap().contains("\"step\": 1"));
}

#[test]
fn fault_names_a_wrong_step() {
    let (kind, _) = validation_fault(
        "def on_step(step, answer): return json.dumps({**answer, 'step': step + 5})",
    );
    let AgentFaultKind::WrongMessage { expected, got } = kind else {
        panic!("{kind:?}")
    };
    assert_eq!(
        (expected.as_str(), got.as_str()),
        ("act with step 0", "act with step 5")
    );
}

#[test]
fn fault_names_a_wrong_shape() {
    let (kind, _) = validation_fault(
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
fn nan_in_an_action_is_an_agent_fault() {
    let (kind, _) = validation_fault(
        "def on_step(step, answer): return json.dumps({**answer, 'action': [[float('nan')] * 7] * 2})",
    );
    assert_eq!(kind, AgentFaultKind::NonFinite);
}

#[test]
fn fault_names_a_too_large_number() {
    let (kind, report) = validation_fault(
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
    assert!(fault(&report).line.unwrap().contains("1.7e+308"));
}

#[test]
fn silence_times_out() {
    let agent = Agent::with_hooks("def on_step(step, answer): return None");
    let (kind, report) = validation_fault_in(&agent, &short_step_limit_environment());
    assert_eq!(
        kind,
        AgentFaultKind::TimedOut {
            phase: Phase::Step,
            limit_s: 0.5
        }
    );
    assert_eq!(fault(&report).step, Some(0));
}

#[test]
fn line_without_newline_times_out() {
    let agent = Agent::with_hooks(
        "def on_step(step, answer):\n    sys.stdout.write(json.dumps(answer)); sys.stdout.flush()",
    );
    let (kind, _) = validation_fault_in(&agent, &short_step_limit_environment());
    assert_eq!(
        kind,
        AgentFaultKind::TimedOut {
            phase: Phase::Step,
            limit_s: 0.5
        }
    );
}

#[test]
fn endless_line_is_too_long() {
    let (kind, report) = validation_fault(
        "def on_step(step, answer):\n    sys.stdout.write('x' * 200_000); sys.stdout.flush()",
    );
    assert_eq!(
        kind,
        AgentFaultKind::LineTooLong {
            limit_bytes: 65_536
        }
    );
    assert_eq!(fault(&report).line.unwrap().chars().count(), 400);
}

#[test]
fn closed_output_is_a_fault() {
    let agent = Agent::with_hooks("def on_step(step, answer):\n    os.close(1); time.sleep(3600)");
    let mut env = sandboxed_environment();
    // The agent never exits, so a short wait for its exit is enough.
    env.time.bye_s = 0.5;
    let (kind, _) = validation_fault_in(&agent, &env);
    assert_eq!(kind, AgentFaultKind::ClosedOutput);
}

#[test]
fn exits_and_signals_are_distinguished() {
    let (kind, report) = validation_fault("def on_step(step, answer): raise ValueError('my bug')");
    assert_eq!(kind, AgentFaultKind::Exited { code: 1 });
    assert!(report.log.contains("ValueError: my bug"), "{}", report.log);
    let (kind, _) =
        validation_fault("import ctypes\ndef on_step(step, answer): ctypes.string_at(0)");
    assert_eq!(kind, AgentFaultKind::Signalled { signal: 11 });
    let (kind, report) = validation_fault("def on_reset(episode): sys.exit(0)");
    assert_eq!(kind, AgentFaultKind::Exited { code: 0 });
    let fault = fault(&report);
    assert_eq!((fault.episode.is_some(), fault.step), (true, None));
}

#[test]
fn fault_names_a_wrong_ready_message() {
    for (hooks, expected_got) in [
        ("INTERPOLATION = 9", "ready with interpolation 9"),
        (
            "INTERPOLATION = 'cubic'",
            "ready with interpolation \"cubic\"",
        ),
    ] {
        let (kind, _) = validation_fault(hooks);
        let AgentFaultKind::WrongMessage { got, .. } = kind else {
            panic!("{kind:?}")
        };
        assert_eq!(got, expected_got);
    }
    let agent = Agent::behaving().manifest(|manifest| manifest.interpolation = Some(5));
    let (kind, _) = validation_fault_in(&agent, &sandboxed_environment());
    let AgentFaultKind::WrongMessage { expected, got } = kind else {
        panic!("{kind:?}")
    };
    assert_eq!(expected, "ready with interpolation 5, as agent.toml says");
    assert_eq!(got, "ready with interpolation 3");
}

#[test]
fn memory_use_above_the_limit_is_a_fault() {
    // The agent exceeds the limit before it answers, so the step cannot end in another way.
    let (kind, _) = validation_fault(
        "def on_step(step, answer):\n    hoard = [b'x' * (1 << 20) for _ in range(600)]",
    );
    let AgentFaultKind::LimitExceeded { limit, .. } = &kind else {
        panic!("{kind:?}")
    };
    assert_eq!(limit, "memory");
}

#[test]
fn fork_bomb_ends_in_an_agent_fault() {
    // Every child keeps forking and none exits, so a fork of the agent itself fails eventually.
    let (kind, report) = validation_fault(
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
fn unstartable_command_or_runtime_is_named() {
    let missing =
        Agent::behaving().manifest(|manifest| manifest.command = vec!["./no-such-program".into()]);
    let (kind, _) = validation_fault_in(&missing, &sandboxed_environment());
    assert!(
        matches!(&kind, AgentFaultKind::CannotStart { detail } if detail.contains("no-such-program")),
        "{kind:?}"
    );
    let runtime = Agent::behaving().manifest(|manifest| manifest.runtime = "matlab".into());
    let (kind, _) = validation_fault_in(&runtime, &sandboxed_environment());
    let AgentFaultKind::CannotStart { detail } = kind else {
        panic!("{kind:?}")
    };
    assert!(
        detail.contains("\"matlab\"") && detail.contains("offered: native, python3"),
        "{detail}"
    );
}
