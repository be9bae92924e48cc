//! Tests of the live feed of a game: its events, and positions at intervals.

use crate::{
    agents::{Agent, sandboxed_environment},
    game::spec,
};
use faceoff_runner::{GameReport, LiveFeed, LiveFeedSink, run_game};
use faceoff_types::{GameEvent, LiveEvent, LivePosition, Side};
use std::time::Duration;

#[derive(Default)]
struct RecordingSink {
    events: Vec<LiveEvent>,
    positions: Vec<LivePosition>,
}

impl LiveFeedSink for RecordingSink {
    fn receive(&mut self, events: Vec<LiveEvent>, position: LivePosition) {
        self.events.extend(events);
        self.positions.push(position);
    }

    fn cancelled(&self) -> bool {
        false
    }
}

/// Runs a game in which the second agent crashes at its fourth step of each rally.
fn run_with_feed(steps: u32, position_interval: Duration) -> (RecordingSink, GameReport) {
    let crashing = Agent::with_hooks(
        "def on_step(step, answer):\n    \
         if step == 3: os._exit(3)\n    \
         return json.dumps(answer)",
    );
    let behaving = Agent::behaving();
    let out = tempfile::tempdir().unwrap();
    let env = sandboxed_environment();
    let mut sink = RecordingSink::default();
    let mut feed = LiveFeed::new(&mut sink, position_interval);
    let bundles = [&behaving.bundle, &crashing.bundle];
    let report = run_game(&spec(steps), bundles, [&env; 2], out.path(), &mut feed).unwrap();
    feed.end(&report);
    (sink, report)
}

#[test]
fn live_feed_has_all_events_in_order_and_all_positions() {
    let (sink, report) = run_with_feed(800, Duration::ZERO);
    let outcome = &report.archives.outcome;
    let fouls = outcome.sides.each_ref().map(|side| side.fouls);
    assert_eq!((fouls[0] + fouls[1], outcome.rallies), (1, 2));
    // The side that serves first commits the foul.
    let fouling_side = Side::BOTH[usize::from(fouls[1] == 1)];
    let serving_side = |index: usize| match sink.events[index].event {
        GameEvent::RallyBegun { serves, .. } => serves,
        ref other => panic!("{other:?}"),
    };
    let side = Side::Second;
    let expected = [
        GameEvent::RallyBegun {
            rally: 0,
            serves: fouling_side,
        },
        GameEvent::Fault { side, count: 1 },
        GameEvent::Foul {
            by: fouling_side,
            score: [0, 0],
        },
        GameEvent::Restarted { side },
        GameEvent::RallyBegun {
            rally: 1,
            serves: fouling_side.other(),
        },
        GameEvent::Fault { side, count: 2 },
        GameEvent::Ended {
            score: [0, 0],
            winner: report
                .archives
                .score
                .winner
                .map(|side| Side::BOTH[side as usize]),
            forfeits: [None; 2],
        },
    ];
    assert_eq!(
        (serving_side(0), serving_side(4)),
        (fouling_side, fouling_side.other())
    );
    let kinds: Vec<_> = sink.events.iter().map(|event| &event.event).collect();
    assert_eq!(kinds, expected.iter().collect::<Vec<_>>());
    let restart_step = sink.events[2].step;
    let steps: Vec<u32> = sink.events.iter().map(|event| event.step).collect();
    assert_eq!(
        steps,
        [
            0,
            3,
            restart_step,
            restart_step,
            restart_step,
            restart_step + 3,
            800
        ]
    );

    let mut steps: Vec<u32> = sink
        .positions
        .iter()
        .map(|position| position.step)
        .collect();
    assert!(steps.is_sorted());
    steps.dedup();
    assert!(steps.into_iter().eq(0..=800), "each step has a position");
    for LivePosition { puck, mallets, .. } in &sink.positions {
        assert!(puck[0].abs() < 0.75 && puck[1].abs() < 0.45, "{puck:?}");
        // The puck is on the table. Both arms keep their initial pose: 0.65 m from their bases, which are 1.51 m from the
        // centre.
        for ([x, y], start_x) in mallets.iter().zip([-0.86, 0.86]) {
            assert!((x - start_x).abs() < 0.02 && y.abs() < 0.02, "{mallets:?}");
        }
    }
}

#[test]
fn rare_positions_do_not_delay_events() {
    let (sink, report) = run_with_feed(40, Duration::MAX);
    assert_eq!(report.archives.outcome.steps, 40);
    // The start of the first rally, its fault, and the end: each with the current position.
    let steps: Vec<u32> = sink
        .positions
        .iter()
        .map(|position| position.step)
        .collect();
    assert_eq!(steps, [0, 40, 40]);
    let last = sink.events.last().map(|event| &event.event);
    assert!(matches!(last, Some(GameEvent::Ended { .. })));
}
