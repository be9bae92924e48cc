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

/// Ways of blocking or misusing a channel; `tests/agents/blocks_channel.py` describes them.
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

/// A call of the evaluator on an agent.
#[derive(Debug, Clone, Copy)]
enum Call {
    Send { bytes: usize },
    HasPendingOutput,
    Read { within_ms: u64 },
    SpinUntil,
    WaitForAny,
    ReadLog,
    ReadCounters,
    Diagnose,
    FreezeAndThaw,
}

fn any_call() -> impl Strategy<Value = Call> {
    prop_oneof![
        (0..100_000_usize).prop_map(|bytes| Call::Send { bytes }),
        Just(Call::HasPendingOutput),
        (0..20_u64).prop_map(|within_ms| Call::Read { within_ms }),
        Just(Call::SpinUntil),
        Just(Call::WaitForAny),
        Just(Call::ReadLog),
        Just(Call::ReadCounters),
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

fn any_end() -> impl Strategy<Value = End> {
    prop_oneof![Just(End::Finish), Just(End::Kill), Just(End::Drop)]
}

fn perform(call: Call, agent: &mut AgentProcess) {
    let deadline_in = |ms| Instant::now() + Duration::from_millis(ms);
    // The calls must not report a platform fault. Agent faults are ignored.
    match call {
        Call::Send { bytes } => {
            let mut line = vec![b'q'; bytes];
            line.push(b'\n');
            let _ = agent.send_line(&line);
        }
        Call::HasPendingOutput => {
            agent.has_pending_output().unwrap();
        }
        Call::Read { within_ms } => {
            drop(agent.read_line(LINE_CAP, deadline_in(within_ms)).unwrap())
        }
        Call::SpinUntil => agent.spin_until(deadline_in(1)).unwrap(),
        Call::WaitForAny => AgentProcess::wait_for_any(&[agent], deadline_in(5)).unwrap(),
        Call::ReadLog => drop(agent.stderr()),
        Call::ReadCounters => {
            agent.track_threads();
            drop((
                agent.read_baseline(Some(&[0])),
                agent.read_cpus(),
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

/// Makes the calls on a separate thread, as a worker does, and checks that all return.
fn assert_calls_return(kind: &str, calls: Vec<Call>, end: End) {
    let subject = Subject::new("blocks_channel", &[kind]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "ready");
    let killer = agent.killer().unwrap();
    let (sender, ended) = mpsc::channel();
    let evaluator_thread = thread::spawn(move || {
        for call in calls {
            perform(call, &mut agent);
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
    evaluator_thread.join().unwrap();
    subject.assert_nothing_left();
}

#[test]
fn blocked_channel_never_blocks_the_evaluator() {
    for kind in KINDS {
        let mut runner = TestRunner::deterministic();
        for _ in 0..3 {
            let mut generate = |strategy: BoxedStrategy<(Vec<Call>, End)>| {
                strategy.new_tree(&mut runner).unwrap().current()
            };
            let (calls, end) =
                generate((prop::collection::vec(any_call(), 1..40), any_end()).boxed());
            assert_calls_return(kind, calls, end);
        }
    }
}

#[test]
fn out_of_band_bytes_do_not_block_a_read() {
    assert_calls_return(
        "out-of-band",
        vec![
            Call::Read { within_ms: 20 },
            Call::Send { bytes: 10 },
            Call::SpinUntil,
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
    let killing_thread = thread::spawn(move || {
        killer.kill();
        killer
    });
    // Only the other thread ends the agent.
    while !processes_marked(&subject.mark).is_empty() {
        thread::yield_now();
    }
    let killer = killing_thread.join().unwrap();
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
    // A thread freezes only when it next leaves the kernel, so wait until the CPU time stands still.
    let cpu_time = |agent: &AgentProcess| agent.cpu_time_s().unwrap();
    let mut before = cpu_time(&agent);
    loop {
        thread::sleep(Duration::from_millis(50));
        let now = cpu_time(&agent);
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
    while cpu_time(&agent) == before {
        thread::yield_now();
    }
    // A frozen agent can be killed, too.
    agent.freeze();
    subject.finish(agent);
}
