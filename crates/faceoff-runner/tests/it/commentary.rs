//! What is told of a game to those who watch it.

use crate::{
    agents::{Agent, sandboxed},
    game::spec,
};
use faceoff_runner::{Commentary, GameAudience, GameReport, run_game};
use faceoff_types::{GameHappening, LiveHappening, LivePosition, Side};
use std::time::Duration;

#[derive(Default)]
struct Listener {
    happenings: Vec<LiveHappening>,
    positions: Vec<LivePosition>,
}

impl GameAudience for Listener {
    fn hear(&mut self, happenings: Vec<LiveHappening>, position: LivePosition) {
        self.happenings.extend(happenings);
        self.positions.push(position);
    }

    fn cancelled(&self) -> bool {
        false
    }
}

fn told(steps: u32, every: Duration) -> (Listener, GameReport) {
    let crashes = Agent::with(
        "def on_step(step, answer):\n    \
         if step == 3: os._exit(3)\n    \
         return json.dumps(answer)",
    );
    let hold = Agent::behaving();
    let out = tempfile::tempdir().unwrap();
    let env = sandboxed();
    let mut listener = Listener::default();
    let mut commentary = Commentary::new(&mut listener, every);
    let bundles = [&hold.bundle, &crashes.bundle];
    let report = run_game(
        &spec(steps),
        bundles,
        [&env; 2],
        out.path(),
        &mut commentary,
    )
    .unwrap();
    commentary.end(&report);
    (listener, report)
}

#[test]
fn everything_that_happens_is_told_in_order_and_every_step_has_its_place() {
    let (listener, report) = told(800, Duration::ZERO);
    let outcome = &report.archives.outcome;
    let fouls = outcome.sides.each_ref().map(|side| side.fouls);
    assert_eq!((fouls[0] + fouls[1], outcome.rallies), (1, 2));
    let by = Side::BOTH[usize::from(fouls[1] == 1)];
    let serves = |at: usize| match listener.happenings[at].what {
        GameHappening::RallyBegun { serves, .. } => serves,
        ref other => panic!("{other:?}"),
    };
    let side = Side::Second;
    let expected = [
        GameHappening::RallyBegun {
            rally: 0,
            serves: by,
        },
        GameHappening::Fault { side, count: 1 },
        GameHappening::Foul { by, score: [0, 0] },
        GameHappening::Restarted { side },
        GameHappening::RallyBegun {
            rally: 1,
            serves: by.other(),
        },
        GameHappening::Fault { side, count: 2 },
        GameHappening::Ended {
            score: [0, 0],
            winner: report
                .archives
                .score
                .winner
                .map(|side| Side::BOTH[side as usize]),
            forfeits: [None; 2],
        },
    ];
    assert_eq!((serves(0), serves(4)), (by, by.other()));
    let whats: Vec<_> = listener.happenings.iter().map(|told| &told.what).collect();
    assert_eq!(whats, expected.iter().collect::<Vec<_>>());
    let anew = listener.happenings[2].step;
    let steps: Vec<u32> = listener.happenings.iter().map(|told| told.step).collect();
    assert_eq!(steps, [0, 3, anew, anew, anew, anew + 3, 800]);

    let mut seen: Vec<u32> = listener.positions.iter().map(|at| at.step).collect();
    assert!(seen.is_sorted());
    seen.dedup();
    assert!(seen.into_iter().eq(0..=800), "each step is told of");
    for LivePosition { puck, mallets, .. } in &listener.positions {
        assert!(puck[0].abs() < 0.75 && puck[1].abs() < 0.45, "{puck:?}");
        // Both arms hold where they begin: 0.65 m from their bases, which stand 1.51 m from the middle.
        for ([x, y], begun) in mallets.iter().zip([-0.86, 0.86]) {
            assert!((x - begun).abs() < 0.02 && y.abs() < 0.02, "{mallets:?}");
        }
    }
}

#[test]
fn who_hears_positions_rarely_still_hears_everything() {
    let (listener, report) = told(40, Duration::MAX);
    assert_eq!(report.archives.outcome.steps, 40);
    // The first rally's beginning, its fault, the end: each with the position then.
    let steps: Vec<u32> = listener.positions.iter().map(|at| at.step).collect();
    assert_eq!(steps, [0, 40, 40]);
    let last = listener.happenings.last().map(|told| &told.what);
    assert!(matches!(last, Some(GameHappening::Ended { .. })));
}
