//! Agents cannot gain uncharged computing time by leaving questions unread: all use of the channel costs their own
//! time.

use crate::{
    agents::{Agent, sandboxed, unconfined},
    recording::{read, seconds},
    shard::{run, spec},
};
use faceoff_types::{AgentFaultKind, Task};
use std::path::Path;

/// Answers without reading the questions, until the next one does not fit. Then it acts according to MODE, writes a
/// line to its log, and reads all questions. With MODE `drains` a thread reads every question slowly, byte by byte.
const LEAVES_UNREAD: &str = r#"
import array, fcntl, json, os, sys, termios, threading, time
THOUGHTS = 6

def unread():
    count = array.array("i", [0])
    fcntl.ioctl(0, termios.FIONREAD, count)
    return count[0]

def say(answer):
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()

def act(step):
    say({"type": "act", "step": step, "action": [held, [0.0] * 7]})

def line():
    text = b""
    while not text.endswith(b"\n"):
        text += os.read(0, 1)
    return json.loads(text)

def think():
    if MODE == "sleeps":
        time.sleep(0.3)
    else:
        until = time.monotonic() + 0.3
        while time.monotonic() < until: pass
    print("thought", file=sys.stderr, flush=True)

def without_taking(step):
    """Answers without reading, until the next question does not arrive."""
    taken = step
    while True:
        before, waited = unread(), time.monotonic()
        act(step)
        step += 1
        while unread() <= before:
            if time.monotonic() > waited + 0.2:
                if MODE == "answers":
                    act(step)
                    time.sleep(3600)
                think()
                # All unread questions, and the following ones.
                while taken < step:
                    message = line()
                    taken = message["step"]
                return message
            time.sleep(0.0002)

def drained():
    """The next question, read by a thread byte by byte."""
    text = []
    def drain():
        while text[-1:] != [b"\n"]:
            text.append(os.read(0, 1))
            time.sleep(0.001)
    reader = threading.Thread(target=drain)
    reader.start()
    reader.join()
    print("thought", file=sys.stderr, flush=True)
    return json.loads(b"".join(text))

held, message, takes = None, None, MODE == "drains"
while True:
    if MODE == "drains" and held and THOUGHTS > 0:
        THOUGHTS -= 1
        message = drained()
    else:
        message = message or line()
    kind = message["type"]
    if kind == "hello":
        say({"type": "ready", "protocol": 1, "interpolation": 3})
    elif kind == "reset":
        held = None
        say({"type": "ready", "episode": message["episode"]})
    elif kind == "step":
        held = held or message["obs"][6:13]
        if not takes:
            takes, message = True, without_taking(message["step"])
            continue
        act(message["step"])
    elif kind == "bye":
        break
    message = None
"#;

fn leaves_unread(mode: &str) -> Agent {
    Agent::script(&format!("MODE = {mode:?}\n{LEAVES_UNREAD}"))
}

/// Number of recorded answers that took 0.3 s or more, including host interference.
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

/// A full episode has 500 steps, more than fit into the channel.
#[test]
fn question_that_does_not_fit_costs_the_agents_time() {
    for (env, mode) in [
        (sandboxed(), "computes"),
        (sandboxed(), "sleeps"),
        (unconfined(), "computes"),
    ] {
        let out = tempfile::tempdir().unwrap();
        let agent = leaves_unread(mode);
        let report = run(&spec(Task::Prepare, 0..1), &agent, &env, out.path()).unwrap();
        assert_eq!(report.outcomes[0].fault, None, "{}", report.log);
        let thoughts = report.log.matches("thought").count();
        let slow = slow_answers(out.path());
        assert_eq!(thoughts, 1, "{}", report.log);
        assert!(slow >= 1, "the computing time was not charged");
    }
}

#[test]
fn agent_cannot_shrink_its_channel() {
    let out = tempfile::tempdir().unwrap();
    let shrinks = Agent::with(
        "import fcntl\n\
         def on_hello(hello):\n    \
         for fd in range(3):\n        \
         try: fcntl.fcntl(fd, 1031, 4096)\n        \
         except OSError as error: print('refused', error.errno, file=sys.stderr)",
    );
    for env in [sandboxed(), unconfined()] {
        let report = run(&spec(Task::Hit, 0..1), &shrinks, &env, out.path()).unwrap();
        assert_eq!(report.outcomes[0].fault, None);
        assert_eq!(report.log.matches("refused").count(), 3, "{}", report.log);
    }
}

#[test]
fn slow_read_of_a_question_costs_the_agents_time() {
    let out = tempfile::tempdir().unwrap();
    let agent = leaves_unread("drains");
    let report = run(&spec(Task::Hit, 0..1), &agent, &sandboxed(), out.path()).unwrap();
    assert_eq!(report.outcomes[0].fault, None, "{}", report.log);
    assert_eq!(report.log.matches("thought").count(), 6);
    // It takes a millisecond for each of the few hundred bytes of a question.
    assert_eq!(slow_answers(out.path()), 6);
}

#[test]
fn answer_before_reading_the_question_is_a_fault() {
    let out = tempfile::tempdir().unwrap();
    let agent = leaves_unread("answers");
    let report = run(&spec(Task::Prepare, 0..1), &agent, &sandboxed(), out.path()).unwrap();
    let fault = &report.outcomes[0].fault.as_ref().unwrap();
    assert!(
        matches!(&fault.fault, AgentFaultKind::WrongMessage { got, .. } if got.contains("not asked for")),
        "{fault:?}"
    );
}
