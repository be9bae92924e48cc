//! Agents cannot gain uncharged computing time by leaving questions unread: all use of the channel costs their own
//! time.

use crate::{
    agents::{Agent, sandboxed_environment, unconfined_environment},
    recording::{read_table, seconds},
    shard::{run, spec},
};
use faceoff_airhockey::{HIT, PREPARE};
use faceoff_types::AgentFaultKind;
use std::path::Path;

/// An agent that answers without reading the questions, until the next question does not fit into its input. Then it uses
/// time: with MODE `sleeps` by sleeping, with `computes` by computing. It writes `used time` to its log, and reads all
/// questions. With MODE `answers` it answers instead of reading. With MODE `reads slowly` it reads the first questions in a
/// thread, a byte each millisecond.
const UNREAD_QUESTIONS_SCRIPT: &str = r#"
import array, fcntl, json, os, sys, termios, threading, time
SLOW_READS = 6

def unread():
    count = array.array("i", [0])
    fcntl.ioctl(0, termios.FIONREAD, count)
    return count[0]

def say(answer):
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()

def act(step):
    say({"type": "act", "step": step, "action": [start_position, [0.0] * 7]})

def read_line():
    text = b""
    while not text.endswith(b"\n"):
        text += os.read(0, 1)
    return json.loads(text)

def use_time():
    if MODE == "sleeps":
        time.sleep(0.3)
    else:
        until = time.monotonic() + 0.3
        while time.monotonic() < until: pass
    print("used time", file=sys.stderr, flush=True)

def answer_unread(step):
    """Answers without reading, until the next question does not arrive."""
    last_read = step
    while True:
        before, waited = unread(), time.monotonic()
        act(step)
        step += 1
        while unread() <= before:
            if time.monotonic() > waited + 0.2:
                if MODE == "answers":
                    act(step)
                    time.sleep(3600)
                use_time()
                # All unread questions, and the following ones.
                while last_read < step:
                    message = read_line()
                    last_read = message["step"]
                return message
            time.sleep(0.0002)

def read_slowly():
    """The next question, read by a thread byte by byte."""
    text = []
    def read_bytes():
        while text[-1:] != [b"\n"]:
            text.append(os.read(0, 1))
            time.sleep(0.001)
    reader = threading.Thread(target=read_bytes)
    reader.start()
    reader.join()
    print("used time", file=sys.stderr, flush=True)
    return json.loads(b"".join(text))

start_position, message, reads_all = None, None, MODE == "reads slowly"
while True:
    if MODE == "reads slowly" and start_position and SLOW_READS > 0:
        SLOW_READS -= 1
        message = read_slowly()
    else:
        message = message or read_line()
    kind = message["type"]
    if kind == "hello":
        say({"type": "ready", "protocol": 1, "interpolation": 3})
    elif kind == "reset":
        start_position = None
        say({"type": "ready", "episode": message["episode"]})
    elif kind == "step":
        start_position = start_position or message["obs"][6:13]
        if not reads_all:
            reads_all, message = True, answer_unread(message["step"])
            continue
        act(message["step"])
    elif kind == "bye":
        break
    message = None
"#;

/// An agent with [`UNREAD_QUESTIONS_SCRIPT`] and this MODE.
fn leaves_unread(mode: &str) -> Agent {
    Agent::script(&format!("MODE = {mode:?}\n{UNREAD_QUESTIONS_SCRIPT}"))
}

/// Number of recorded answers that took 0.3 s or more, including host interference.
fn slow_answers(recording: &Path) -> usize {
    let steps = read_table(&recording.join("steps.parquet"));
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
        (sandboxed_environment(), "computes"),
        (sandboxed_environment(), "sleeps"),
        (unconfined_environment(), "computes"),
    ] {
        let out = tempfile::tempdir().unwrap();
        let agent = leaves_unread(mode);
        let report = run(&spec(PREPARE, 0..1), &agent, &env, out.path()).unwrap();
        assert_eq!(report.outcomes[0].fault, None, "{}", report.log);
        let uses_of_time = report.log.matches("used time").count();
        let slow = slow_answers(out.path());
        assert_eq!(uses_of_time, 1, "{}", report.log);
        assert!(slow >= 1, "the computing time was not charged");
    }
}

#[test]
fn agent_cannot_shrink_its_channel() {
    let out = tempfile::tempdir().unwrap();
    let shrinks = Agent::with_hooks(
        "import fcntl\n\
         def on_hello(hello):\n    \
         for fd in range(2):\n        \
         F_SETPIPE_SZ = 1031\n        \
         try: fcntl.fcntl(fd, F_SETPIPE_SZ, 4096)\n        \
         except OSError as error: print('refused', error.errno, file=sys.stderr)",
    );
    for env in [sandboxed_environment(), unconfined_environment()] {
        let report = run(&spec(HIT, 0..1), &shrinks, &env, out.path()).unwrap();
        assert_eq!(report.outcomes[0].fault, None);
        assert_eq!(report.log.matches("refused").count(), 2, "{}", report.log);
    }
}

#[test]
fn slow_read_of_a_question_costs_the_agents_time() {
    let out = tempfile::tempdir().unwrap();
    let agent = leaves_unread("reads slowly");
    let report = run(
        &spec(HIT, 0..1),
        &agent,
        &sandboxed_environment(),
        out.path(),
    )
    .unwrap();
    assert_eq!(report.outcomes[0].fault, None, "{}", report.log);
    assert_eq!(report.log.matches("used time").count(), 6);
    // The agent takes a millisecond for each of the few hundred bytes of a question.
    assert_eq!(slow_answers(out.path()), 6);
}

#[test]
fn answer_before_reading_the_question_is_a_fault() {
    let out = tempfile::tempdir().unwrap();
    let agent = leaves_unread("answers");
    let report = run(
        &spec(PREPARE, 0..1),
        &agent,
        &sandboxed_environment(),
        out.path(),
    )
    .unwrap();
    let fault = &report.outcomes[0].fault.as_ref().unwrap();
    assert!(
        matches!(&fault.fault, AgentFaultKind::WrongMessage { got, .. } if got.contains("not asked for")),
        "{fault:?}"
    );
}
