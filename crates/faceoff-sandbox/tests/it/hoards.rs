use crate::harness::{LINE_CAP, PATIENCE, Subject, expect_echo, expect_line, has};
use faceoff_sandbox::{Layer, ReadLine};
use faceoff_types::AgentFaultKind;
use std::time::Instant;

fn dies_of_memory(kind: &str) {
    if !has(Layer::CgroupMemory) {
        return;
    }
    let subject = Subject::new("hoards", &[kind]).limits(|limits| limits.memory_bytes = 64 << 20);
    let mut agent = subject.spawn();
    let outcome = agent
        .read_line(LINE_CAP, Instant::now() + PATIENCE)
        .unwrap();
    assert!(matches!(outcome, ReadLine::Closed), "{outcome:?}");
    match subject.end(&mut agent) {
        AgentFaultKind::LimitExceeded { limit, allowed, .. } => {
            assert_eq!(
                (limit.as_str(), allowed.as_str()),
                ("memory", "67108864 bytes")
            );
        }
        other => panic!("{other:?}"),
    }
    let usage = subject.finish(agent);
    let peak = usage.peak_memory_bytes.unwrap();
    assert!((32 << 20..=64 << 20).contains(&peak), "{peak}");
}

#[test]
fn a_memory_bomb_is_ended_and_named() {
    dies_of_memory("memory");
}

#[test]
fn shared_memory_counts() {
    dies_of_memory("shared");
}

#[test]
fn scratch_counts_as_memory_even_in_empty_files() {
    dies_of_memory("inodes");
}

#[test]
fn a_child_that_bursts_takes_only_itself_down() {
    if !has(Layer::CgroupMemory) {
        return;
    }
    let subject =
        Subject::new("hoards", &["child"]).limits(|limits| limits.memory_bytes = 64 << 20);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "9 child");
    expect_echo(&mut agent, "still there");
    assert_eq!(agent.diagnose_end(std::time::Duration::ZERO).unwrap(), None);
    assert_eq!(agent.finish(PATIENCE).unwrap().exit, None);
    subject.assert_nothing_left();
}

fn line_of(kind: &str) -> String {
    let subject = Subject::new("hoards", &[kind]).limits(|limits| {
        limits.open_files = 40;
        limits.file_size_bytes = if kind == "file" { 4 << 20 } else { 64 << 20 };
    });
    let mut agent = subject.spawn();
    let line = expect_line(&mut agent);
    expect_echo(&mut agent, "still there");
    subject.finish(agent);
    line
}

#[test]
fn scratch_and_shared_memory_are_as_large_as_said() {
    assert_eq!(line_of("scratch"), "16 No space left on device");
    assert_eq!(line_of("shm"), "16 No space left on device");
}

#[test]
fn a_file_is_as_large_as_said() {
    assert_eq!(line_of("file"), "4 File too large");
}

#[test]
fn descriptors_run_out_for_the_agent_only() {
    // Three are open already.
    assert_eq!(line_of("descriptors"), "37 Too many open files");
}

#[test]
fn limits_cannot_be_raised_and_no_core_is_dumped() {
    assert_eq!(line_of("limits"), "4 refused");
    // One byte: no dump fits, and a host that pipes dumps to a program does not start it.
    assert_eq!(line_of("core"), "1 core");
}
