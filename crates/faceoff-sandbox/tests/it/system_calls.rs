//! The system calls that the seccomp filter refuses. The test program knows the system call numbers of this architecture only.
#![cfg(target_arch = "x86_64")]

use crate::harness::Subject;
use faceoff_sandbox::{Isolation, Layer};
use std::collections::BTreeMap;

fn answers(subject: &Subject) -> BTreeMap<String, String> {
    serde_json::from_value(subject.report()).unwrap()
}

#[test]
fn dangerous_system_calls_are_refused() {
    let mut answers = answers(&Subject::new("system_calls", &[]));
    for unknown in ["clone3", "newer_than_known", "x32_getpid"] {
        assert_eq!(
            answers.remove(unknown).as_deref(),
            Some("ENOSYS"),
            "{unknown}"
        );
    }
    // Success without effect: the parent-death signal stays set.
    assert_eq!(answers.remove("parent_death_signal").as_deref(), Some("9"));
    assert!(answers.len() > 40);
    for (call, answer) in answers {
        assert_eq!(answer, "EPERM", "{call}");
    }
}

#[test]
fn refusals_come_from_the_filter() {
    // Without the filter these calls succeed, or fail for another reason.
    let mut subject = Subject::new("system_calls", &[]);
    let Isolation::Sandboxed { disabled_layers } = &mut subject.spec.isolation else {
        unreachable!()
    };
    disabled_layers.push(Layer::Seccomp);
    let answers = answers(&subject);
    assert_eq!(answers["parent_death_signal"], "0");
    for call in [
        "ptrace",
        "process_vm_readv",
        "process_vm_writev",
        "kcmp",
        "keyctl",
        "personality",
        "sched_setattr",
        "name_to_handle_at",
        "seccomp",
        "socket_netlink_diagnosis",
        "clone3",
        "newer_than_known",
    ] {
        assert!(
            !["EPERM", "ENOSYS"].contains(&answers[call].as_str()),
            "{call}: {}",
            answers[call]
        );
    }
}

#[test]
fn filter_works_without_namespaces() {
    let mut subject = Subject::new("system_calls", &[]);
    let Isolation::Sandboxed { disabled_layers } = &mut subject.spec.isolation else {
        unreachable!()
    };
    disabled_layers.push(Layer::Namespaces);
    let answers = answers(&subject);
    for call in [
        "ptrace",
        "unshare_user",
        "clone_newuser",
        "mount",
        "bpf",
        "keyctl",
        "socket_raw",
    ] {
        assert_eq!(answers[call], "EPERM", "{call}");
    }
}
