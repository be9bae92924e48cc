//! No agent thinks before its clock runs: what it does with its input pipe costs its own time.

use crate::{
    agents::{Agent, sandboxed, unconfined},
    recording::{read, seconds},
    shard::{run, spec},
};
use faceoff_runner::AgentEnvironment;
use faceoff_sandbox::{Isolation, Layer};
use faceoff_types::{AgentFaultKind, Task};
use std::path::Path;

/// Reads its standard input by itself and leaves the end of each question unread, so that sooner or later
/// the next one does not fit into a pipe that was made small; then it thinks, and says so in its log.
const LEAVES_UNREAD: &str = r#"
import array, fcntl, json, os, sys, termios, threading, time
SHRINK, LEFT = 1031, 0 if WHO == "drains" else 1
THOUGHTS = 6

def unread():
    count = array.array("i", [0])
    fcntl.ioctl(0, termios.FIONREAD, count)
    return count[0]

def say(answer):
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()

def think():
    """The next question does not come although it is due: it does not fit."""
    if WHO == "sleeps":
        time.sleep(0.3)
    else:
        until = time.monotonic() + 0.3
        while time.monotonic() < until: pass
    print("thought", file=sys.stderr, flush=True)
    global THOUGHTS, LEFT
    THOUGHTS -= 1
    if THOUGHTS == 0:
        LEFT = 0

def question():
    """All but the last byte of the next question; the last one of the question before goes first."""
    global left
    waited = time.monotonic()
    while unread() <= left:
        if left and time.monotonic() > waited + 0.2:
            think()
            os.read(0, left)
            left = 0
        time.sleep(0.0005)
    text = b""
    while not text.rstrip(b"\n").endswith(b"}"):
        text += os.read(0, max(unread() - LEFT, 1))
    left = 0 if text.endswith(b"\n") else LEFT
    return json.loads(text.lstrip(b"\n"))

def drained():
    """The next question, which a thread takes byte by byte."""
    global THOUGHTS
    text = []
    def drain():
        while text[-1:] != [b"\n"]:
            text.append(os.read(0, 1))
            time.sleep(0.001)
    reader = threading.Thread(target=drain)
    reader.start()
    reader.join()
    print("thought", file=sys.stderr, flush=True)
    THOUGHTS -= 1
    return json.loads(b"".join(text))

left, held = 0, None
while True:
    if WHO == "drains" and held and THOUGHTS > 0:
        message = drained()
    else:
        message = question()
    kind = message["type"]
    if kind == "hello":
        if SHRINKS:
            print("shrunk", fcntl.fcntl(0, SHRINK, 4096), file=sys.stderr, flush=True)
        say({"type": "ready", "protocol": 1, "interpolation": 3})
    elif kind == "reset":
        held = None
        say({"type": "ready", "episode": message["episode"]})
    elif kind == "step":
        held = held or message["obs"][6:13]
        say({"type": "act", "step": message["step"], "action": [held, [0.0] * 7]})
    elif kind == "bye":
        break
"#;

fn leaves_unread(shrinks: bool, who: &str) -> Agent {
    let shrinks = if shrinks { "True" } else { "False" };
    Agent::script(&format!(
        "SHRINKS, WHO = {shrinks}, {who:?}\n{LEAVES_UNREAD}"
    ))
}

/// How many of the recorded answers took 0.3 s or more, whoever's time that was.
fn slow_answers(recording: &Path) -> usize {
    let steps = read(&recording.join("steps.parquet"));
    let counted = seconds(&steps, "computation_time_ns");
    let host = seconds(&steps, "host_time_ns");
    let took = counted
        .iter()
        .zip(&host)
        .map(|(counted, host)| counted + host);
    took.filter(|took| *took >= 0.3).count()
}

/// Without the filter that keeps the pipe's size.
fn without_filter() -> AgentEnvironment {
    let mut env = sandboxed();
    env.isolation = Isolation::Sandboxed {
        given_up: vec![Layer::Seccomp],
    };
    env
}

#[test]
fn a_question_that_does_not_fit_is_on_the_agents_time() {
    for (env, who) in [
        (without_filter(), "computes"),
        (without_filter(), "sleeps"),
        (unconfined(), "computes"),
    ] {
        let out = tempfile::tempdir().unwrap();
        let agent = leaves_unread(true, who);
        let report = run(&spec(Task::Hit, 0..1), &agent, &env, out.path()).unwrap();
        assert!(report.log.contains("shrunk 4096"), "{}", report.log);
        assert_eq!(report.outcomes[0].fault, None);
        let thoughts = report.log.matches("thought").count();
        let slow = slow_answers(out.path());
        // Some may have been thought while the evaluator itself was slow to ask; before, none showed.
        assert_eq!(thoughts, 6, "{}", report.log);
        assert!(slow >= 1, "{slow} of {thoughts}");
    }
}

#[test]
fn in_the_sandbox_the_pipe_keeps_its_size_and_an_unread_byte_delays_nothing() {
    let out = tempfile::tempdir().unwrap();
    let spec = spec(Task::Hit, 0..1);
    let refused = run(&spec, &leaves_unread(true, ""), &sandboxed(), out.path()).unwrap();
    let fault = &refused.outcomes[0].fault.as_ref().unwrap().fault;
    assert_eq!(*fault, AgentFaultKind::Exited { code: 1 });
    assert!(refused.log.contains("PermissionError"), "{}", refused.log);

    let left = run(&spec, &leaves_unread(false, ""), &sandboxed(), out.path()).unwrap();
    assert_eq!(left.outcomes[0].fault, None);
}

#[test]
fn a_question_that_a_thread_takes_slowly_is_on_the_agents_time() {
    for (env, shrinks) in [(sandboxed(), false), (without_filter(), true)] {
        let out = tempfile::tempdir().unwrap();
        let agent = leaves_unread(shrinks, "drains");
        let report = run(&spec(Task::Hit, 0..1), &agent, &env, out.path()).unwrap();
        assert_eq!(report.outcomes[0].fault, None, "{}", report.log);
        assert_eq!(report.log.matches("thought").count(), 6);
        // A millisecond for each byte of a question, of which there are some hundred.
        assert_eq!(slow_answers(out.path()), 6);
    }
}

#[test]
fn an_answer_before_the_whole_question_was_read_is_a_fault() {
    let out = tempfile::tempdir().unwrap();
    // Fills its pipe by way of the end that a developer's agent can open, and answers at once.
    let agent = Agent::with(
        "import fcntl\n\
         def on_step(step, answer):\n    \
         if step == 1:\n        \
         fcntl.fcntl(0, 1031, 4096)\n        \
         end = os.open('/proc/self/fd/0', os.O_WRONLY | os.O_NONBLOCK)\n        \
         try:\n            \
         while True: os.write(end, b' ' * 64)\n        \
         except BlockingIOError: pass\n        \
         say(json.dumps(answer))\n        \
         time.sleep(0.2)\n        \
         answer['step'] = 2\n    \
         return json.dumps(answer)",
    );
    let report = run(&spec(Task::Hit, 0..1), &agent, &unconfined(), out.path()).unwrap();
    let fault = report.outcomes[0].fault.as_ref().unwrap();
    assert!(
        matches!(&fault.fault, AgentFaultKind::WrongMessage { got, .. } if got.contains("not asked for")),
        "{fault:?}"
    );
    assert_eq!(fault.step, Some(2));
}
