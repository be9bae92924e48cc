//! An ordinary agent: it answers line by line, may be silent for a while, and can use processes, threads and files.

use crate::harness::{LINE_CAP, Subject, TIMEOUT, expect_echo, expect_line, has_layer};
use faceoff_sandbox::{Layer, ReadLine};
use std::time::{Duration, Instant};

#[test]
fn agent_answers_line_by_line_and_exits_cleanly() {
    let subject = Subject::new("echo", &[]);
    let mut agent = subject.spawn();
    for question in ["one", "two", "three"] {
        let before = Instant::now();
        agent.send_line(format!("{question}\n").as_bytes()).unwrap();
        let ReadLine::Line { bytes, received_at } =
            agent.read_line(LINE_CAP, before + TIMEOUT).unwrap()
        else {
            panic!("no line")
        };
        assert_eq!(bytes, question.as_bytes());
        assert!(before <= received_at && received_at <= Instant::now());
        assert!(!agent.has_pending_output().unwrap());
    }
    let usage = agent.finish(TIMEOUT).unwrap();
    assert_eq!(usage.exit, None);
    if has_layer(Layer::CgroupMemory) {
        let peak = usage.peak_memory_bytes.unwrap();
        assert!((1 << 20..256 << 20).contains(&peak), "{peak}");
        assert!(usage.cpu_time_s.unwrap() > 0.0);
    }
    subject.assert_nothing_left();
}

#[test]
fn largest_line_passes_in_both_directions() {
    let subject = Subject::new("echo", &[]);
    let mut agent = subject.spawn();
    expect_echo(&mut agent, &"x".repeat(LINE_CAP));
    expect_echo(&mut agent, "");
    subject.finish(agent);
}

#[test]
fn output_before_a_question_is_detected() {
    let subject = Subject::new("echo", &[]);
    let mut agent = subject.spawn();
    agent.send_line(b"one\ntwo\n").unwrap();
    assert_eq!(expect_line(&mut agent), "one");
    // The second answer is in the buffer, in the socket, or about to be written.
    let mut pending = agent.has_pending_output().unwrap();
    while !pending {
        std::thread::yield_now();
        pending = agent.has_pending_output().unwrap();
    }
    assert_eq!(expect_line(&mut agent), "two");
    assert!(!agent.has_pending_output().unwrap());
    subject.finish(agent);
}

/// The agent prints to all of its files; the answers come from file descriptor 4 only.
#[test]
fn standard_output_may_be_the_log() {
    use faceoff_sandbox::Isolation;
    let script = "echo printed; echo logged >&2; read -r empty && echo 'standard input has a line'; \
                  while read -r line <&3; do echo \"$line\" >&4; done; echo end";
    for isolation in [None, Some(Isolation::None)] {
        let mut subject = Subject::new("echo", &[]);
        subject.spec.command = ["sh", "-c", script, &subject.mark]
            .map(str::to_owned)
            .to_vec();
        subject.spec.logs_output = true;
        subject.spec.isolation = isolation.unwrap_or(subject.spec.isolation);
        let mut agent = subject.spawn();
        expect_echo(&mut agent, "question");
        let usage = agent.finish(TIMEOUT).unwrap();
        assert_eq!(usage.stderr, "printed\nlogged\nend\n");
        assert_eq!(usage.exit, None);
        subject.assert_nothing_left();
    }
}

#[test]
fn silent_agent_times_out_and_can_answer_later() {
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
fn dropping_an_agent_kills_it() {
    let subject = Subject::new("echo", &[]);
    let mut agent = subject.spawn();
    expect_echo(&mut agent, "hello");
    drop(agent);
    subject.assert_nothing_left();
}

#[test]
fn agent_has_processes_threads_shared_memory_and_scratch() {
    let report = Subject::new("normal_operation", &[]).report();
    let expected = serde_json::json!({
        "pool": [0, 1, 4, 9, 16], "thread": [49], "loop": "6", "shared_memory": 42, "file": 1000,
        "shell": "/tmp", "c_library": 3, "random": 8, "home": "/tmp",
    });
    assert_eq!(report, expected);
}
