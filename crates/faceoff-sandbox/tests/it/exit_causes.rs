//! Why an agent ended: each cause is reported as the right agent fault, or as a platform fault.

use crate::harness::{LINE_CAP, Subject, TIMEOUT, expect_line, has_layer, is_root};
use faceoff_sandbox::{
    AgentProcess, Isolation, Layer, ReadLine, SandboxError, SpawnError, WriteError,
};
use faceoff_types::AgentFaultKind;
use std::{fs, os::unix::fs::PermissionsExt, time::Instant};

/// Runs the test agent `exits`, which ends as `arguments` say; returns the agent fault and the log.
fn run_to_end(arguments: &[&str]) -> (AgentFaultKind, String) {
    let subject = Subject::new("exits", arguments);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    let outcome = agent.read_line(LINE_CAP, Instant::now() + TIMEOUT).unwrap();
    assert!(matches!(outcome, ReadLine::Closed), "{outcome:?}");
    let end = subject.wait_for_end(&mut agent);
    (end, subject.finish(agent).stderr)
}

#[test]
fn exits_are_reported_with_their_status() {
    assert_eq!(
        run_to_end(&["exit", "0"]).0,
        AgentFaultKind::Exited { code: 0 }
    );
    assert_eq!(
        run_to_end(&["exit", "3"]).0,
        AgentFaultKind::Exited { code: 3 }
    );
    assert_eq!(run_to_end(&["half"]).0, AgentFaultKind::Exited { code: 3 });
}

#[test]
fn crash_leaves_its_traceback_in_the_log() {
    let (end, log) = run_to_end(&["crash"]);
    assert_eq!(end, AgentFaultKind::Exited { code: 1 });
    assert!(
        log.contains("about to crash") && log.contains("RuntimeError: crashed on purpose"),
        "{log}"
    );
}

#[test]
fn signals_are_reported_by_number() {
    assert_eq!(
        run_to_end(&["segfault"]).0,
        AgentFaultKind::Signalled {
            signal: libc::SIGSEGV
        }
    );
    // A namespace's first process cannot raise SIGABRT on itself; the C library then crashes deliberately.
    let AgentFaultKind::Signalled { signal } = run_to_end(&["abort"]).0 else {
        panic!("no signal")
    };
    assert!(
        [libc::SIGABRT, libc::SIGSEGV, libc::SIGILL].contains(&signal),
        "{signal}"
    );
}

#[test]
fn closed_output_of_a_running_agent_is_detected() {
    let subject = Subject::new("exits", &["close"]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    let started = Instant::now();
    let outcome = agent.read_line(LINE_CAP, started + TIMEOUT).unwrap();
    assert!(matches!(outcome, ReadLine::Closed), "{outcome:?}");
    assert_eq!(agent.diagnose_end(std::time::Duration::ZERO).unwrap(), None);
    subject.finish(agent);
}

#[test]
fn write_to_an_ended_agent_fails_as_closed() {
    let subject = Subject::new("exits", &["exit", "4"]);
    let mut agent = subject.spawn();
    assert_eq!(
        subject.wait_for_end(&mut agent),
        AgentFaultKind::Exited { code: 4 }
    );
    let outcome = agent.send_line(b"hello\n");
    assert!(matches!(outcome, Err(WriteError::Closed)), "{outcome:?}");
    // The agent's earlier output is still available.
    assert_eq!(expect_line(&mut agent), "ready");
    subject.finish(agent);
}

/// The description of the agent fault if `command` is not executable. The bundle has the file `echo.py`, a script without an
/// interpreter, and a file that is no program.
fn start_error(command: &[&str]) -> String {
    let mut subject = Subject::new("echo", &[]);
    fs::write(
        subject.bundle.path().join("script"),
        "#!/no/such/interpreter\n",
    )
    .unwrap();
    fs::set_permissions(
        subject.bundle.path().join("script"),
        fs::Permissions::from_mode(0o755),
    )
    .unwrap();
    fs::write(subject.bundle.path().join("rubbish"), "\u{1}\u{2}\u{3}").unwrap();
    fs::set_permissions(
        subject.bundle.path().join("rubbish"),
        fs::Permissions::from_mode(0o755),
    )
    .unwrap();
    subject.spec.command = command.iter().map(|&word| word.to_owned()).collect();
    let fault = match AgentProcess::spawn(&subject.spec) {
        Err(SpawnError::Agent(fault)) => fault,
        Err(SpawnError::Platform(error)) => panic!("{error}"),
        Ok(mut agent) => {
            let outcome = agent.read_line(LINE_CAP, Instant::now() + TIMEOUT).unwrap();
            assert!(matches!(outcome, ReadLine::Closed), "{outcome:?}");
            subject.wait_for_end(&mut agent)
        }
    };
    subject.assert_nothing_left();
    match fault {
        AgentFaultKind::CannotStart { detail } => detail,
        other => panic!("{other:?}"),
    }
}

#[test]
fn command_that_cannot_be_executed_is_an_agent_fault() {
    assert_eq!(start_error(&[]), "the command is empty");
    assert_eq!(
        start_error(&["./missing"]),
        "`./missing` is not in the bundle"
    );
    assert_eq!(
        start_error(&["./echo.py"]),
        "`./echo.py` is not executable (mode 644)"
    );
    let missing = start_error(&["no-such-program"]);
    assert!(
        missing.starts_with(
            "no-such-program: No such file or directory; it is in none of the folders of PATH, /"
        ),
        "{missing}"
    );
    assert_eq!(
        start_error(&["/usr/sbin/no-such"]),
        "/usr/sbin/no-such: No such file or directory"
    );
    let script = start_error(&["./script"]);
    assert!(
        script.starts_with(
            "./script: No such file or directory; it is a script for /no/such/interpreter,"
        ),
        "{script}"
    );
    // A program of the runtime that starts, but cannot run, is an exit.
    let mut subject = Subject::new("echo", &[]);
    subject.spec.command = vec!["python3".into(), "no-such-script.py".into()];
    let mut agent = subject.spawn();
    assert_eq!(
        subject.wait_for_end(&mut agent),
        AgentFaultKind::Exited { code: 2 }
    );
    subject.finish(agent);
}

#[test]
fn invalid_variables_are_an_agent_fault() {
    for (name, value) in [
        ("A\0B", "x"),
        ("A", "x\0y"),
        ("", "x"),
        ("A=B", "x"),
        ("A", &"x".repeat(1 << 20)),
    ] {
        let mut subject = Subject::new("echo", &[]);
        subject.spec.env.insert(name.to_owned(), value.to_owned());
        let outcome = AgentProcess::spawn(&subject.spec);
        assert!(
            matches!(
                &outcome,
                Err(SpawnError::Agent(AgentFaultKind::CannotStart { .. }))
            ),
            "{name:?}: {outcome:?}"
        );
    }
    let mut subject = Subject::new("echo", &[]);
    subject.spec.env.insert(
        "LD_PRELOAD".to_owned(),
        "/agent/no-such-library.so".to_owned(),
    );
    let mut agent = subject.spawn();
    crate::harness::expect_echo(&mut agent, "hello");
    let log = subject.finish(agent).stderr;
    assert!(
        log.contains("no-such-library.so") && !log.contains("bwrap"),
        "{log}"
    );
}

#[test]
fn failed_sandbox_set_up_is_a_platform_fault() {
    let mut subject = Subject::new("echo", &[]);
    subject.spec.bundle_dir = subject.bundle.path().join("nowhere");
    let outcome = AgentProcess::spawn(&subject.spec);
    assert!(
        matches!(&outcome, Err(SpawnError::Platform(SandboxError::Io { .. }))),
        "{outcome:?}"
    );

    let mut subject = Subject::new("echo", &[]);
    subject
        .spec
        .runtime
        .read_only_paths
        .push("/no/such/runtime".into());
    let outcome = AgentProcess::spawn(&subject.spec);
    assert!(
        matches!(&outcome, Err(SpawnError::Platform(SandboxError::Io { .. }))),
        "{outcome:?}"
    );
    subject.assert_nothing_left();

    // A bundle that the agent's user may not enter: bubblewrap fails after its child exists.
    let subject = Subject::new("echo", &[]);
    fs::set_permissions(subject.bundle.path(), fs::Permissions::from_mode(0o000)).unwrap();
    match AgentProcess::spawn(&subject.spec) {
        Err(SpawnError::Platform(_)) => {}
        Err(SpawnError::Agent(fault)) => panic!("{fault}"),
        Ok(mut agent) => {
            // The platform fault shows now or, if bubblewrap ends slowly, afterwards.
            let outcome = agent.read_line(LINE_CAP, Instant::now() + TIMEOUT);
            assert!(
                matches!(outcome, Err(_) | Ok(ReadLine::Closed)),
                "{outcome:?}"
            );
            let end = agent.diagnose_end(TIMEOUT);
            assert!(
                end.is_err(),
                "a platform fault is not an agent fault: {end:?}"
            );
            let error = agent
                .finish(TIMEOUT)
                .expect_err("the sandbox failed")
                .to_string();
            assert!(error.contains("/agent"), "{error}");
        }
    }
    subject.assert_nothing_left();
}

#[test]
fn missing_layer_is_named_and_prevents_the_start() {
    if is_root() || !crate::harness::missing_layers().contains(&Layer::CgroupMemory) {
        println!("this test checks nothing on this host: every layer is available");
        return;
    }
    let mut subject = Subject::new("echo", &[]);
    subject.spec.isolation = Isolation::Sandboxed {
        disabled_layers: Vec::new(),
    };
    match AgentProcess::spawn(&subject.spec) {
        Err(SpawnError::Platform(SandboxError::Unavailable { layer, reason })) => {
            assert_eq!(layer, Layer::CgroupMemory);
            assert!(reason.contains("cannot make a cgroup"), "{reason}");
        }
        other => panic!("{other:?}"),
    }
    assert!(!has_layer(Layer::CgroupMemory));
    subject.assert_nothing_left();
}
