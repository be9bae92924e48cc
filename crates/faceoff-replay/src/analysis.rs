//! Analysis of a game from its clips (recordings of 500 control steps each): goals, possession, shots and violations. A
//! *rally* is the play from a serve to a goal, a foul or another end; a *sample* is the state after a control step.

use crate::{
    clip::Clip,
    constraint::Constraint,
    error::ReplayError,
    header::{Contact, ContactWith, RallyEndEvent, RallyEndKind},
};
use std::collections::VecDeque;

/// The analysis of a game. Side 0 defends the half x < 0, side 1 the other; positions are in the table frame, in metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GameAnalysis {
    /// Number of analysed control steps.
    pub steps: u32,
    /// The ends of rallies, in order.
    pub rally_ends: Vec<RallyEndEvent>,
    /// Number of control steps after which the puck was in each side's half.
    pub steps_in_half: [u32; 2],
    /// Number of control steps after which each side had touched the puck last in the rally.
    pub steps_after_touch: [u32; 2],
    /// Number of control steps before the first touch of a rally.
    pub steps_before_touch: u32,
    /// The puck's paths into the goals, in order.
    pub goals: Vec<GoalPath>,
    /// The shots: a mallet sent the puck over the middle line.
    pub shots: Vec<Shot>,
    /// Violations, in the order of their first sample.
    pub violations: Vec<LocatedViolation>,
}

impl GameAnalysis {
    /// Bytes of memory that it needs.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let positions: usize = self.goals.iter().map(|goal| goal.positions.len()).sum();
        size_of::<Self>()
            + size_of_val(self.rally_ends.as_slice())
            + size_of_val(self.goals.as_slice())
            + positions * size_of::<[f64; 2]>()
            + size_of_val(self.shots.as_slice())
            + size_of_val(self.violations.as_slice())
    }
}

/// The path of the puck into a goal: over at most the last [`GOAL_PATH_STEPS`] control steps of its rally.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalPath {
    pub side: usize,
    /// The rally's last sample.
    pub sample: u32,
    /// Positions of the puck.
    pub positions: Vec<[f64; 2]>,
}

/// Maximum length of a path into a goal in control steps: two seconds.
pub const GOAL_PATH_STEPS: usize = 100;

/// A shot: after a touch by the side's mallet, the puck crossed the middle line towards the other side without another
/// touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shot {
    pub side: usize,
    /// Time of the touch since the start of the game, s.
    pub touch_s: f64,
    /// Position of the puck at the touch.
    pub touch_position: [f64; 2],
    /// Speed of the puck at the first sample beyond the middle line.
    pub speed_m_s: f64,
    /// Did the rally end with a goal of that side before the puck crossed the middle line again?
    pub goal: bool,
}

/// A violation of a constraint, with the position of the mallet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocatedViolation {
    pub side: usize,
    pub constraint: Constraint,
    /// The first sample of the violation.
    pub first_sample: u32,
    pub last_sample: u32,
    /// Largest excess over the limit: rad, rad/s or m.
    pub max_excess: f64,
    /// Position of the side's mallet at the first sample.
    pub mallet_position: [f64; 2],
}

/// The last touch of a mallet in a rally.
#[derive(Debug, Clone, Copy)]
struct Touch {
    /// The shot that the touch becomes if the puck crosses the middle line.
    shot: Shot,
    /// Has the puck crossed the middle line since the touch?
    has_crossed: bool,
}

/// The analysis so far, and the state that the next clip continues.
#[derive(Debug, Default)]
struct Analyzer {
    analysis: GameAnalysis,
    touch: Option<Touch>,
    /// Index of the shot that brought the puck into its current half; the shot may still become a goal.
    open_shot: Option<usize>,
    /// The last positions of the puck in the rally.
    path: VecDeque<[f64; 2]>,
}

impl GameAnalysis {
    /// Analyses all motion clips of a game, in order.
    ///
    /// # Errors
    /// The first error of a clip.
    pub fn from_clips(
        clips: impl IntoIterator<Item = Result<Clip, ReplayError>>,
    ) -> Result<Self, ReplayError> {
        let mut analyzer = Analyzer::default();
        for clip in clips {
            analyzer.add_clip(&clip?);
        }
        let mut analysis = analyzer.analysis;
        analysis
            .violations
            .sort_by_key(|violation| violation.first_sample);
        Ok(analysis)
    }

    /// The shots of a side.
    #[must_use]
    pub fn shots_of(&self, side: usize) -> Vec<Shot> {
        let shots = self.shots.iter().filter(|shot| shot.side == side);
        shots.copied().collect()
    }
}

impl Analyzer {
    fn add_clip(&mut self, clip: &Clip) {
        let header = &clip.header;
        let values = |name: &str| -> Vec<f64> {
            clip.column(name)
                .map(|column| column.values().collect())
                .unwrap_or_default()
        };
        let (vx, vy) = (values("puck_vx"), values("puck_vy"));
        let positions = clip.puck_positions();
        let mut contacts = header.contacts.iter().peekable();
        let mut rally_ends = header.rally_ends.iter().peekable();
        // The first sample of a clip repeats the last one of the previous clip, or is the start.
        for (index, position) in positions.iter().enumerate().skip(1) {
            let sample = header.first + u32::try_from(index).unwrap_or(u32::MAX);
            let end_s = f64::from(sample) * header.step_s;
            let is_last = index + 1 == positions.len();
            while let Some(contact) = contacts.next_if(|contact| contact.t < end_s || is_last) {
                self.add_contact(contact);
            }
            let value = |column: &[f64]| column.get(index).copied().unwrap_or_default();
            let (vx, vy) = (value(&vx), value(&vy));
            self.add_position(*position, (vx * vx + vy * vy).sqrt());
            while let Some(end) = rally_ends.next_if(|end| end.sample <= sample) {
                self.end_rally(end);
                self.analysis.rally_ends.push(end.clone());
            }
        }
        self.add_violations(clip);
    }

    /// Adds a contact of the puck.
    fn add_contact(&mut self, contact: &Contact) {
        let side = match contact.body {
            ContactWith::Rim => return,
            ContactWith::Mallet => 0,
            ContactWith::OpponentMallet => 1,
        };
        self.touch = Some(Touch {
            shot: Shot {
                side,
                touch_s: contact.t,
                touch_position: [contact.x, contact.y],
                speed_m_s: 0.0,
                goal: false,
            },
            has_crossed: false,
        });
    }

    /// Adds the puck's position and speed after a control step.
    fn add_position(&mut self, [x, y]: [f64; 2], speed_m_s: f64) {
        let half = usize::from(x >= 0.0);
        if self.path.len() > GOAL_PATH_STEPS {
            self.path.pop_front();
        }
        self.path.push_back([x, y]);
        self.analysis.steps += 1;
        self.analysis.steps_in_half[half] += 1;
        let Self {
            analysis,
            touch,
            open_shot,
            ..
        } = self;
        // The puck is back in the half from which it was shot.
        if open_shot.is_some_and(|shot| analysis.shots[shot].side == half) {
            *open_shot = None;
        }
        match touch {
            None => analysis.steps_before_touch += 1,
            Some(touch) => {
                analysis.steps_after_touch[touch.shot.side] += 1;
                if !touch.has_crossed && half != touch.shot.side {
                    touch.has_crossed = true;
                    *open_shot = Some(analysis.shots.len());
                    analysis.shots.push(Shot {
                        speed_m_s,
                        ..touch.shot
                    });
                }
            }
        }
    }

    fn end_rally(&mut self, end: &RallyEndEvent) {
        let scoring_side = (end.kind == RallyEndKind::Goal)
            .then_some(end.by)
            .flatten()
            .map(|by| usize::from(by == 1));
        if let Some(shot) = self
            .open_shot
            .take()
            .map(|shot| &mut self.analysis.shots[shot])
        {
            shot.goal = scoring_side == Some(shot.side);
        }
        self.touch = None;
        let positions = std::mem::take(&mut self.path);
        if let Some(side) = scoring_side {
            self.analysis.goals.push(GoalPath {
                side,
                sample: end.sample,
                positions: positions.into(),
            });
        }
    }

    fn add_violations(&mut self, clip: &Clip) {
        let first = clip.header.first;
        for span in &clip.header.violations {
            let side = usize::from(span.side == 1);
            // A violation may continue from the previous clip.
            let previous = self.analysis.violations.iter_mut().rev().find(|violation| {
                violation.side == side
                    && violation.constraint == span.constraint
                    && violation.last_sample == first
            });
            match previous {
                Some(violation) if span.from == first + 1 => {
                    violation.last_sample = span.to;
                    violation.max_excess = violation.max_excess.max(span.max_excess);
                }
                _ => {
                    let index = span.from.saturating_sub(first) as usize;
                    self.analysis.violations.push(LocatedViolation {
                        side,
                        constraint: span.constraint,
                        first_sample: span.from,
                        last_sample: span.to,
                        max_excess: span.max_excess,
                        mallet_position: clip.mallet_position(side, index).unwrap_or_default(),
                    });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        column::Column,
        header::{Header, ViolationSpan},
    };

    /// A clip with the given x of the puck at each sample, and a speed of 2 m/s. The side 0 defends x < 0.
    fn clip(first: u32, xs: &[f64]) -> Clip {
        let column = |name: &str, values: &[f64]| {
            let mut column = Column::new(name, "m", 1e-4, 1);
            values.iter().for_each(|value| column.push(*value));
            column
        };
        let constant = |value: f64| vec![value; xs.len()];
        Clip {
            header: Header {
                score: Some([0; 2]),
                ..Header::new("game", first, u32::try_from(xs.len()).unwrap())
            },
            columns: vec![
                column("puck_x", xs),
                column("puck_y", &constant(0.1)),
                column("puck_vx", &constant(2.0)),
                column("puck_vy", &constant(0.0)),
            ],
        }
    }

    /// A contact of the puck at time `t` (s) and position `x` (m).
    fn contact(t: f64, body: ContactWith, x: f64) -> Contact {
        Contact { t, body, x, y: 0.1 }
    }

    /// A goal of the side `by`.
    fn goal(sample: u32, by: u32) -> RallyEndEvent {
        RallyEndEvent {
            sample,
            kind: RallyEndKind::Goal,
            by: Some(by),
            score: [1, 0],
        }
    }

    fn analyse(clips: Vec<Clip>) -> GameAnalysis {
        GameAnalysis::from_clips(clips.into_iter().map(Ok)).unwrap()
    }

    #[test]
    fn shot_before_the_rallys_goal_is_a_goal() {
        let mut game = clip(0, &[-0.5, -0.5, -0.2, 0.2, 0.6, -0.3, -0.3]);
        game.header.contacts = vec![contact(0.021, ContactWith::Mallet, -0.45)];
        game.header.rally_ends = vec![goal(4, 0)];
        let analysis = analyse(vec![game]);
        assert_eq!(analysis.shots.len(), 1);
        let shot = analysis.shots[0];
        assert_eq!(
            (shot.side, shot.goal, shot.touch_position),
            (0, true, [-0.45, 0.1])
        );
        assert!((shot.speed_m_s - 2.0).abs() < 1e-9 && (shot.touch_s - 0.021).abs() < 1e-9);
        assert_eq!(analysis.steps, 6);
        assert_eq!(
            analysis.steps_in_half,
            [4, 2],
            "samples 1, 2, 5, 6 and 3, 4"
        );
        assert_eq!(
            analysis.steps_after_touch,
            [3, 0],
            "from sample 2 to the goal"
        );
        assert_eq!(
            analysis.steps_before_touch, 3,
            "before the touch, and in the next rally"
        );
    }

    #[test]
    fn repeated_touch_is_no_shot_and_returned_shot_no_goal() {
        let mut game = clip(0, &[-0.5, -0.5, -0.4, -0.2, 0.2, 0.6, -0.1, 0.3]);
        game.header.contacts = vec![
            contact(0.001, ContactWith::Mallet, -0.5),
            contact(0.041, ContactWith::Mallet, -0.3),
            contact(0.050, ContactWith::Rim, -0.3),
            contact(0.105, ContactWith::OpponentMallet, 0.6),
        ];
        game.header.rally_ends = vec![goal(7, 0)];
        let analysis = analyse(vec![game]);
        let shots: Vec<_> = analysis
            .shots
            .iter()
            .map(|shot| (shot.side, shot.goal))
            .collect();
        assert_eq!(shots, [(0, false), (1, false)], "both came back");
        assert!((analysis.shots[0].touch_s - 0.041).abs() < 1e-9);
    }

    #[test]
    fn goal_path_has_the_last_two_seconds() {
        let mut game = clip(0, &[-0.5; 300]);
        game.header.rally_ends = vec![goal(250, 1)];
        let analysis = analyse(vec![game]);
        assert_eq!(analysis.goals[0].positions.len(), GOAL_PATH_STEPS + 1);
    }

    #[test]
    fn deflected_shot_into_own_goal_is_a_goal() {
        let mut game = clip(0, &[-0.5, -0.2, 0.2, 0.6, 0.9]);
        game.header.contacts = vec![
            contact(0.001, ContactWith::Mallet, -0.5),
            contact(0.050, ContactWith::OpponentMallet, 0.5),
        ];
        game.header.rally_ends = vec![goal(4, 0)];
        let analysis = analyse(vec![game]);
        assert_eq!(analysis.shots.len(), 1);
        assert!(analysis.shots[0].goal);
    }

    #[test]
    fn shots_and_violations_continue_across_clips() {
        let violation_span = |from, to, max_excess| ViolationSpan {
            side: 1,
            constraint: Constraint::Ee,
            from,
            to,
            max_excess,
        };
        let mut first = clip(0, &[0.5, 0.4, 0.1]);
        first.header.contacts = vec![contact(0.001, ContactWith::OpponentMallet, 0.5)];
        first.header.violations = vec![violation_span(2, 2, 0.01)];
        let mut second = clip(2, &[0.1, -0.1, -0.9]);
        second.header.violations = vec![violation_span(3, 4, 0.03)];
        second.header.rally_ends = vec![goal(4, 1)];
        let analysis = analyse(vec![first, second]);
        assert_eq!(
            analysis.steps, 4,
            "the sample that both clips have counts once"
        );
        assert_eq!(analysis.shots.len(), 1);
        assert!(analysis.shots[0].goal && analysis.shots[0].side == 1);
        assert_eq!(analysis.violations.len(), 1);
        let violation = analysis.violations[0];
        assert_eq!((violation.first_sample, violation.last_sample), (2, 4));
        assert!((violation.max_excess - 0.03).abs() < 1e-12);
        assert_eq!(analysis.steps_after_touch, [0, 4]);
    }
}
