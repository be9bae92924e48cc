//! Agents that block the channel to the service in every known way: no call on the channel waits for them, in any
//! order of calls.

use crate::harness::{LINE_CAP, Subject, TIMEOUT, expect_line, processes_marked};
use faceoff_sandbox::AgentProcess;
use proptest::{prelude::*, test_runner::TestRunner};
use std::{
    sync::mpsc,
    thread,
    time::{Duration, Instant},
};

const KINDS: [&str; 15] = [
    "splice-output",
    "splice-input",
    "splice-log",
    "fault-output",
    "fault-input",
    "fault-log",
    "stops",
    "shut-input",
    "shut-output",
    "close-input",
    "close-output",
    "fills",
    "watches",
    "dribbles",
    "passes-files",
];

/// A call of the evaluator on a channel.
#[derive(Debug, Clone, Copy)]
enum Call {
    Send { bytes: usize },
    IsPending,
    Read { within_ms: u64 },
    LookOut,
    WaitForAny,
    Log,
    Counters,
    Diagnose,
    FreezeAndThaw,
}

fn call() -> impl Strategy<Value = Call> {
    prop_oneof![
        (0..100_000_usize).prop_map(|bytes| Call::Send { bytes }),
        Just(Call::IsPending),
        (0..20_u64).prop_map(|within_ms| Call::Read { within_ms }),
        Just(Call::LookOut),
        Just(Call::WaitForAny),
        Just(Call::Log),
        Just(Call::Counters),
        Just(Call::Diagnose),
        Just(Call::FreezeAndThaw),
    ]
}

/// How the evaluator ends the session.
#[derive(Debug, Clone, Copy)]
enum End {
    Finish,
    Kill,
    Drop,
}

fn end() -> impl Strategy<Value = End> {
    prop_oneof![Just(End::Finish), Just(End::Kill), Just(End::Drop)]
}

fn make(call: Call, agent: &mut AgentProcess) {
    let soon = |ms| Instant::now() + Duration::from_millis(ms);
    // An agent cannot cause a platform fault; which agent fault it causes does not matter here.
    match call {
        Call::Send { bytes } => {
            let mut line = vec![b'q'; bytes];
            line.push(b'\n');
            let _ = agent.send_line(&line);
        }
        Call::IsPending => {
            agent.has_pending_output().unwrap();
        }
        Call::Read { within_ms } => drop(agent.read_line(LINE_CAP, soon(within_ms)).unwrap()),
        Call::LookOut => agent.spin_until(soon(1)).unwrap(),
        Call::WaitForAny => AgentProcess::wait_for_any(&[agent], soon(5)).unwrap(),
        Call::Log => drop(agent.stderr_tail()),
        Call::Counters => {
            agent.track_threads();
            drop((
                agent.read_baseline(Some(&[0])),
                agent.sample_cpus(),
                agent.cpu_time_s(),
            ));
        }
        Call::Diagnose => drop(agent.diagnose_end(Duration::from_millis(1)).unwrap()),
        Call::FreezeAndThaw => {
            agent.freeze();
            agent.thaw();
        }
    }
}

/// Makes the calls on a separate thread, as a slot does, and waits for it.
fn drive(kind: &str, calls: Vec<Call>, end: End) {
    let subject = Subject::new("blocks_channel", &[kind]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    let killer = agent.killer().unwrap();
    let (sender, ended) = mpsc::channel();
    let slot = thread::spawn(move || {
        for call in calls {
            make(call, &mut agent);
        }
        match end {
            End::Finish => drop(agent.finish(Duration::from_millis(1)).unwrap()),
            End::Kill => agent.kill(),
            End::Drop => drop(agent),
        }
        sender.send(()).unwrap();
    });
    if let Err(mpsc::RecvTimeoutError::Timeout) = ended.recv_timeout(TIMEOUT) {
        killer.kill();
        panic!("{kind} blocked the evaluator");
    }
    slot.join().unwrap();
    subject.assert_nothing_left();
}

#[test]
fn held_channel_never_blocks_the_evaluator() {
    for kind in KINDS {
        let mut runner = TestRunner::deterministic();
        for _ in 0..3 {
            let mut generate = |strategy: BoxedStrategy<(Vec<Call>, End)>| {
                strategy.new_tree(&mut runner).unwrap().current()
            };
            let (calls, end) = generate((prop::collection::vec(call(), 1..40), end()).boxed());
            drive(kind, calls, end);
        }
    }
}

#[test]
fn out_of_band_bytes_end_no_later_than_the_deadline() {
    drive(
        "out-of-band",
        vec![
            Call::Read { within_ms: 20 },
            Call::Send { bytes: 10 },
            Call::LookOut,
        ],
        End::Drop,
    );
}

#[test]
fn agent_is_killed_from_another_thread() {
    let subject = Subject::new("blocks_channel", &["splice-output"]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    let killer = agent.killer().unwrap();
    let other = thread::spawn(move || {
        killer.kill();
        killer
    });
    // Only the killer ends it.
    while !processes_marked(&subject.mark).is_empty() {
        thread::yield_now();
    }
    let killer = other.join().unwrap();
    let line = agent.read_line(LINE_CAP, Instant::now() + TIMEOUT);
    assert!(
        matches!(line, Ok(faceoff_sandbox::ReadLine::Closed) | Err(_)),
        "{line:?}"
    );
    drop(agent);
    killer.kill();
    subject.assert_nothing_left();
}

#[test]
fn frozen_agent_uses_no_time_and_then_continues() {
    let subject = Subject::new("blocks_channel", &["spins"]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    if !agent.freeze() {
        println!("this test checks nothing on this host: it has no usable freezer");
        return;
    }
    // A thread freezes when it next leaves the kernel.
    let used = |agent: &AgentProcess| agent.cpu_time_s().unwrap();
    let mut before = used(&agent);
    loop {
        thread::sleep(Duration::from_millis(50));
        let now = used(&agent);
        if now == before {
            break;
        }
        before = now;
    }
    agent.send_line(b"hello\n").unwrap();
    let silent = agent.read_line(LINE_CAP, Instant::now() + Duration::from_millis(50));
    assert!(
        matches!(silent, Ok(faceoff_sandbox::ReadLine::TimedOut)),
        "{silent:?}"
    );
    agent.thaw();
    assert_eq!(expect_line(&mut agent), "hello");
    while used(&agent) == before {
        thread::yield_now();
    }
    // A frozen agent can be killed, too.
    agent.freeze();
    subject.finish(agent);
}
