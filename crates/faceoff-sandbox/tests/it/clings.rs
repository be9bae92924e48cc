use crate::harness::{PATIENCE, Subject, expect_line, processes_marked};
use faceoff_types::AgentFaultKind;
use std::time::Duration;

fn is_ended(kind: &str) {
    let subject = Subject::new("clings", &[kind]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    assert!(
        !processes_marked(&subject.mark).is_empty(),
        "the check sees nothing"
    );
    let usage = agent.finish(Duration::from_millis(20)).unwrap();
    assert_eq!(usage.exit, None);
    subject.assert_nothing_left();
}

#[test]
fn an_agent_that_ignores_every_signal_is_ended() {
    is_ended("ignores");
}

#[test]
fn a_daemon_in_a_session_of_its_own_is_ended() {
    is_ended("daemon-stays");
}

#[test]
fn many_children_are_ended() {
    is_ended("group");
}

#[test]
fn a_daemon_does_not_outlive_the_agent_that_left_it() {
    let subject = Subject::new("clings", &["daemon"]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    assert_eq!(
        agent.diagnose_end(PATIENCE).unwrap(),
        Some(AgentFaultKind::Exited { code: 0 })
    );
    // The agent was its namespace's first process: nothing needs to be killed any more.
    assert_eq!(processes_marked(&subject.mark), [] as [i32; 0]);
    subject.finish(agent);
}

#[test]
fn agents_are_ended_with_their_whole_tree_without_namespaces_too() {
    use faceoff_sandbox::{Isolation, Layer};
    for kind in ["ignores", "group", "daemon-stays"] {
        let mut subject = Subject::new("clings", &[kind]);
        let Isolation::Sandboxed { given_up } = &mut subject.spec.isolation else {
            unreachable!()
        };
        if kind == "daemon-stays" && given_up.contains(&Layer::CgroupPids) {
            println!("a daemon can only be found by its cgroup, and this host has none for us");
            continue;
        }
        given_up.push(Layer::Namespaces);
        let mut agent = subject.spawn();
        assert_eq!(expect_line(&mut agent), "ready");
        subject.finish(agent);
    }
}
