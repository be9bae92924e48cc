//! Agents without a sandbox, as a developer runs the own agent with the option `--no-sandbox`.

use crate::harness::{LINE_CAP, Subject, TIMEOUT, expect_echo, expect_line};
use faceoff_sandbox::{AgentProcess, Isolation, ReadLine, SpawnError};
use faceoff_types::AgentFaultKind;
use std::time::{Duration, Instant};

fn unsandboxed(name: &str, arguments: &[&str]) -> Subject {
    let mut subject = Subject::new(name, arguments);
    subject.spec.isolation = Isolation::None;
    subject
}

#[test]
fn agent_runs_in_the_developers_environment() {
    let subject = unsandboxed("echo", &[]);
    let mut agent = subject.spawn();
    expect_echo(&mut agent, "hello");
    assert_eq!(agent.finish(TIMEOUT).unwrap().exit, None);
    subject.assert_nothing_left();
}

#[test]
fn line_limit_and_kill_work_without_a_sandbox() {
    let subject = unsandboxed("floods", &["endless"]);
    let mut agent = subject.spawn();
    let outcome = agent.read_line(LINE_CAP, Instant::now() + TIMEOUT).unwrap();
    assert!(matches!(outcome, ReadLine::TooLong { .. }));
    subject.finish(agent);
    for kind in ["ignores", "group"] {
        let subject = unsandboxed("resists_kill", &[kind]);
        let mut agent = subject.spawn();
        assert_eq!(expect_line(&mut agent), "ready");
        subject.finish(agent);
    }
}

#[test]
fn exit_causes_are_distinguished_without_a_sandbox() {
    let end = |arguments: &[&str]| {
        let subject = unsandboxed("exits", arguments);
        let mut agent = subject.spawn();
        assert_eq!(expect_line(&mut agent), "ready");
        let end = subject.wait_for_end(&mut agent);
        subject.finish(agent);
        end
    };
    assert_eq!(end(&["exit", "3"]), AgentFaultKind::Exited { code: 3 });
    assert_eq!(
        end(&["abort"]),
        AgentFaultKind::Signalled {
            signal: libc::SIGABRT
        }
    );
    let subject = unsandboxed("exits", &["close"]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    let outcome = agent.read_line(LINE_CAP, Instant::now() + TIMEOUT).unwrap();
    assert!(matches!(outcome, ReadLine::Closed));
    assert_eq!(agent.diagnose_end(Duration::ZERO).unwrap(), None);
    subject.finish(agent);
}

#[test]
fn missing_program_fails_the_spawn() {
    let mut subject = unsandboxed("echo", &[]);
    subject.spec.command = vec!["no-such-program".into()];
    let outcome = AgentProcess::spawn(&subject.spec);
    assert!(
        matches!(&outcome, Err(SpawnError::Agent(AgentFaultKind::CannotStart { detail }))
            if detail.contains("no-such-program")),
        "{outcome:?}"
    );
}
