use crate::harness::{LINE_CAP, PATIENCE, Subject, expect_echo, expect_line, has};
use faceoff_sandbox::{Layer, ReadLine};
use std::time::{Duration, Instant};

#[test]
fn an_agent_answers_line_by_line_and_leaves_cleanly() {
    let subject = Subject::new("echo", &[]);
    let mut agent = subject.spawn();
    for question in ["one", "two", "three"] {
        let before = Instant::now();
        agent.send_line(format!("{question}\n").as_bytes()).unwrap();
        let ReadLine::Line { bytes, at } = agent.read_line(LINE_CAP, before + PATIENCE).unwrap()
        else {
            panic!("no line")
        };
        assert_eq!(bytes, question.as_bytes());
        assert!(before <= at && at <= Instant::now());
        assert!(!agent.has_pending_output().unwrap());
    }
    let usage = agent.finish(PATIENCE).unwrap();
    assert_eq!(usage.exit, None);
    if has(Layer::CgroupMemory) {
        let peak = usage.peak_memory_bytes.unwrap();
        assert!((1 << 20..256 << 20).contains(&peak), "{peak}");
        assert!(usage.cpu_time_s.unwrap() > 0.0);
    }
    subject.assert_nothing_left();
}

#[test]
fn the_largest_line_passes_both_ways() {
    let subject = Subject::new("echo", &[]);
    let mut agent = subject.spawn();
    expect_echo(&mut agent, &"x".repeat(LINE_CAP));
    expect_echo(&mut agent, "");
    subject.finish(agent);
}

#[test]
fn an_answer_before_the_question_is_noticed() {
    let subject = Subject::new("echo", &[]);
    let mut agent = subject.spawn();
    agent.send_line(b"one\ntwo\n").unwrap();
    assert_eq!(expect_line(&mut agent), "one");
    // The second answer is in the buffer, in the pipe, or about to be written.
    let mut pending = agent.has_pending_output().unwrap();
    while !pending {
        std::thread::yield_now();
        pending = agent.has_pending_output().unwrap();
    }
    assert_eq!(expect_line(&mut agent), "two");
    assert!(!agent.has_pending_output().unwrap());
    subject.finish(agent);
}

#[test]
fn a_silent_agent_meets_its_deadline_and_can_still_answer_later() {
    let subject = Subject::new("echo", &[]);
    let mut agent = subject.spawn();
    expect_echo(&mut agent, "hello");
    let outcome = agent
        .read_line(LINE_CAP, Instant::now() + Duration::from_millis(250))
        .unwrap();
    assert!(matches!(outcome, ReadLine::TimedOut));
    assert_eq!(agent.diagnose_end(Duration::ZERO).unwrap(), None);
    expect_echo(&mut agent, "still there");
    subject.finish(agent);
}

#[test]
fn dropping_an_agent_is_enough() {
    let subject = Subject::new("echo", &[]);
    let mut agent = subject.spawn();
    expect_echo(&mut agent, "hello");
    drop(agent);
    subject.assert_nothing_left();
}

#[test]
fn an_honest_agent_has_processes_threads_shared_memory_and_a_scratch_folder() {
    let report = Subject::new("works", &[]).report();
    let expected = serde_json::json!({
        "pool": [0, 1, 4, 9, 16], "thread": [49], "loop": "6", "shared_memory": 42, "file": 1000,
        "shell": "/tmp", "c_library": 3, "random": 8, "home": "/tmp",
    });
    assert_eq!(report, expected);
}
