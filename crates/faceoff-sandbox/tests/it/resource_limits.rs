//! Limits on memory, scratch space, file size and open files.

use crate::harness::{LINE_CAP, Subject, TIMEOUT, expect_echo, expect_line, has_layer};
use faceoff_sandbox::{Layer, ReadLine};
use faceoff_types::AgentFaultKind;
use std::time::Instant;

/// `kind`: the memory that the test agent `exceeds_limits` fills.
fn assert_memory_limit_kills(kind: &str) {
    if !has_layer(Layer::CgroupMemory) {
        return;
    }
    let subject = Subject::new("exceeds_limits", &[kind])
        .with_limits(|limits| limits.memory_bytes = 64 << 20);
    let mut agent = subject.spawn();
    let outcome = agent.read_line(LINE_CAP, Instant::now() + TIMEOUT).unwrap();
    assert!(matches!(outcome, ReadLine::Closed), "{outcome:?}");
    match subject.wait_for_end(&mut agent) {
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
fn memory_bomb_is_killed_with_its_limit_named() {
    assert_memory_limit_kills("memory");
}

#[test]
fn shared_memory_counts_as_memory() {
    assert_memory_limit_kills("shared");
}

#[test]
fn scratch_counts_as_memory_even_in_empty_files() {
    assert_memory_limit_kills("inodes");
}

#[test]
fn child_over_the_memory_limit_dies_alone() {
    if !has_layer(Layer::CgroupMemory) {
        return;
    }
    let subject = Subject::new("exceeds_limits", &["child"])
        .with_limits(|limits| limits.memory_bytes = 64 << 20);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "9 child"); // the child was ended by signal 9
    expect_echo(&mut agent, "still there");
    assert_eq!(agent.diagnose_end(std::time::Duration::ZERO).unwrap(), None);
    assert_eq!(agent.finish(TIMEOUT).unwrap().exit, None);
    subject.assert_nothing_left();
}

/// The line that the test agent `exceeds_limits` prints: how much of the resource `kind` it got (MiB, or number of files), and the error of
/// the next request.
fn usage_line(kind: &str) -> String {
    let subject = Subject::new("exceeds_limits", &[kind]).with_limits(|limits| {
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
fn scratch_and_shared_memory_have_the_configured_size() {
    assert_eq!(usage_line("scratch"), "16 No space left on device");
    assert_eq!(usage_line("shm"), "16 No space left on device");
}

#[test]
fn file_has_the_configured_maximum_size() {
    assert_eq!(usage_line("file"), "4 File too large");
}

#[test]
fn descriptors_are_limited_per_agent() {
    // The limit is 40, and three descriptors are open already.
    assert_eq!(usage_line("descriptors"), "37 Too many open files");
}

#[test]
fn limits_cannot_be_raised_and_no_core_is_dumped() {
    assert_eq!(usage_line("limits"), "4 refused");
    // One byte: no dump fits, and a host that pipes dumps to a program does not start that program.
    assert_eq!(usage_line("core"), "1 core");
}
