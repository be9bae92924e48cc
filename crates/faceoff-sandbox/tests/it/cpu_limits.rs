//! CPU limits: an agent stays on its CPUs, within its quota, and its CPU time is measured.

use crate::harness::{Subject, expect_echo, expect_line, has_layer, processes_marked};
use faceoff_sandbox::{Layer, affinity};
use std::fs;

#[test]
fn agent_stays_on_its_cpus_and_is_accounted() {
    let mut subject = Subject::new("moves_cpu", &[]);
    // The last CPU that this process may use.
    let cpu = *affinity::allowed_cpus().unwrap().last().unwrap();
    subject.spec.cpus = vec![cpu];
    let mut agent = subject.spawn();
    let report: serde_json::Value = serde_json::from_str(&expect_line(&mut agent)).unwrap();
    // The agent's own number of its only CPU is 0.
    assert_eq!(report["before"], serde_json::json!([0]));
    assert_eq!(report["after"], serde_json::json!([0]), "{report}");
    let processes = processes_marked(&subject.mark);
    assert!(!processes.is_empty());
    for pid in processes {
        let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
        let on_host = format!("Cpus_allowed_list:\t{cpu}\n");
        assert!(status.contains(&on_host), "{status}");
    }
    if has_layer(Layer::CgroupCpu) {
        let used = agent.cpu_time_s().unwrap();
        // The test agent computes for this long before it answers.
        assert!(used >= 0.2, "{used}");
        expect_echo(&mut agent, "more");
        assert!(agent.cpu_time_s().unwrap() >= used);
    }
    subject.finish(agent);
}

#[test]
fn agent_on_all_cpus_is_limited_to_its_quota() {
    if !has_layer(Layer::CgroupCpu) {
        return;
    }
    let subject = Subject::new("moves_cpu", &[]).with_limits(|limits| limits.cpus = 0.25);
    let mut agent = subject.spawn();
    let started = std::time::Instant::now();
    let used_before = agent.cpu_time_s().unwrap();
    expect_line(&mut agent);
    let used = agent.cpu_time_s().unwrap() - used_before;
    // The test bounds the share, not the time, so it also passes on a slow host. One period of the quota (10 ms) may have begun before
    // the measurement, and one may be counted in full at its end.
    let share = used / (started.elapsed().as_secs_f64() + 0.02);
    assert!(share <= 0.27, "{share} of a CPU");
    subject.finish(agent);
}
