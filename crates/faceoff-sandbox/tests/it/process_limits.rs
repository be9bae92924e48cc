//! The limit on processes and threads of an agent.

use crate::harness::{Subject, TIMEOUT, expect_echo, expect_line, has_layer, processes_marked};
use faceoff_sandbox::Layer;
use faceoff_types::AgentFaultKind;

#[test]
fn process_above_the_limit_is_refused() {
    if !has_layer(Layer::CgroupPids) {
        return;
    }
    let subject = Subject::new("forks", &["count"]).with_limits(|limits| limits.pids = 20);
    let mut agent = subject.spawn();
    assert_eq!(
        expect_line(&mut agent),
        "19 Resource temporarily unavailable"
    ); // number of children, and the error of the next fork
    expect_echo(&mut agent, "still there");
    assert!(processes_marked(&subject.mark).len() >= 20);
    subject.finish(agent);
}

#[test]
fn fork_bomb_is_contained_and_killed() {
    if !has_layer(Layer::CgroupPids) {
        return;
    }
    let subject = Subject::new("forks", &["bomb"]).with_limits(|limits| limits.pids = 50);
    let bystander = Subject::new("echo", &[]);
    let mut other = bystander.spawn();
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "lit"); // the fork bomb has started
    // While the fork bomb runs, another agent answers.
    for number in 0..100 {
        expect_echo(&mut other, &number.to_string());
    }
    drop(other);
    subject.finish(agent);
    bystander.assert_nothing_left();
}

#[test]
fn exit_after_refused_processes_names_the_limit() {
    if !has_layer(Layer::CgroupPids) {
        return;
    }
    let subject = Subject::new("forks", &["exit"]).with_limits(|limits| limits.pids = 10);
    let mut agent = subject.spawn();
    expect_line(&mut agent);
    let end = agent.diagnose_end(TIMEOUT).unwrap();
    assert!(
        matches!(&end, Some(AgentFaultKind::LimitExceeded { limit, allowed, .. })
            if limit == "processes" && allowed == "10"),
        "{end:?}"
    );
    subject.finish(agent);
}
