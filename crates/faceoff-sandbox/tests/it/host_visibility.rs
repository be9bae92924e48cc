//! What an agent sees of the host: its bundle and its runtime, no other files, processes, users or rights.

use crate::harness::{Subject, expect_echo, is_root, processes_marked};
use faceoff_sandbox::{AgentProcess, Isolation, Layer, SandboxError, SpawnError};
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    os::unix::fs::PermissionsExt,
};

#[test]
fn agent_sees_only_its_bundle_and_runtime() {
    // Another team's bundle and the database, readable by every user.
    let host = tempfile::tempdir().unwrap();
    fs::set_permissions(host.path(), fs::Permissions::from_mode(0o777)).unwrap();
    let other_bundle = host.path().join("other-bundle");
    fs::create_dir(&other_bundle).unwrap();
    fs::write(other_bundle.join("agent.py"), "secret").unwrap();
    let database = host.path().join("faceoff.db");
    fs::write(&database, "secret").unwrap();
    let hidden = [
        host.path().to_str().unwrap(),
        other_bundle.to_str().unwrap(),
        database.to_str().unwrap(),
        env!("CARGO_MANIFEST_DIR"),
    ];
    let mut subject = Subject::new("reads_host", &hidden);
    subject.spec.env = BTreeMap::from([("TEAM".to_owned(), "red".to_owned())]);
    let report = subject.report();

    assert_eq!(report["reached"], serde_json::json!([]));
    let names = |key: &str| -> Vec<String> {
        let names: Vec<String> = serde_json::from_value(report[key].clone()).unwrap();
        // Python sets this variable itself if the locale is C; the sandbox sets all others.
        names
            .into_iter()
            .filter(|name| name != "LC_CTYPE")
            .collect()
    };
    let expected = [
        "BLIS_NUM_THREADS",
        "HOME",
        "LANG",
        "LOGNAME",
        "MKL_NUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "ORT_DISABLE_TELEMETRY",
        "PATH",
        "PWD",
        "RAYON_NUM_THREADS",
        "TEAM",
        "TMPDIR",
        "USER",
    ];
    assert_eq!(names("environment"), expected);
    assert_eq!(names("environs"), expected);
    // The first process is bubblewrap's, which reaps others.
    assert_eq!(report["processes"], serde_json::json!(["1", "2"]));
    // Its memory, with which an agent could forge its exit, is out of reach.
    assert_eq!(report["init"], serde_json::json!([]));
    assert_eq!(report["directory"], "/agent");
    assert_eq!(report["bundle"], serde_json::json!(["reads_host.py"]));
    assert_eq!(report["passwd"], "agent:x:1000:1000:agent:/tmp:/bin/sh\n");
    for entry in report["etc"].as_array().unwrap() {
        assert!(
            [
                "alternatives",
                "group",
                "hostname",
                "hosts",
                "ld.so.cache",
                "nsswitch.conf",
                "passwd"
            ]
            .contains(&entry.as_str().unwrap()),
            "{entry}"
        );
    }
    for entry in report["root"].as_array().unwrap() {
        let known = [
            "agent", "bin", "dev", "etc", "lib", "lib32", "lib64", "libx32", "proc", "sys", "tmp",
            "usr",
        ];
        assert!(known.contains(&entry.as_str().unwrap()), "{entry}");
    }
}

#[test]
fn agent_has_no_rights_terminal_or_extra_descriptors() {
    // A file that the service has open without CLOEXEC.
    let inheritable = std::fs::File::open("/etc/passwd").unwrap();
    rustix::io::fcntl_setfd(&inheritable, rustix::io::FdFlags::empty()).unwrap();
    let report = Subject::new("reads_host", &[]).report();
    assert_eq!(report["uid"], 1000);
    let groups = report["groups"].as_array().unwrap();
    assert!(groups.iter().all(|group| group == 65_534), "{groups:?}");
    let status = &report["status"];
    for set in ["CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb"] {
        assert_eq!(status[set], "0000000000000000", "{set}");
    }
    assert_eq!(status["NoNewPrivs"], "1");
    assert_eq!(status["Seccomp"], "2");
    assert_eq!(report["terminal"], serde_json::Value::Null);
    assert_eq!(report["session_is_own"], true);
    assert_eq!(report["other_descriptors"], serde_json::json!([]));
    for (descriptor, kind) in ["socket:", "socket:", "pipe:"].into_iter().enumerate() {
        let found = report["descriptors"][descriptor].as_str().unwrap();
        assert!(found.starts_with(kind), "{descriptor}: {found}");
    }
}

/// The host users of the agent's processes.
fn host_users(subject: &Subject) -> BTreeSet<u32> {
    use std::os::unix::fs::MetadataExt;
    let mut agent = subject.spawn();
    expect_echo(&mut agent, "hello");
    let users = processes_marked(&subject.mark)
        .into_iter()
        .map(|pid| fs::metadata(format!("/proc/{pid}")).unwrap().uid())
        .collect();
    subject.finish(agent);
    users
}

#[test]
fn agents_are_unprivileged_and_distinct_users() {
    let subjects = [Subject::new("echo", &[]), Subject::new("echo", &[])];
    let users = subjects.each_ref().map(host_users);
    let own = rustix::process::geteuid().as_raw();
    for users in &users {
        assert_eq!(users.len(), 1, "bubblewrap and the agent are the same user");
        assert!(!users.contains(&0));
        assert_eq!(users.contains(&own), !is_root());
    }
    assert_eq!(users[0] == users[1], !is_root());
}

/// An echo agent whose bundle is in a folder that only the service may enter.
fn private_bundle() -> (Subject, tempfile::TempDir) {
    let mut subject = Subject::new("echo", &[]);
    let private = tempfile::tempdir().unwrap();
    fs::set_permissions(private.path(), fs::Permissions::from_mode(0o700)).unwrap();
    let bundle = private.path().join("bundle");
    fs::create_dir(&bundle).unwrap();
    fs::set_permissions(&bundle, fs::Permissions::from_mode(0o755)).unwrap();
    fs::copy(
        subject.bundle.path().join("echo.py"),
        bundle.join("echo.py"),
    )
    .unwrap();
    subject.spec.bundle_dir = bundle;
    (subject, private)
}

#[test]
fn bundle_in_a_private_folder_is_visible_to_its_agent() {
    let (subject, _private) = private_bundle();
    let mut agent = subject.spawn();
    expect_echo(&mut agent, "hello");
    subject.finish(agent);
}

#[test]
fn unreachable_bundle_is_a_platform_fault() {
    let (mut subject, _private) = private_bundle();
    let Isolation::Sandboxed { disabled_layers } = &mut subject.spec.isolation else {
        unreachable!()
    };
    disabled_layers.push(Layer::Namespaces);
    match AgentProcess::spawn(&subject.spec) {
        Err(SpawnError::Platform(SandboxError::Unavailable {
            layer: Layer::Namespaces,
            ..
        })) if is_root() => {}
        Ok(agent) if !is_root() => {
            subject.finish(agent);
        }
        other => panic!("{other:?}"),
    }
    subject.assert_nothing_left();
}
