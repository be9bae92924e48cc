//! What a game's clips say of the play: how the score came about, who had the puck, who shot, who broke limits where.

use crate::{
    clip::Clip,
    error::ReplayError,
    group::Group,
    header::{Break, BreakKind, Contact, ContactWith},
};
use std::collections::VecDeque;

/// What the clips of a game say. Sides are 0 and 1; places are in the table's frame, in m.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GameAnalysis {
    /// Control steps that were looked at.
    pub steps: u32,
    /// The ends of rallies, in order.
    pub breaks: Vec<Break>,
    /// Control steps after which the puck lay on each side's half.
    pub halves: [u32; 2],
    /// Control steps after which each side had touched the puck last in the rally.
    pub touched: [u32; 2],
    /// Those before either had touched it in the rally.
    pub untouched: u32,
    /// The puck's ways into the goals, in order.
    pub goals: Vec<GoalWay>,
    /// Each time that a mallet sent the puck over the middle line.
    pub shots: Vec<Shot>,
    /// Limits that were broken, in order.
    pub breaches: Vec<Breach>,
}

/// How the puck came into a goal: in the last [`GOAL_WAY_STEPS`] control steps at most, and no further back than its rally.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalWay {
    pub side: usize,
    /// The rally's last sample.
    pub sample: u32,
    /// Where the puck was.
    pub places: Vec<[f64; 2]>,
}

/// Control steps of the way into a goal: two seconds.
pub const GOAL_WAY_STEPS: usize = 100;

/// A mallet touched the puck, which crossed the middle line towards the other side before any mallet touched it again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shot {
    pub side: usize,
    /// When it was touched: s since sample 0.
    pub t: f64,
    /// Where the puck was then.
    pub at: [f64; 2],
    /// How fast the puck was at the first sample beyond the middle line, m/s.
    pub speed: f64,
    /// Did the rally end in a goal of that side before the puck crossed the middle line again?
    pub goal: bool,
}

/// A limit was broken over some samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breach {
    pub side: usize,
    pub group: Group,
    /// The first sample.
    pub from: u32,
    pub to: u32,
    /// By how much at most: rad, rad/s or m.
    pub worst: f64,
    /// Where the side's mallet was at the first.
    pub at: [f64; 2],
}

/// The last touch of a mallet in a rally.
#[derive(Debug, Clone, Copy)]
struct Touch {
    shot: Shot,
    has_crossed: bool,
}

/// What is carried from clip to clip.
#[derive(Debug, Default)]
struct Watch {
    found: GameAnalysis,
    touch: Option<Touch>,
    /// The shot by which the puck came to lie on the half where it is, among those found.
    open: Option<usize>,
    /// Where the puck was last in the rally.
    way: VecDeque<[f64; 2]>,
}

impl GameAnalysis {
    /// Of all clips of a game's motion, in order.
    ///
    /// # Errors
    /// That of a clip.
    pub fn of(
        clips: impl IntoIterator<Item = Result<Clip, ReplayError>>,
    ) -> Result<Self, ReplayError> {
        let mut watch = Watch::default();
        for clip in clips {
            watch.see(&clip?);
        }
        let mut found = watch.found;
        found.breaches.sort_by_key(|breach| breach.from);
        Ok(found)
    }

    /// Of a side: its shots, and how many of them were goals.
    #[must_use]
    pub fn shots_of(&self, side: usize) -> Vec<Shot> {
        let those = self.shots.iter().filter(|shot| shot.side == side);
        those.copied().collect()
    }
}

impl Watch {
    fn see(&mut self, clip: &Clip) {
        let header = &clip.header;
        let values = |name: &str| -> Vec<f64> {
            clip.column(name)
                .map(|column| column.values().collect())
                .unwrap_or_default()
        };
        let (vx, vy) = (values("puck_vx"), values("puck_vy"));
        let places = clip.puck_places();
        let mut contacts = header.contacts.iter().peekable();
        let mut breaks = header.breaks.iter().peekable();
        // The first sample of a clip is the last of the one before, or the start.
        for (index, place) in places.iter().enumerate().skip(1) {
            let sample = header.first + u32::try_from(index).unwrap_or(u32::MAX);
            let end_s = f64::from(sample) * header.step_s;
            let is_last = index + 1 == places.len();
            while let Some(contact) = contacts.next_if(|contact| contact.t < end_s || is_last) {
                self.meet(contact);
            }
            let speed = |of: &[f64]| of.get(index).copied().unwrap_or_default();
            let (vx, vy) = (speed(&vx), speed(&vy));
            self.lie(*place, (vx * vx + vy * vy).sqrt());
            while let Some(end) = breaks.next_if(|end| end.sample <= sample) {
                self.end_rally(end);
                self.found.breaks.push(end.clone());
            }
        }
        self.add_breaches(clip);
    }

    /// The puck came to touch something.
    fn meet(&mut self, contact: &Contact) {
        let side = match contact.what {
            ContactWith::Rim => return,
            ContactWith::Mallet => 0,
            ContactWith::OpponentMallet => 1,
        };
        self.touch = Some(Touch {
            shot: Shot {
                side,
                t: contact.t,
                at: [contact.x, contact.y],
                speed: 0.0,
                goal: false,
            },
            has_crossed: false,
        });
    }

    /// The puck after a control step.
    fn lie(&mut self, [x, y]: [f64; 2], speed: f64) {
        let half = usize::from(x >= 0.0);
        if self.way.len() > GOAL_WAY_STEPS {
            self.way.pop_front();
        }
        self.way.push_back([x, y]);
        self.found.steps += 1;
        self.found.halves[half] += 1;
        let Self {
            found, touch, open, ..
        } = self;
        // Back on the half that it was shot from.
        if open.is_some_and(|shot| found.shots[shot].side == half) {
            *open = None;
        }
        match touch {
            None => found.untouched += 1,
            Some(touch) => {
                found.touched[touch.shot.side] += 1;
                if !touch.has_crossed && half != touch.shot.side {
                    touch.has_crossed = true;
                    *open = Some(found.shots.len());
                    found.shots.push(Shot {
                        speed,
                        ..touch.shot
                    });
                }
            }
        }
    }

    fn end_rally(&mut self, end: &Break) {
        let scored = (end.what == BreakKind::Goal)
            .then_some(end.by)
            .flatten()
            .map(|by| usize::from(by == 1));
        if let Some(shot) = self.open.take().map(|shot| &mut self.found.shots[shot]) {
            shot.goal = scored == Some(shot.side);
        }
        self.touch = None;
        let places = std::mem::take(&mut self.way);
        if let Some(side) = scored {
            self.found.goals.push(GoalWay {
                side,
                sample: end.sample,
                places: places.into(),
            });
        }
    }

    fn add_breaches(&mut self, clip: &Clip) {
        let first = clip.header.first;
        for told in &clip.header.violations {
            let side = usize::from(told.side == 1);
            // One that goes on from the clip before is the same.
            let before = self.found.breaches.iter_mut().rev().find(|breach| {
                breach.side == side && breach.group == told.group && breach.to == first
            });
            match before {
                Some(breach) if told.from == first + 1 => {
                    breach.to = told.to;
                    breach.worst = breach.worst.max(told.worst);
                }
                _ => {
                    let index = told.from.saturating_sub(first) as usize;
                    self.found.breaches.push(Breach {
                        side,
                        group: told.group,
                        from: told.from,
                        to: told.to,
                        worst: told.worst,
                        at: clip.mallet_place(side, index).unwrap_or_default(),
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
        header::{CLIP_FORMAT, ClipKind, Header, ViolationTold},
    };
    use faceoff_sim::model::CONTROL_STEP_S;

    /// A clip in which the puck is at these places, one a sample, going at 2 m/s.
    fn clip(first: u32, xs: &[f64]) -> Clip {
        let column = |name: &str, values: &[f64]| {
            let mut column = Column::new(name, "m", 1e-4, 1);
            values.iter().for_each(|value| column.push(*value));
            column
        };
        let same = |value: f64| vec![value; xs.len()];
        Clip {
            header: Header {
                format: CLIP_FORMAT.to_owned(),
                kind: ClipKind::Motion,
                contest: "game".to_owned(),
                episode: None,
                side: None,
                first,
                samples: u32::try_from(xs.len()).unwrap(),
                step_s: CONTROL_STEP_S,
                columns: Vec::new(),
                contacts: Vec::new(),
                violations: Vec::new(),
                breaks: Vec::new(),
                score: Some([0; 2]),
                late: Vec::new(),
                lost: Vec::new(),
                end: None,
            },
            columns: vec![
                column("puck_x", xs),
                column("puck_y", &same(0.1)),
                column("puck_vx", &same(2.0)),
                column("puck_vy", &same(0.0)),
            ],
        }
    }

    fn contact(t: f64, what: ContactWith, x: f64) -> Contact {
        Contact { t, what, x, y: 0.1 }
    }

    fn goal(sample: u32, by: u32) -> Break {
        Break {
            sample,
            what: BreakKind::Goal,
            by: Some(by),
            score: [1, 0],
        }
    }

    fn of(clips: Vec<Clip>) -> GameAnalysis {
        GameAnalysis::of(clips.into_iter().map(Ok)).unwrap()
    }

    #[test]
    fn a_shot_crosses_the_middle_before_another_touch_and_is_a_goal_if_the_rally_ends_in_one() {
        let mut game = clip(0, &[-0.5, -0.5, -0.2, 0.2, 0.6, -0.3, -0.3]);
        game.header.contacts = vec![contact(0.021, ContactWith::Mallet, -0.45)];
        game.header.breaks = vec![goal(4, 0)];
        let found = of(vec![game]);
        assert_eq!(found.shots.len(), 1);
        let shot = found.shots[0];
        assert_eq!((shot.side, shot.goal, shot.at), (0, true, [-0.45, 0.1]));
        assert!((shot.speed - 2.0).abs() < 1e-9 && (shot.t - 0.021).abs() < 1e-9);
        assert_eq!(found.steps, 6);
        assert_eq!(found.halves, [4, 2], "samples 1, 2, 5, 6 and 3, 4");
        assert_eq!(found.touched, [3, 0], "from sample 2 to the goal");
        assert_eq!(
            found.untouched, 3,
            "before the touch, and in the next rally"
        );
    }

    #[test]
    fn what_is_touched_again_on_the_own_half_is_no_shot_and_what_came_back_is_no_goal() {
        let mut game = clip(0, &[-0.5, -0.5, -0.4, -0.2, 0.2, 0.6, -0.1, 0.3]);
        game.header.contacts = vec![
            contact(0.001, ContactWith::Mallet, -0.5),
            contact(0.041, ContactWith::Mallet, -0.3),
            contact(0.050, ContactWith::Rim, -0.3),
            contact(0.105, ContactWith::OpponentMallet, 0.6),
        ];
        game.header.breaks = vec![goal(7, 0)];
        let found = of(vec![game]);
        let told: Vec<_> = found
            .shots
            .iter()
            .map(|shot| (shot.side, shot.goal))
            .collect();
        assert_eq!(told, [(0, false), (1, false)], "the second came back, too");
        assert!((found.shots[0].t - 0.041).abs() < 1e-9);
    }

    #[test]
    fn the_way_into_a_goal_is_its_last_two_seconds() {
        let mut game = clip(0, &[-0.5; 300]);
        game.header.breaks = vec![goal(250, 1)];
        let found = of(vec![game]);
        assert_eq!(found.goals[0].places.len(), GOAL_WAY_STEPS + 1);
    }

    #[test]
    fn a_shot_that_the_other_side_deflects_into_its_own_goal_is_a_goal() {
        let mut game = clip(0, &[-0.5, -0.2, 0.2, 0.6, 0.9]);
        game.header.contacts = vec![
            contact(0.001, ContactWith::Mallet, -0.5),
            contact(0.050, ContactWith::OpponentMallet, 0.5),
        ];
        game.header.breaks = vec![goal(4, 0)];
        let found = of(vec![game]);
        assert_eq!(found.shots.len(), 1);
        assert!(found.shots[0].goal);
    }

    #[test]
    fn a_shot_and_a_broken_limit_go_on_in_the_next_clip() {
        let broken = |from, to, worst| ViolationTold {
            side: 1,
            group: Group::Ee,
            from,
            to,
            worst,
        };
        let mut before = clip(0, &[0.5, 0.4, 0.1]);
        before.header.contacts = vec![contact(0.001, ContactWith::OpponentMallet, 0.5)];
        before.header.violations = vec![broken(2, 2, 0.01)];
        let mut after = clip(2, &[0.1, -0.1, -0.9]);
        after.header.violations = vec![broken(3, 4, 0.03)];
        after.header.breaks = vec![goal(4, 1)];
        let found = of(vec![before, after]);
        assert_eq!(
            found.steps, 4,
            "the sample that both clips have counts once"
        );
        assert_eq!(found.shots.len(), 1);
        assert!(found.shots[0].goal && found.shots[0].side == 1);
        assert_eq!(found.breaches.len(), 1);
        let breach = found.breaches[0];
        assert_eq!((breach.from, breach.to), (2, 4));
        assert!((breach.worst - 0.03).abs() < 1e-12);
        assert_eq!(found.touched, [0, 4]);
    }
}
