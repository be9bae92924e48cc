//! Two agents with one evaluator, like the two sides of a game.

use crate::agents::{
    Agent, sandboxed_environment, short_step_limit_environment, unconfined_environment,
};
use faceoff_episode::AnswerTiming;
use faceoff_runner::{AgentEnvironment, Session, SessionError};
use faceoff_types::{AgentFaultKind, AgentTask, Phase, Side};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use std::time::{Duration, Instant};

const SIDES: [Side; 2] = [Side::First, Side::Second];

fn start(agent: &Agent, env: &AgentEnvironment, side: Side) -> Session<'static> {
    Session::start(&agent.bundle, env, AgentTask::Game { side })
        .map_err(|(error, stderr)| format!("{error:?} {stderr}"))
        .unwrap()
}

/// Waits for both answers, and takes them in the order of their arrival.
fn wait_for_both(sessions: &mut [Session<'_>; 2]) -> [Result<AnswerTiming, SessionError>; 2] {
    let mut results = [None, None];
    while results.iter().any(Option::is_none) {
        let [first, second] = &*sessions;
        let deadline = Instant::now() + Duration::from_secs(3600);
        Session::wait_for_any(&[first, second], deadline).unwrap();
        for (session, result) in sessions.iter_mut().zip(&mut results) {
            if result.is_none() {
                *result = session.poll(Instant::now()).transpose();
            }
        }
    }
    results.map(Option::unwrap)
}

/// Each agent answers only after the other has received its question.
#[test]
fn both_sides_are_asked_before_waiting() {
    let dir = tempfile::tempdir().unwrap();
    let pipes = ["first", "second"].map(|name| dir.path().join(name));
    for pipe in &pipes {
        mknodat(CWD, pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
    }
    // Each agent writes to its own pipe and reads from that of the other.
    let agents = [[0, 1], [1, 0]].map(|[own, other]| {
        Agent::with_hooks(&format!(
            "own, other = os.open({:?}, os.O_RDWR), os.open({:?}, os.O_RDWR)\n\
             def meet(): os.write(own, b'.'); os.read(other, 1)\n\
             def on_hello(hello): print(hello['task'], hello['agent_id'], file=sys.stderr)\n\
             def on_reset(episode): meet()\n\
             def on_step(step, answer):\n    meet(); return json.dumps(answer)",
            pipes[own], pipes[other]
        ))
    });
    let mut sessions = [0, 1].map(|i| start(&agents[i], &unconfined_environment(), SIDES[i]));
    for session in &mut sessions {
        session.send_reset(0).unwrap();
    }
    for result in wait_for_both(&mut sessions) {
        result.unwrap();
    }
    for step in 0..20 {
        for (number, session) in (1..).zip(&mut sessions) {
            session.send_step(step, &[f64::from(number); 23]).unwrap();
        }
        for result in wait_for_both(&mut sessions) {
            assert!(result.unwrap().computation_time_s > 0.0);
        }
        for (number, session) in (1..).zip(&mut sessions) {
            assert_eq!(session.action()[..7], [f64::from(number); 7]);
            let second_answer = session.poll(Instant::now()).unwrap();
            assert_eq!(second_answer, None);
        }
    }
    let logs = sessions.map(|session| session.finish().unwrap());
    assert_eq!(logs, ["tournament 1\ngoodbye\n", "tournament 2\ngoodbye\n"]);
}

/// One agent does not answer. The other closes its output and does not exit; its sandbox still has the output open.
#[test]
fn sides_get_separate_verdicts() {
    let mut short_exit_grace = sandboxed_environment();
    short_exit_grace.time.bye_s = 0.5;
    let agents = [
        (
            "def on_step(step, answer): return None",
            short_step_limit_environment(),
        ),
        (
            "def on_step(step, answer):\n    os.close(1); time.sleep(3600)",
            short_exit_grace,
        ),
    ]
    .map(|(hooks, env)| (Agent::with_hooks(hooks), env));
    let mut sessions = [0, 1].map(|i| start(&agents[i].0, &agents[i].1, SIDES[i]));
    for session in &mut sessions {
        session.reset(0).unwrap();
        session.send_step(0, &[0.0; 23]).unwrap();
    }
    let faults = wait_for_both(&mut sessions).map(|result| match result {
        // On a busy host the timeout may be attributed to the host; the fault is the same.
        Err(
            SessionError::Agent { fault, .. }
            | SessionError::TimedOut { fault, .. }
            | SessionError::HostInterference { fault, .. },
        ) => fault,
        other => panic!("{other:?}"),
    });
    let phase = Phase::Step;
    let limit_s = 0.5;
    assert_eq!(
        faults,
        [
            AgentFaultKind::TimedOut { phase, limit_s },
            AgentFaultKind::ClosedOutput
        ]
    );
}
