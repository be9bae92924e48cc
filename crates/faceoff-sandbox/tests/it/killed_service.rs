//! When a service (here a child process of the test that starts agents) is killed, its agents die with it, and the next service removes the
//! remains.

use crate::harness::{Subject, TIMEOUT, agent_cgroups, expect_line, processes_marked};
use faceoff_sandbox::{AgentProcess, remove_remains_of_dead_services};
use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    process::{Pid, PidfdFlags, pidfd_open},
};
use std::{
    io::{BufRead, BufReader},
    process::{Command, Stdio},
};

/// In cgroup version 1 a frozen process does not die, so the removal must thaw it.
#[test]
fn frozen_agent_of_a_killed_service_is_removed() {
    assert_ends_with_its_service("killed_service::service_waits_with_a_frozen_agent", true);
}

#[test]
fn agent_of_a_killed_service_dies_with_its_cgroup() {
    assert_ends_with_its_service("killed_service::service_waits_with_an_agent", false);
}

/// Starts the ignored test `service` in a child process, kills it, and checks that its agent ends. `needs_removal`: the agent ends only
/// when the next service, at its start, removes the remains of dead ones.
fn assert_ends_with_its_service(service: &str, needs_removal: bool) {
    let mut service = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", service, "--ignored", "--nocapture"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut output = BufReader::new(service.stdout.take().unwrap()).lines();
    let mark = output
        .find_map(|line| Some(line.unwrap().split_once("the mark is ")?.1.to_owned()))
        .expect("the service started its agents");
    let agents: Vec<_> = processes_marked(&mark)
        .into_iter()
        .map(|pid| pidfd_open(Pid::from_raw(pid).unwrap(), PidfdFlags::empty()).unwrap())
        .collect();
    assert!(agents.len() >= 3, "a daemon, its parent and bubblewrap");
    let prefix = format!("agent-{}-", service.id());
    let remaining_cgroups = || {
        agent_cgroups()
            .into_iter()
            .filter(|path| path.to_string_lossy().contains(&prefix))
            .collect::<Vec<_>>()
    };
    let had_cgroups = !remaining_cgroups().is_empty();

    service.kill().unwrap();
    service.wait().unwrap();
    if needs_removal {
        remove_remains_of_dead_services();
    }
    let timeout = Timespec {
        tv_sec: TIMEOUT.as_secs().try_into().unwrap(),
        tv_nsec: 0,
    };
    for agent in &agents {
        assert_eq!(
            poll(&mut [PollFd::new(agent, PollFlags::IN)], Some(&timeout)),
            Ok(1),
            "an agent still lives"
        );
    }
    assert_eq!(processes_marked(&mark), [] as [i32; 0]);
    if had_cgroups {
        // Another test process may have removed them in the meantime, since each one does at its first spawn.
        remove_remains_of_dead_services();
        assert_eq!(remaining_cgroups(), [] as [std::path::PathBuf; 0]);
    }
}

#[test]
#[ignore = "no test: the service that a test above starts and kills"]
fn service_waits_with_an_agent() {
    run_service(|_| {});
}

#[test]
#[ignore = "no test: the service that a test above starts and kills"]
fn service_waits_with_a_frozen_agent() {
    run_service(|agent| {
        // Without a freezer the test checks an unfrozen agent.
        agent.freeze();
    });
}

fn run_service(before_waiting: impl FnOnce(&mut AgentProcess)) {
    let subject = Subject::new("resists_kill", &["daemon-stays"]);
    // The agent must not depend on the thread that started it.
    let mut agent = std::thread::scope(|scope| scope.spawn(|| subject.spawn()).join().unwrap());
    assert_eq!(expect_line(&mut agent), "ready");
    before_waiting(&mut agent);
    println!("the mark is {}", subject.mark);
    // Waits until this process or its parent is killed.
    let _ = std::io::stdin().read_line(&mut String::new());
}
