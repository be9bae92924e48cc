//! CPU time that an agent uses between its answer and the next question (*early* CPU time) counts as its time, or is prevented by
//! freezing the agent.

use crate::{
    agents::{Agent, sandboxed_environment},
    game,
    recording::{read_table, seconds},
    shard::{run, spec},
};
use faceoff_airhockey::HIT;
use faceoff_runner::{AgentEnvironment, GameObserver, run_game};
use faceoff_sandbox::affinity;

/// The agent and the evaluator share one CPU.
fn last_cpu_environment() -> AgentEnvironment {
    let mut env = sandboxed_environment();
    env.agent_cpus = vec![*affinity::allowed_cpus().unwrap().last().unwrap()];
    env
}

/// Computes all the time, also without a question.
const SPINNING_HOOKS: &str = "import threading\n\
    def spin():\n    \
    while True: pass\n\
    def on_hello(hello): sys.setswitchinterval(1e-4); threading.Thread(target=spin, daemon=True).start()";

#[test]
fn cpu_time_between_answer_and_question_counts() {
    let out = tempfile::tempdir().unwrap();
    let report = run(
        &spec(HIT, 0..1),
        &Agent::with_hooks(SPINNING_HOOKS),
        &last_cpu_environment(),
        out.path(),
    );
    assert_eq!(report.unwrap().outcomes[0].fault, None);
    let steps = read_table(&out.path().join("steps.parquet"));
    let sum = |name| seconds(&steps, name).iter().sum::<f64>();
    let (counted, host) = (sum("computation_time_ns"), sum("host_time_ns"));
    let used = sum("cpu_time_ns");
    // Most gaps here are about as short as the shortest measured gap (100 µs), so a part is left out. Unit tests of
    // `CpuUsage` check the exact values.
    assert!(
        counted + host >= 0.5 * used,
        "{used} s were used, {counted} s counted, and {host} s attributed to the host"
    );
}

struct NullObserver;

impl GameObserver for NullObserver {
    fn cancelled(&self) -> bool {
        false
    }
}

/// One side answers at once and continues computing; the other side sleeps at each step. A delayed evaluator freezes
/// late, so the minimum over many steps is checked.
#[test]
fn answered_side_is_frozen_on_shared_cpus() {
    let computing = Agent::with_hooks(&format!(
        "import atexit\n{SPINNING_HOOKS}\n\
         answered, computed = None, []\n\
         def on_step(step, answer):\n    \
         global answered\n    \
         now = time.process_time()\n    \
         if answered: computed.append(now - answered)\n    \
         answered = now\n    \
         return json.dumps(answer)\n\
         atexit.register(lambda: print('least', min(computed), file=sys.stderr))"
    ));
    let sleeping =
        Agent::with_hooks("def on_step(step, answer): time.sleep(0.1); return json.dumps(answer)");
    let out = tempfile::tempdir().unwrap();
    let env = last_cpu_environment();
    let played = run_game(
        &game::spec(40),
        [&computing.bundle, &sleeping.bundle],
        [&env; 2],
        out.path(),
        &mut NullObserver,
    );
    let logs = played.unwrap().logs;
    let least = logs[0].lines().find_map(|line| line.strip_prefix("least "));
    let least_s: f64 = least.unwrap_or_else(|| panic!("{logs:?}")).parse().unwrap();
    assert!(
        least_s < 0.05,
        "the computing agent computed for {least_s} s and more while the other slept for 0.1 s"
    );
}
