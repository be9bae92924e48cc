//! The number of CPUs that an agent finds: exactly those on which it may run, by every interface.

use crate::harness::Subject;
use faceoff_sandbox::affinity;
use serde_json::json;

/// Report of an agent on these CPUs with this CPU quota.
fn report(cpus: &[usize], quota: f64) -> serde_json::Value {
    let mut subject = Subject::new("counts_cpus", &[]).with_limits(|limits| limits.cpus = quota);
    subject.spec.cpus = cpus.to_vec();
    subject.report()
}

#[test]
fn agent_finds_its_cpus_by_every_interface() {
    let all = affinity::allowed_cpus().unwrap();
    let last = &all[all.len() - 1..];
    // The last CPU, which the agent sees as number 0.
    for (cpus, quota, threads) in [
        (last, 1.0, 1),
        (last, 64.0, 1),
        (&all[..], 64.0, all.len()),
        (&all[..], 1.0, 1),
    ] {
        let report = report(cpus, quota);
        let numbers: Vec<_> = (0..cpus.len()).collect();
        assert_eq!(report["count"], cpus.len(), "{report}");
        assert_eq!(report["configured"], cpus.len(), "{report}");
        for interface in [
            "affinity", "online", "possible", "present", "cpuinfo", "stat",
        ] {
            assert_eq!(report[interface], json!(numbers), "{interface}: {report}");
        }
        assert_eq!(report["threads"], json!([threads.to_string()]), "{report}");
        assert_eq!(report["system"], json!(["online", "possible", "present"]));
    }
    assert_eq!(report(&[], 64.0), report(&all, 64.0), "bound to none");
}

#[test]
fn bundle_may_set_its_number_of_threads() {
    let mut subject = Subject::new("counts_cpus", &[]);
    for name in [
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "BLIS_NUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "RAYON_NUM_THREADS",
    ] {
        subject.spec.env.insert(name.to_owned(), "7".to_owned());
    }
    // `threads` has the distinct values of these variables.
    assert_eq!(subject.report()["threads"], json!(["7"]));
}
