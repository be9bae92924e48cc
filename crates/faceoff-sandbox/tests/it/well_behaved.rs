use crate::harness::{PATIENCE, Subject, expect_line};
use std::time::Instant;

#[test]
fn an_agent_answers_line_by_line_and_leaves_cleanly() {
    let subject = Subject::python("echo");
    let mut agent = subject.spawn().unwrap();
    for question in ["one", "two", "three"] {
        let written = agent
            .write_line(
                format!("{question}\n").as_bytes(),
                Instant::now() + PATIENCE,
            )
            .unwrap();
        assert!(written <= Instant::now());
        assert_eq!(expect_line(&mut agent), question);
        assert!(!agent.has_pending_output().unwrap());
    }
    let usage = agent.finish(PATIENCE).unwrap();
    assert_eq!(usage.exit, None);
    println!("{usage:?}");
}
