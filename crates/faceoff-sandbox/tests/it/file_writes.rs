//! An agent can write only to its scratch folders.

use crate::harness::Subject;
use std::fs;

#[test]
fn agent_writes_only_to_its_scratch() {
    let host = tempfile::tempdir().unwrap();
    let subject = Subject::new("writes_files", &[host.path().to_str().unwrap()]);
    let report = subject.report();
    assert_eq!(report["took"], serde_json::json!(["/dev/shm", "/tmp"]));
    assert_eq!(report["changed"], serde_json::json!([]));
    assert_eq!(fs::read_dir(host.path()).unwrap().count(), 0);
    assert_eq!(fs::read_dir(subject.bundle.path()).unwrap().count(), 1);
}
