//! `--no-sandbox`: a developer's own agent.

use crate::harness::{LINE_CAP, PATIENCE, Subject, expect_echo, expect_line};
use faceoff_sandbox::{AgentProcess, Isolation, ReadLine, SpawnError};
use faceoff_types::AgentFaultKind;
use std::time::{Duration, Instant};

fn unsandboxed(name: &str, arguments: &[&str]) -> Subject {
    let mut subject = Subject::new(name, arguments);
    subject.spec.isolation = Isolation::None;
    subject
}

#[test]
fn it_runs_in_the_developers_own_environment() {
    let subject = unsandboxed("echo", &[]);
    let mut agent = subject.spawn();
    expect_echo(&mut agent, "hello");
    assert_eq!(agent.finish(PATIENCE).unwrap().exit, None);
    subject.assert_nothing_left();
}

#[test]
fn it_is_capped_and_ended_all_the_same() {
    let subject = unsandboxed("floods", &["endless"]);
    let mut agent = subject.spawn();
    let outcome = agent
        .read_line(LINE_CAP, Instant::now() + PATIENCE)
        .unwrap();
    assert!(matches!(outcome, ReadLine::TooLong { .. }));
    subject.finish(agent);
    for kind in ["ignores", "group"] {
        let subject = unsandboxed("clings", &[kind]);
        let mut agent = subject.spawn();
        assert_eq!(expect_line(&mut agent), "ready");
        subject.finish(agent);
    }
}

#[test]
fn its_end_is_told_apart_as_well() {
    let end = |arguments: &[&str]| {
        let subject = unsandboxed("ends", arguments);
        let mut agent = subject.spawn();
        assert_eq!(expect_line(&mut agent), "ready");
        let end = subject.end(&mut agent);
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
    let subject = unsandboxed("ends", &["close"]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    let outcome = agent
        .read_line(LINE_CAP, Instant::now() + PATIENCE)
        .unwrap();
    assert!(matches!(outcome, ReadLine::Closed));
    assert_eq!(agent.diagnose_end(Duration::ZERO).unwrap(), None);
    subject.finish(agent);
}

#[test]
fn a_missing_program_is_told_at_once() {
    let mut subject = unsandboxed("echo", &[]);
    subject.spec.command = vec!["no-such-program".into()];
    let outcome = AgentProcess::spawn(&subject.spec);
    assert!(
        matches!(&outcome, Err(SpawnError::Agent(AgentFaultKind::CannotStart { detail }))
            if detail.contains("no-such-program")),
        "{outcome:?}"
    );
}
