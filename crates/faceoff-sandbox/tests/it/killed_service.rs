//! A service that is killed takes its agents with it, and the next one cleans up.

use crate::harness::{PATIENCE, Subject, agent_cgroups, expect_line, processes_marked};
use faceoff_sandbox::{AgentProcess, sweep_stale};
use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    process::{Pid, PidfdFlags, pidfd_open},
};
use std::{
    io::{BufRead, BufReader},
    process::{Command, Stdio},
};

/// Version 1 of the cgroup interface lets nobody die who is frozen.
#[test]
fn frozen_agent_of_a_killed_service_is_swept() {
    is_ended_with_its_service(
        "killed_service::a_service_that_waits_with_a_frozen_agent",
        true,
    );
}

#[test]
fn an_agent_dies_with_a_killed_service_and_its_cgroup_is_swept() {
    is_ended_with_its_service("killed_service::a_service_that_waits", false);
}

fn is_ended_with_its_service(service: &str, by_the_sweep: bool) {
    let mut service = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", service, "--ignored", "--nocapture"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(service.stdout.take().unwrap()).lines();
    let mark = said
        .find_map(|line| Some(line.unwrap().split_once("the mark is ")?.1.to_owned()))
        .expect("the service started its agents");
    let agents: Vec<_> = processes_marked(&mark)
        .into_iter()
        .map(|pid| pidfd_open(Pid::from_raw(pid).unwrap(), PidfdFlags::empty()).unwrap())
        .collect();
    assert!(agents.len() >= 3, "a daemon, its parent and bubblewrap");
    let ours = format!("agent-{}-", service.id());
    let left = || {
        agent_cgroups()
            .into_iter()
            .filter(|path| path.to_string_lossy().contains(&ours))
            .collect::<Vec<_>>()
    };
    let had_cgroups = !left().is_empty();

    service.kill().unwrap();
    service.wait().unwrap();
    if by_the_sweep {
        sweep_stale();
    }
    let patience = Timespec {
        tv_sec: PATIENCE.as_secs().try_into().unwrap(),
        tv_nsec: 0,
    };
    for agent in &agents {
        assert_eq!(
            poll(&mut [PollFd::new(agent, PollFlags::IN)], Some(&patience)),
            Ok(1),
            "an agent lives on"
        );
    }
    assert_eq!(processes_marked(&mark), [] as [i32; 0]);
    if had_cgroups {
        // Another test's process may have swept meanwhile, as each does when it begins.
        sweep_stale();
        assert_eq!(left(), [] as [std::path::PathBuf; 0]);
    }
}

#[test]
#[ignore = "the service that the test above starts and kills"]
fn a_service_that_waits() {
    wait_with_an_agent(|_| {});
}

#[test]
#[ignore = "the service that a test above starts and kills"]
fn a_service_that_waits_with_a_frozen_agent() {
    wait_with_an_agent(|agent| {
        // A host without a freezer shows the same without.
        agent.freeze();
    });
}

fn wait_with_an_agent(then: impl FnOnce(&mut AgentProcess)) {
    let subject = Subject::new("clings", &["daemon-stays"]);
    // The agent must not be tied to the thread that happened to start it.
    let mut agent = std::thread::scope(|scope| scope.spawn(|| subject.spawn()).join().unwrap());
    assert_eq!(expect_line(&mut agent), "ready");
    then(&mut agent);
    println!("the mark is {}", subject.mark);
    // Until it is killed, or its parent is.
    let _ = std::io::stdin().read_line(&mut String::new());
}
