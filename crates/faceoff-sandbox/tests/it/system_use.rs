//! What programs and runtimes of all languages expect of a system, and isolation allows: `tests/agents/uses_system.py` tries it.

use crate::harness::{Subject, TIMEOUT, expect_line, has_layer};
use faceoff_sandbox::{Layer, affinity};
use std::collections::BTreeMap;

const MEMORY_BYTES: u64 = 512 << 20;

#[test]
fn programs_find_an_ordinary_system() {
    if !has_layer(Layer::CgroupMemory) {
        return;
    }
    let all = affinity::allowed_cpus().unwrap();
    // The last CPU, whose number is not 0 on a host with several.
    for cpus in [&all[all.len() - 1..], &all[..], &[]] {
        let memory = MEMORY_BYTES.to_string();
        let mut subject = Subject::new("uses_system", &[&memory])
            .with_limits(|limits| (limits.memory_bytes, limits.cpus) = (MEMORY_BYTES, 2.0));
        subject.spec.cpus = cpus.to_vec();
        let mut agent = subject.spawn();
        let line = expect_line(&mut agent);
        let found: BTreeMap<String, String> = serde_json::from_str(&line).unwrap();
        for (task, answer) in &found {
            assert_eq!(answer, "ok", "{task} on {cpus:?}");
        }
        assert!(found.len() >= 12, "{found:?}");
        let usage = agent.finish(TIMEOUT).unwrap();
        // It ended with status 0.
        assert_eq!(usage.exit, None, "{}", usage.stderr);
        // By each of `/dev/stderr`, `/proc/self/fd/2` and `/dev/fd/2`.
        assert_eq!(
            usage.stderr.matches("written by path").count(),
            3,
            "{}",
            usage.stderr
        );
        assert!(
            usage.stderr.contains("written by shell"),
            "{}",
            usage.stderr
        );
        subject.assert_nothing_left();
    }
}
