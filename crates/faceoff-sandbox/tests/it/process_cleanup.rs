//! All processes of an agent are killed with it, whatever they do against it.

use crate::harness::{Subject, TIMEOUT, expect_line, processes_marked};
use faceoff_types::AgentFaultKind;
use std::time::Duration;

/// `kind`: what the test agent `resists_kill` does against its end.
fn assert_is_killed(kind: &str) {
    let subject = Subject::new("resists_kill", &[kind]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    assert!(
        !processes_marked(&subject.mark).is_empty(),
        "the check finds no process"
    );
    let usage = agent.finish(Duration::from_millis(20)).unwrap();
    assert_eq!(usage.exit, None);
    subject.assert_nothing_left();
}

#[test]
fn agent_that_ignores_every_signal_is_killed() {
    assert_is_killed("ignores");
}

#[test]
fn daemon_in_its_own_session_is_killed() {
    assert_is_killed("daemon-stays");
}

#[test]
fn many_children_are_killed() {
    assert_is_killed("group");
}

#[test]
fn daemon_does_not_outlive_its_agent() {
    let subject = Subject::new("resists_kill", &["daemon"]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    assert_eq!(
        agent.diagnose_end(TIMEOUT).unwrap(),
        Some(AgentFaultKind::Exited { code: 0 })
    );
    // The agent was its namespace's first process, so its end has killed all others.
    assert_eq!(processes_marked(&subject.mark), [] as [i32; 0]);
    subject.finish(agent);
}

#[test]
fn process_tree_is_killed_without_namespaces() {
    use faceoff_sandbox::{Isolation, Layer};
    for kind in ["ignores", "group", "daemon-stays"] {
        let mut subject = Subject::new("resists_kill", &[kind]);
        let Isolation::Sandboxed { disabled_layers } = &mut subject.spec.isolation else {
            unreachable!()
        };
        if kind == "daemon-stays" && disabled_layers.contains(&Layer::CgroupPids) {
            println!("a daemon can be found only by its cgroup, which this host does not offer");
            continue;
        }
        disabled_layers.push(Layer::Namespaces);
        let mut agent = subject.spawn();
        assert_eq!(expect_line(&mut agent), "ready");
        subject.finish(agent);
    }
}
