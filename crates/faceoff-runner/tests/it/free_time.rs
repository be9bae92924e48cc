//! No agent thinks before its clock runs: what it does with its channel costs its own time.

use crate::{
    agents::{Agent, sandboxed, unconfined},
    recording::{read, seconds},
    shard::{run, spec},
};
use faceoff_types::{AgentFaultKind, Task};
use std::path::Path;

/// Answers without taking the questions, until the next one does not fit; then it does what MODE says, says so in
/// its log, and takes all of them. With MODE `drains` it takes every byte by a thread, slowly.
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
    """Answers what it does not take, until the next question does not come although it is due."""
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
                # All that lies there, and what follows it.
                while taken < step:
                    message = line()
                    taken = message["step"]
                return message
            time.sleep(0.0002)

def drained():
    """The next question, which a thread takes byte by byte."""
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

/// An episode that nobody ends has 500 steps, more than the channel has room for.
#[test]
fn a_question_that_does_not_fit_is_on_the_agents_time() {
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
        assert!(slow >= 1, "it thought, and nothing shows it");
    }
}

#[test]
fn no_agent_makes_its_channel_smaller() {
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
fn a_question_that_a_thread_takes_slowly_is_on_the_agents_time() {
    let out = tempfile::tempdir().unwrap();
    let agent = leaves_unread("drains");
    let report = run(&spec(Task::Hit, 0..1), &agent, &sandboxed(), out.path()).unwrap();
    assert_eq!(report.outcomes[0].fault, None, "{}", report.log);
    assert_eq!(report.log.matches("thought").count(), 6);
    // A millisecond for each byte of a question, of which there are some hundred.
    assert_eq!(slow_answers(out.path()), 6);
}

#[test]
fn an_answer_before_the_whole_question_was_read_is_a_fault() {
    let out = tempfile::tempdir().unwrap();
    let agent = leaves_unread("answers");
    let report = run(&spec(Task::Prepare, 0..1), &agent, &sandboxed(), out.path()).unwrap();
    let fault = &report.outcomes[0].fault.as_ref().unwrap();
    assert!(
        matches!(&fault.fault, AgentFaultKind::WrongMessage { got, .. } if got.contains("not asked for")),
        "{fault:?}"
    );
}
