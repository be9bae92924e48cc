//! Games between real agents: the sides do not affect each other. Penalty points of a side are counted in *windows*, stretches of 500
//! control steps of the game, each of which counts like an episode.

use crate::agents::{Agent, sandboxed_environment};
use faceoff_airhockey::EVALUATION;
use faceoff_dataset::game::{GAME_FILE, GameRecording, side_file, verify_game};
use faceoff_runner::{
    AgentEnvironment, GameObserver, GameReport, GameSpec, PlatformFault, run_game,
};
use faceoff_types::{
    AgentFault, AgentFaultKind, ForfeitCause, GameEnd, GameLimits, GameOutcome, Phase, Seed, Side,
    SideOutcome, ViolationName,
};
use std::{cell::Cell, fs, path::Path};

/// A game in which answers are late after a minute, so that other load of the host does not affect a test.
pub fn spec(steps: u32) -> GameSpec {
    let seed = Seed::from_number(7);
    GameSpec {
        ruleset: faceoff_airhockey::RULESET,
        steps,
        profile: EVALUATION,
        seed,
        mismatch_seed: seed.model_mismatch(),
        limits: GameLimits {
            max_answer_s: 60.0,
            restart_s: 600.0,
            ..GameLimits::default()
        },
        platform_retries: 0,
        perturbations: Default::default(),
        forfeit_score: Default::default(),
    }
}

struct NullObserver;

impl GameObserver for NullObserver {
    fn cancelled(&self) -> bool {
        false
    }
}

fn play_in(
    spec: &GameSpec,
    agents: [&Agent; 2],
    envs: [&AgentEnvironment; 2],
    out: &Path,
) -> GameReport {
    let bundles = agents.map(|agent| &agent.bundle);
    run_game(spec, bundles, envs, out, &mut NullObserver).expect("the platform works")
}

/// Runs a game and verifies it.
fn play(spec: &GameSpec, agents: [&Agent; 2]) -> GameReport {
    let out = tempfile::tempdir().unwrap();
    let env = sandboxed_environment();
    let report = play_in(spec, agents, [&env; 2], out.path());
    assert_verifies(out.path(), &report);
    report
}

/// Asserts that the recording's results equal those of a new simulation.
fn assert_verifies(out: &Path, report: &GameReport) {
    let recording = GameRecording::open(&out.join(GAME_FILE)).unwrap();
    let steps = Cell::new(0);
    let verified = verify_game(&recording, &|played| steps.set(steps.get() + played)).unwrap();
    assert_eq!(verified.score, report.archives.score);
    assert_eq!(recording.results().unwrap(), report.archives.score);
    assert_eq!(recording.outcome().unwrap(), report.archives.outcome);
    assert_eq!(steps.get(), u64::from(report.archives.outcome.steps));
    let archive = recording.archive().unwrap().unwrap();
    assert_eq!(archive, report.archives.game);
}

/// The outcome without measured times.
fn without_times(outcome: &GameOutcome) -> GameOutcome {
    let mut outcome = outcome.clone();
    for side in &mut outcome.sides {
        side.time_used_s = 0.0;
        for window in &mut side.windows {
            window.computation_time = Default::default();
        }
    }
    outcome
}

/// The sides of a game between the tested agent and an agent that behaves.
fn play_against_behaving(spec: &GameSpec, hooks: &str) -> [SideOutcome; 2] {
    let (tested, opponent) = (Agent::with_hooks(hooks), Agent::behaving());
    let report = play(spec, [&tested, &opponent]);
    let [tested, opponent] = without_times(&report.archives.outcome).sides;
    assert_eq!(opponent.faults, []);
    assert_eq!(opponent.late_answers, 0);
    assert_eq!(opponent.answers, report.archives.outcome.steps);
    // The opponent keeps its pose, so its answers violate nothing either.
    assert!(
        opponent
            .windows
            .iter()
            .all(|window| { window.violations == Default::default() && window.faults == 0 })
    );
    [tested, opponent]
}

/// Kind, episode and step of each fault.
fn kinds(side: &SideOutcome) -> Vec<(&AgentFaultKind, Option<u32>, Option<u32>)> {
    let faults = side.faults.iter().map(|fault| &fault.fault);
    faults
        .map(|fault| (&fault.fault, fault.episode, fault.step))
        .collect()
}

#[test]
fn game_verifies_and_is_reproducible() {
    let agents = [
        Agent::with_hooks(
            "def on_hello(hello): print(hello['task'], hello['agent_id'], file=sys.stderr)\n\
             def on_step(step, answer):\n    \
             answer['action'][0][0] += 0.002 * (step % 40); return json.dumps(answer)",
        ),
        Agent::with_hooks("INTERPOLATION = 1"),
    ];
    let dirs = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let env = sandboxed_environment();
    let reports = dirs.each_ref().map(|dir| {
        let report = play_in(&spec(1700), [&agents[0], &agents[1]], [&env; 2], dir.path());
        assert_verifies(dir.path(), &report);
        report
    });
    let outcomes = reports
        .each_ref()
        .map(|report| without_times(&report.archives.outcome));
    assert_eq!(outcomes[0], outcomes[1]);
    let outcome = &outcomes[0];
    assert_eq!((outcome.steps, &outcome.end), (1700, &GameEnd::Played));
    // Fouls alternate between the sides, each after 752 steps: a puck that is on one side for more than 750 steps (15 s) is a foul,
    // and its first step there counts as 0.
    assert!(outcome.rallies >= 2, "{outcome:?}");
    for side in &outcome.sides {
        let steps: Vec<u32> = side.windows.iter().map(|window| window.steps).collect();
        assert_eq!(steps, [500, 500, 500, 200]);
        assert_eq!(side.answers, 1700);
    }
    assert_eq!(reports[0].logs[0], "tournament 1\ngoodbye\n");
    assert_eq!(reports[0].logs[1], "goodbye\n");
    // The motion is the same file, byte for byte.
    let motion = dirs.each_ref().map(|dir| {
        let recording = GameRecording::open(dir.path()).unwrap();
        recording.manifest().files["motion.parquet"].clone()
    });
    assert_eq!(motion[0], motion[1]);
    // The delay that the host adds was measured before and during the game, with a test agent that answers immediately.
    let [calibrated, _] = reports[0].calibration.sides;
    assert!(calibrated.before_s.count > 0 && calibrated.during_s.count > 0);
}

#[test]
fn side_file_holds_nothing_of_the_other_side_and_no_seed() {
    let agent = Agent::with_hooks("def on_reset(episode): print('SECRET', file=sys.stderr)");
    let out = tempfile::tempdir().unwrap();
    let env = sandboxed_environment();
    let spec = spec(20);
    play_in(&spec, [&agent, &Agent::behaving()], [&env; 2], out.path());
    let seeds = [spec.seed, spec.mismatch_seed].map(|seed| seed.to_string());
    for (side, other) in [(Side::First, "2"), (Side::Second, "1")] {
        let path = out.path().join(side_file(side));
        let mut zip = zip::ZipArchive::new(fs::File::open(&path).unwrap()).unwrap();
        let mut names = Vec::new();
        let mut bytes = Vec::new();
        for index in 0..zip.len() {
            let mut file = zip.by_index(index).unwrap();
            names.push(file.name().unwrap().to_string());
            std::io::copy(&mut file, &mut bytes).unwrap();
        }
        assert!(names.contains(&"motion.parquet".to_owned()), "{names:?}");
        let own = format!("side-{}.parquet", side.number());
        assert!(names.contains(&own), "{names:?}");
        for name in &names {
            assert!(!name.contains(&format!("-{other}.")), "{name}");
        }
        let text = String::from_utf8_lossy(&bytes);
        assert_eq!(text.contains("SECRET"), side == Side::First);
        assert!(!seeds.iter().any(|seed| text.contains(seed.as_str())));
        let refused = GameRecording::open(&path).unwrap_err().to_string();
        assert!(
            refused.contains("one side's archive of a game"),
            "{refused}"
        );
    }
}

#[test]
fn late_answers_are_dropped_and_cost_only_their_side() {
    // Only deliberate sleeps are late: the bound is far above the answer times on a busy host.
    let mut spec = spec(60);
    spec.limits.max_answer_s = 2.0;
    let slow = Agent::with_hooks(
        "def on_step(step, answer):\n    \
         answer['action'][0][0] += 0.2\n    \
         if step in (5, 6, 30): time.sleep(2.1)\n    \
         return json.dumps(answer)",
    );
    let report = play(&spec, [&slow, &Agent::behaving()]);
    let [late, other] = &report.archives.outcome.sides;
    assert_eq!((late.late_answers, late.answers), (3, 60));
    assert!(late.faults.is_empty());
    assert_eq!((other.late_answers, other.answers), (0, 60));
    let [late, other] = &report.archives.score.sides;
    // Late answers of one window (500 control steps) are one violation.
    assert_eq!(late.violations.get(ViolationName::COMPUTATION_TIME), 1);
    assert!(late.computation_time_s.max > 2.0);
    assert!(other.computation_time_s.max < 2.0);
}

#[test]
fn always_late_agent_never_moves_its_arm() {
    let mut spec = spec(200);
    spec.limits.max_answer_s = 1e-9;
    let swings = Agent::with_hooks(
        "def on_step(step, answer):\n    \
         answer['action'][0][0] += 0.5; return json.dumps(answer)",
    );
    let report = play(&spec, [&swings, &swings]);
    for side in &report.archives.outcome.sides {
        assert_eq!((side.late_answers, side.answers), (200, 200));
        assert!(side.faults.is_empty());
        // No constraint is violated. Late answers count as violations of the computation time, but only in the score.
        assert_eq!(side.windows[0].violations, Default::default());
    }
}

#[test]
fn silent_side_holds_its_arm_and_is_restarted_next_rally() {
    let agent = Agent::with_hooks("def on_step(step, answer): return None");
    let mut short_limit = sandboxed_environment();
    short_limit.time.step_s = 0.2;
    let out = tempfile::tempdir().unwrap();
    let behaving = Agent::behaving();
    let env = sandboxed_environment();
    let report = play_in(
        &spec(800),
        [&behaving, &agent],
        [&env, &short_limit],
        out.path(),
    );
    assert_verifies(out.path(), &report);
    let [behaving, silent] = &report.archives.outcome.sides;
    assert_eq!((behaving.answers, behaving.faults.len()), (800, 0));
    assert_eq!(silent.answers, 0);
    let timed_out = AgentFaultKind::TimedOut {
        phase: Phase::Step,
        limit_s: 0.2,
    };
    assert_eq!(
        kinds(silent),
        [
            (&timed_out, Some(0), Some(0)),
            (&timed_out, Some(1), Some(0))
        ]
    );
    assert_eq!(report.archives.outcome.rallies, 2);
    // Each window (500 control steps) with a fault is penalised with two points.
    let score = &report.archives.score.sides[1];
    assert_eq!(score.violations.get(ViolationName::COMPUTATION_TIME), 2);
    assert_eq!(score.penalty_points, 4.0);
    assert!(report.logs[1].contains("no answer within the step limit"));
}

#[test]
fn invalid_output_and_crashes_are_faults_of_their_side() {
    for (hooks, message) in [
        (
            "def on_step(step, answer):\n    \
             return (json.dumps(answer) + '\\n') * 300 if step == 3 else json.dumps(answer)",
            "no output before the next question",
        ),
        (
            "def on_step(step, answer): return 'x' * 100000 if step == 3 else json.dumps(answer)",
            "longer than 65536 bytes",
        ),
        (
            "def on_step(step, answer):\n    \
             if step == 3: os._exit(3)\n    \
             return json.dumps(answer)",
            "exited with status 3",
        ),
        ("def on_reset(episode): os._exit(4)", "exited with status 4"),
        (
            "def on_step(step, answer):\n    \
             if step == 3: answer['action'][1][0] = 10001.0\n    \
             return json.dumps(answer)",
            "numbers between -10000 and 10000",
        ),
    ] {
        let [faulty, _] = play_against_behaving(&spec(30), hooks);
        assert_eq!(faulty.faults.len(), 1, "{hooks}");
        let fault = faulty.faults[0].to_string();
        assert!(fault.contains(message), "{fault}");
        assert_eq!(faulty.windows[0].faults, 1, "{hooks}");
    }
}

#[test]
fn extreme_actions_are_valid_until_the_world_diverges() {
    let [at_the_bound, _] = play_against_behaving(
        &spec(40),
        "def on_step(step, answer):\n    \
         answer['action'] = [[1e4 if step % 2 else -1e4] * 7] * 2; return json.dumps(answer)",
    );
    assert!(at_the_bound.answers > 0);
    for (kind, ..) in kinds(&at_the_bound) {
        assert!(matches!(kind, AgentFaultKind::Diverged { .. }), "{kind:?}");
    }
    // Accelerates each joint in the direction in which it moves already.
    let [diverging, _] = play_against_behaving(
        &spec(1500),
        "INTERPOLATION = None\n\
         def on_step(step, answer):\n    \
         push = [1e4 if dq > 0 else -1e4 for dq in obs[13:20]]\n    \
         answer['action'] = [[push, push, push]] * 20\n    \
         return json.dumps(answer)",
    );
    assert!(!diverging.faults.is_empty(), "{diverging:?}");
    for (kind, ..) in kinds(&diverging) {
        assert!(matches!(kind, AgentFaultKind::Diverged { .. }), "{kind:?}");
    }
}

#[test]
fn repeated_faults_forfeit_the_game() {
    let mut spec = spec(45_000);
    spec.limits.max_faults = 1;
    let crashing = Agent::with_hooks("def on_reset(episode): os._exit(5)");
    let behaving = Agent::behaving();
    let report = play(&spec, [&behaving, &crashing]);
    let (outcome, score) = (&report.archives.outcome, &report.archives.score);
    let cause = ForfeitCause::Faults {
        count: 2,
        allowed: 1,
    };
    assert_eq!(
        outcome.end,
        GameEnd::Forfeit {
            by: Side::Second,
            cause
        }
    );
    assert_eq!(score.winner.map(|side| side as u32), Some(0));
    // By the default rule `ForfeitScore::Ten`.
    assert_eq!([score.sides[0].score, score.sides[1].score], [10, 0]);
    assert_eq!(score.sides[1].forfeit, Some(cause));
    assert!(report.logs[0].ends_with("goodbye\n"), "{}", report.logs[0]);

    spec.limits.max_faults = 0;
    let report = play(&spec, [&crashing, &crashing]);
    let (outcome, score) = (&report.archives.outcome, &report.archives.score);
    let causes = [ForfeitCause::Faults {
        count: 1,
        allowed: 0,
    }; 2];
    assert_eq!(outcome.end, GameEnd::BothForfeit { causes });
    assert_eq!((outcome.steps, outcome.rallies), (0, 1));
    assert_eq!(score.winner, None);
    assert_eq!([score.sides[0].score, score.sides[1].score], [0, 0]);
}

#[test]
fn used_up_game_time_forfeits_the_game() {
    let mut spec = spec(45_000);
    let agents = [
        Agent::behaving(),
        Agent::with_hooks("def on_step(step, answer): time.sleep(0.3); return json.dumps(answer)"),
    ];
    // Only the slow agent can use up this time, even on a busy host.
    let out = tempfile::tempdir().unwrap();
    spec.limits.total_s = 20.0;
    let env = sandboxed_environment();
    let report = play_in(&spec, [&agents[0], &agents[1]], [&env; 2], out.path());
    assert_verifies(out.path(), &report);
    let GameEnd::Forfeit {
        by: Side::Second,
        cause: ForfeitCause::Time { used_s, allowed_s },
    } = report.archives.outcome.end
    else {
        panic!("{:?}", report.archives.outcome.end)
    };
    assert!(used_s > allowed_s && allowed_s == 20.0);
    assert_eq!(report.archives.outcome.sides[1].time_used_s, used_s);
    assert_eq!(
        report.archives.score.winner.map(|side| side as u32),
        Some(0)
    );
}

/// A closed output of a running agent is diagnosed only after a wait of the evaluator, which must not count as the
/// other side's time.
#[test]
fn diagnosis_of_one_side_costs_the_other_no_time() {
    let closing = Agent::with_hooks(
        "def on_step(step, answer):\n    \
         if step == 2: os.close(1); time.sleep(3600)\n    \
         return json.dumps(answer)",
    );
    let behaving = Agent::behaving();
    let mut env = sandboxed_environment();
    env.time.bye_s = 3.0;
    let mut spec = spec(10);
    // At most the wait for the other agent's exit, and far more than answer times on a busy host.
    spec.limits.max_answer_s = 3.0;
    for agents in [[&closing, &behaving], [&behaving, &closing]] {
        let out = tempfile::tempdir().unwrap();
        let report = play_in(&spec, agents, [&env; 2], out.path());
        assert_verifies(out.path(), &report);
        let sides = &report.archives.outcome.sides;
        for (agent, side) in agents.into_iter().zip(sides) {
            if std::ptr::eq(agent, &closing) {
                assert_eq!(side.faults.len(), 1);
                assert_eq!(side.faults[0].fault.fault, AgentFaultKind::ClosedOutput);
            } else {
                assert_eq!((side.late_answers, side.faults.len()), (0, 0));
                assert_eq!(side.answers, 10);
            }
        }
    }
}

#[test]
fn cancelled_game_leaves_logs_and_no_recording() {
    /// Cancels the game after its third step.
    struct CancellingObserver {
        starts: Vec<(Side, bool)>,
        logs: Vec<(Side, String)>,
        rallies: u32,
        steps: u32,
    }
    impl GameObserver for CancellingObserver {
        fn on_start(&mut self, side: Side, fault: Option<&AgentFault>) {
            self.starts.push((side, fault.is_none()));
        }
        fn on_rally_start(&mut self, _: &faceoff_airhockey::RallyStart<'_>) {
            self.rallies += 1;
        }
        fn on_step(&mut self, _: &faceoff_airhockey::GameStepRow<'_>) {
            self.steps += 1;
        }
        fn log(&mut self, side: Side, log: &str) {
            self.logs.push((side, log.to_owned()));
        }
        fn cancelled(&self) -> bool {
            self.steps == 3
        }
    }
    let agent =
        Agent::with_hooks("def on_reset(episode): print('reset', file=sys.stderr, flush=True)");
    let mut observer = CancellingObserver {
        starts: Vec::new(),
        logs: Vec::new(),
        rallies: 0,
        steps: 0,
    };
    let out = tempfile::tempdir().unwrap();
    let env = sandboxed_environment();
    let bundles = [&agent.bundle; 2];
    let stopped = run_game(&spec(100), bundles, [&env; 2], out.path(), &mut observer);
    assert!(matches!(stopped, Err(PlatformFault::Cancelled)));
    assert_eq!((observer.rallies, observer.steps), (1, 3));
    assert_eq!(observer.starts, Side::BOTH.map(|side| (side, true)));
    let expected = Side::BOTH.map(|side| (side, "reset\n".to_owned()));
    assert_eq!(observer.logs, expected);
    assert_eq!(fs::read_dir(out.path()).unwrap().count(), 0);
}
