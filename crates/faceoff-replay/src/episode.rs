//! An episode as two clips and a line.

use crate::{
    clip::Clip,
    error::ReplayError,
    group::Group,
    gzip::Gzip,
    header::{CLIP_FORMAT, ClipKind, EndTold, Header},
    motion::Motion,
    observed::Observed,
    sheet::{Broken, EpisodeLine, TimeBins},
    violations::Watch,
};
use faceoff_episode::{EpisodeStart, StepRow, why_it_ended};
use faceoff_sim::{
    EpisodeState, JOINTS,
    model::{CONTROL_STEP_S, LINKS},
    table::frames::table_from_robot,
};
use faceoff_types::{EpisodeOutcome, Task, harmless};

/// An episode that is being recorded.
#[derive(Debug)]
pub(crate) struct Recording {
    episode: u32,
    start: [f64; 6],
    last: [f64; 6],
    motion: Motion,
    observed: Observed,
    watch: Watch,
    broken: Vec<Broken>,
    times: Vec<f64>,
}

/// What is kept of an episode that has ended.
#[derive(Debug)]
pub(crate) struct Recorded {
    pub motion: Clip,
    pub observed: Clip,
    pub line: EpisodeLine,
}

impl Recording {
    pub fn begin(start: &EpisodeStart<'_>) -> Self {
        let mut motion = Motion::new(start.state.opponent_q.is_some());
        motion.push(start.state);
        Self {
            episode: start.episode,
            start: start.state.puck,
            last: start.state.puck,
            motion,
            observed: Observed::new(0),
            watch: Watch::default(),
            broken: Vec::new(),
            times: Vec::new(),
        }
    }

    /// The first observation; later ones come with the steps.
    pub fn observe(&mut self, observation: &[f64]) {
        if self.observed.seen() == 0 {
            self.observed.see(observation);
        }
    }

    pub fn step(&mut self, row: &StepRow<'_>) {
        let sample = row.step + 1;
        self.motion.push(row.state);
        self.motion.meet(row.step, row.impacts);
        self.observed.see(row.next_observation);
        self.observed
            .answer(sample, row.action, &row.answered, row.puck_lost);
        self.watch.see(0, sample, &row.constraints);
        for group in Group::ALL {
            let value = group.of(&row.constraints);
            if value > 0.0 {
                self.note_broken(group, sample, value, row.state);
            }
        }
        self.times.push(row.answered.computation_time_s);
        self.last = row.state.puck;
    }

    fn note_broken(&mut self, group: Group, sample: u32, value: f64, state: &EpisodeState) {
        if let Some(broken) = self.broken.iter_mut().find(|broken| broken.group == group) {
            broken.samples += 1;
            broken.worst = broken.worst.max(value);
            return;
        }
        let [x, y, _] = table_from_robot(0, state.ee);
        let farthest = |share: [f64; JOINTS]| {
            let joints = (1_u32..).zip(share);
            joints
                .max_by(|(_, a), (_, b)| a.total_cmp(b))
                .map(|(joint, _)| joint)
        };
        let joint = match group {
            Group::JointPos => farthest(std::array::from_fn(|i| {
                state.q[i].abs() / LINKS[i].range_rad
            })),
            Group::JointVel => farthest(std::array::from_fn(|i| {
                state.dq_filtered[i].abs() / LINKS[i].velocity_limit_rad_s
            })),
            Group::Ee | Group::Link => None,
        };
        self.broken.push(Broken {
            group,
            from: sample,
            samples: 1,
            worst: value,
            at: [x, y],
            joint,
        });
    }

    /// The clips and the line; the steps' times are counted.
    pub fn end(mut self, outcome: &EpisodeOutcome, times: &mut TimeBins) -> Recorded {
        let fault = outcome.fault.as_ref().map(|fault| &fault.fault);
        let why = why_it_ended(outcome.task, outcome.end, &self.last, outcome.steps, fault);
        let why = harmless(&why).into_owned();
        // What exactly an agent did wrong is its team's to know.
        let told = match outcome.fault {
            Some(_) => why_it_ended(outcome.task, outcome.end, &self.last, outcome.steps, None),
            None => why.clone(),
        };
        let end = |why| EndTold {
            end: outcome.end,
            success: outcome.success,
            why,
            steps: outcome.steps,
        };
        self.times.iter().for_each(|time| times.add(*time));
        let (observed_columns, late, lost) = self.observed.take();
        let line = EpisodeLine {
            task: outcome.task,
            episode: outcome.episode,
            steps: outcome.steps,
            success: outcome.success,
            end: outcome.end,
            why: why.clone(),
            start: place_and_velocity(&self.start),
            last: place_and_velocity(&self.last),
            broken: self.broken,
            longest_s: Some(self.times.iter().copied().fold(0.0, f64::max)),
            late: u32::try_from(late.len()).unwrap_or(u32::MAX),
        };
        let (motion_columns, contacts) = self.motion.take();
        let samples = motion_columns
            .first()
            .map_or(0, |column| column.counts.len());
        let header = Header {
            format: CLIP_FORMAT.to_owned(),
            kind: ClipKind::Motion,
            contest: contest(outcome.task),
            episode: Some(self.episode),
            side: None,
            first: 0,
            samples: u32::try_from(samples).unwrap_or(u32::MAX),
            step_s: CONTROL_STEP_S,
            columns: Vec::new(),
            contacts,
            violations: self.watch.take(),
            breaks: Vec::new(),
            score: None,
            late: Vec::new(),
            lost: Vec::new(),
            end: Some(end(told)),
        };
        Recorded {
            observed: Clip {
                header: Header {
                    kind: ClipKind::Observed,
                    side: Some(0),
                    contacts: Vec::new(),
                    violations: Vec::new(),
                    late,
                    lost,
                    end: Some(end(why)),
                    ..header.clone()
                },
                columns: observed_columns,
            },
            motion: Clip {
                header,
                columns: motion_columns,
            },
            line,
        }
    }
}

impl Recorded {
    /// Both clips' bytes.
    pub fn compressed(&self, gzip: &mut Gzip) -> Result<[Vec<u8>; 2], ReplayError> {
        Ok([
            self.motion.compressed(gzip)?,
            self.observed.compressed(gzip)?,
        ])
    }
}

fn contest(task: Task) -> String {
    task.as_str().to_owned()
}

/// x, y, vx, vy, to a tenth of a millimetre and of a millimetre per second.
fn place_and_velocity([x, y, _, vx, vy, _]: &[f64; 6]) -> [f64; 4] {
    [x, y, vx, vy].map(|value| (value * 1e4).round() / 1e4)
}
