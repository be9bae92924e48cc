//! What an agent computes while nobody waits for it is on its own time, or does not happen.

use crate::{
    agents::{Agent, sandboxed},
    game,
    recording::{read, seconds},
    shard::{run, spec},
};
use faceoff_runner::{AgentEnvironment, GameObserver, run_game};
use faceoff_sandbox::affinity;
use faceoff_types::Task;

/// On one CPU, with nothing but this agent and the evaluator.
fn on_last_cpu() -> AgentEnvironment {
    let mut env = sandboxed();
    env.agent_cpus = vec![*affinity::allowed().unwrap().last().unwrap()];
    env
}

/// Computes all the time, whatever it is asked.
const SPINS: &str = "import threading\n\
    def spin():\n    \
    while True: pass\n\
    def on_hello(hello): sys.setswitchinterval(1e-4); threading.Thread(target=spin, daemon=True).start()";

#[test]
fn cpu_time_between_answer_and_question_counts() {
    let out = tempfile::tempdir().unwrap();
    let report = run(
        &spec(Task::Hit, 0..1),
        &Agent::with(SPINS),
        &on_last_cpu(),
        out.path(),
    );
    assert_eq!(report.unwrap().outcomes[0].fault, None);
    let steps = read(&out.path().join("steps.parquet"));
    let sum = |name| seconds(&steps, name).iter().sum::<f64>();
    let (counted, host) = (sum("computation_time_ns"), sum("host_time_ns"));
    let used = sum("cpu_time_ns");
    // Gaps that are shorter than it takes to look at them are left out.
    assert!(
        counted + host >= 0.8 * used,
        "{used} s were used, {counted} s counted, and the host took {host} s"
    );
}

struct Nobody;

impl GameObserver for Nobody {
    fn cancelled(&self) -> bool {
        false
    }
}

/// One side answers at once and goes on computing; the other one sleeps at each step.
#[test]
fn side_that_has_answered_is_frozen_on_shared_cpus() {
    let hog = Agent::with(&format!(
        "import atexit\n{SPINS}\n\
         began = None\n\
         def on_step(step, answer):\n    \
         global began\n    \
         began = began or time.process_time()\n    \
         return json.dumps(answer)\n\
         atexit.register(lambda: print('computed', time.process_time() - began, file=sys.stderr))"
    ));
    let sleeper = Agent::with(
        "import atexit\n\
         slept = 0\n\
         def on_step(step, answer):\n    \
         global slept\n    \
         now = time.monotonic()\n    \
         time.sleep(0.01)\n    \
         slept += time.monotonic() - now\n    \
         return json.dumps(answer)\n\
         atexit.register(lambda: print('slept', slept, file=sys.stderr))",
    );
    let out = tempfile::tempdir().unwrap();
    let env = on_last_cpu();
    let played = run_game(
        &game::spec(300),
        [&hog.bundle, &sleeper.bundle],
        [&env; 2],
        out.path(),
        &mut Nobody,
    );
    let logs = played.unwrap().logs;
    let number = |log: &str| -> f64 {
        let line = log.lines().find(|line| line.contains(' '));
        line.and_then(|line| line.split(' ').nth(1)?.parse().ok())
            .unwrap_or_else(|| panic!("{log}"))
    };
    let (computed_s, slept_s) = (number(&logs[0]), number(&logs[1]));
    // Until it is frozen, and while a step is simulated, it may.
    assert!(
        computed_s < 0.5 * slept_s,
        "it computed for {computed_s} s while the other slept for {slept_s} s"
    );
}
