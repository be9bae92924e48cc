//! Agents that print too much, or read nothing: lines and log are cut, and deadlines hold.

use crate::harness::{LINE_CAP, Subject, TIMEOUT, expect_echo, expect_line};
use faceoff_sandbox::ReadLine;
use std::time::Instant;

#[test]
fn endless_line_is_reported_as_too_long() {
    let subject = Subject::new("floods", &["endless"]);
    let mut agent = subject.spawn();
    match agent.read_line(LINE_CAP, Instant::now() + TIMEOUT).unwrap() {
        ReadLine::TooLong { head } => {
            assert!(head.len() <= 1024 && head.iter().all(|byte| *byte == b'x'))
        }
        other => panic!("{other:?}"),
    }
    subject.finish(agent);
}

#[test]
fn output_flood_is_read_only_on_demand() {
    let subject = Subject::new("floods", &["both"]);
    let mut agent = subject.spawn();
    for _ in 0..1000 {
        assert_eq!(expect_line(&mut agent).len(), 99);
    }
    // More output is in the socket, or about to be written.
    while !agent.has_pending_output().unwrap() {
        std::thread::yield_now();
    }
    assert!(agent.stderr().len() <= 64 << 10);
    subject.finish(agent);
}

#[test]
fn log_flood_blocks_no_answer_and_log_stays_bounded() {
    let subject =
        Subject::new("floods", &["stderr"]).with_limits(|limits| limits.stderr_kept_bytes = 1000);
    let mut agent = subject.spawn();
    for number in 0..200 {
        expect_echo(&mut agent, &number.to_string());
    }
    while !agent.stderr().contains("are left out here") {
        std::thread::yield_now();
    }
    let usage = subject.finish(agent);
    let length = usage.stderr.len();
    assert!((900..=1000).contains(&length), "{length}");
}

#[test]
fn agent_that_does_not_read_meets_its_deadline() {
    use std::time::Duration;
    let subject = Subject::new("exits", &["deaf"]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    let line = vec![b'x'; 1 << 20];
    agent.send_line(&line).unwrap();
    assert!(!agent.is_all_sent());
    let outcome = agent.read_line(LINE_CAP, Instant::now() + Duration::from_millis(50));
    assert!(matches!(outcome, Ok(ReadLine::TimedOut)), "{outcome:?}");
    assert!(!agent.is_all_sent());
    subject.finish(agent);
}
