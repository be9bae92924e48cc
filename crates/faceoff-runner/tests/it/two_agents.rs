//! Two agents in one conversation, as the two sides of a game are.

use crate::agents::{Agent, impatient, sandboxed, unconfined};
use faceoff_episode::Answered;
use faceoff_runner::{AgentEnvironment, Session, Trouble};
use faceoff_types::{AgentFaultKind, Contest, Phase, Side};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use std::time::{Duration, Instant};

const SIDES: [Side; 2] = [Side::First, Side::Second];

fn start(agent: &Agent, env: &AgentEnvironment, side: Side) -> Session<'static> {
    Session::start(&agent.bundle, env, Contest::Game { side })
        .map_err(|(trouble, stderr)| format!("{trouble:?} {stderr}"))
        .unwrap()
}

/// Waits for both answers; the first that comes is taken first.
fn both(sessions: &mut [Session<'_>; 2]) -> [Result<Answered, Trouble>; 2] {
    let mut came = [None, None];
    while came.iter().any(Option::is_none) {
        let [first, second] = &*sessions;
        let until = Instant::now() + Duration::from_secs(3600);
        Session::wait_for_any(&[first, second], until).unwrap();
        for (session, came) in sessions.iter_mut().zip(&mut came) {
            if came.is_none() {
                *came = session.poll(Instant::now()).transpose();
            }
        }
    }
    came.map(Option::unwrap)
}

/// Each answers only once the other was asked, too.
#[test]
fn both_sides_are_asked_before_either_is_waited_for() {
    let dir = tempfile::tempdir().unwrap();
    let pipes = ["first", "second"].map(|name| dir.path().join(name));
    for pipe in &pipes {
        mknodat(CWD, pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
    }
    let agents = [[0, 1], [1, 0]].map(|[own, other]| {
        Agent::with(&format!(
            "own, other = os.open({:?}, os.O_RDWR), os.open({:?}, os.O_RDWR)\n\
             def meet(): os.write(own, b'.'); os.read(other, 1)\n\
             def on_hello(hello): print(hello['task'], hello['agent_id'], file=sys.stderr)\n\
             def on_reset(episode): meet()\n\
             def on_step(step, answer):\n    meet(); return json.dumps(answer)",
            pipes[own], pipes[other]
        ))
    });
    let mut sessions = [0, 1].map(|i| start(&agents[i], &unconfined(), SIDES[i]));
    for session in &mut sessions {
        session.send_reset(0).unwrap();
    }
    for came in both(&mut sessions) {
        came.unwrap();
    }
    for step in 0..20 {
        for (number, session) in (1..).zip(&mut sessions) {
            session.send_step(step, &[f64::from(number); 23]).unwrap();
        }
        for came in both(&mut sessions) {
            assert!(came.unwrap().computation_time_s > 0.0);
        }
        for (number, session) in (1..).zip(&mut sessions) {
            assert_eq!(session.action()[..7], [f64::from(number); 7]);
            let nothing_is_due = session.poll(Instant::now()).unwrap();
            assert_eq!(nothing_is_due, None);
        }
    }
    let logs = sessions.map(|session| session.finish().unwrap());
    assert_eq!(logs, ["tournament 1\ngoodbye\n", "tournament 2\ngoodbye\n"]);
}

/// One says nothing, the other has closed its output inside of a sandbox that still holds it open, and
/// does not exit either.
#[test]
fn each_side_gets_its_own_verdict() {
    let mut soon_judged = sandboxed();
    soon_judged.time.bye_s = 0.5;
    let agents = [
        ("def on_step(step, answer): return None", impatient()),
        (
            "def on_step(step, answer):\n    os.close(1); time.sleep(3600)",
            soon_judged,
        ),
    ]
    .map(|(hooks, env)| (Agent::with(hooks), env));
    let mut sessions = [0, 1].map(|i| start(&agents[i].0, &agents[i].1, SIDES[i]));
    for session in &mut sessions {
        session.reset(0).unwrap();
        session.send_step(0, &[0.0; 23]).unwrap();
    }
    let faults = both(&mut sessions).map(|came| match came {
        // A busy host may explain the silence; it is silence all the same.
        Err(
            Trouble::Agent { fault, .. }
            | Trouble::Late { fault, .. }
            | Trouble::Host { fault, .. },
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
