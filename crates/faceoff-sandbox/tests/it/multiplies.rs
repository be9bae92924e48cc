use crate::harness::{PATIENCE, Subject, expect_echo, expect_line, has, processes_marked};
use faceoff_sandbox::Layer;
use faceoff_types::AgentFaultKind;

#[test]
fn processes_are_counted_and_the_last_one_is_refused() {
    if !has(Layer::CgroupPids) {
        return;
    }
    let subject = Subject::new("multiplies", &["count"]).limits(|limits| limits.pids = 20);
    let mut agent = subject.spawn();
    assert_eq!(
        expect_line(&mut agent),
        "19 Resource temporarily unavailable"
    );
    expect_echo(&mut agent, "still there");
    assert!(processes_marked(&subject.mark).len() >= 20);
    subject.finish(agent);
}

#[test]
fn a_fork_bomb_is_contained_and_ended() {
    if !has(Layer::CgroupPids) {
        return;
    }
    let subject = Subject::new("multiplies", &["bomb"]).limits(|limits| limits.pids = 50);
    let bystander = Subject::new("echo", &[]);
    let mut other = bystander.spawn();
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "lit");
    // The bomb burns; the neighbour answers.
    for number in 0..100 {
        expect_echo(&mut other, &number.to_string());
    }
    drop(other);
    subject.finish(agent);
    bystander.assert_nothing_left();
}

#[test]
fn an_agent_that_fails_for_want_of_processes_is_told_so() {
    if !has(Layer::CgroupPids) {
        return;
    }
    let subject = Subject::new("multiplies", &["exit"]).limits(|limits| limits.pids = 10);
    let mut agent = subject.spawn();
    expect_line(&mut agent);
    let end = agent.diagnose_end(PATIENCE).unwrap();
    assert!(
        matches!(&end, Some(AgentFaultKind::LimitExceeded { limit, allowed, .. })
            if limit == "processes" && allowed == "10"),
        "{end:?}"
    );
    subject.finish(agent);
}
