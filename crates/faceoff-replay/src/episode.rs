//! Records an episode as two clips for replays (the public motion; the agent's observations and commands) and as a summary in
//! the index of episodes.

use crate::{
    agent_view::AgentView,
    clip::Clip,
    clip_index::{EpisodeIndexEntry, TimeBins, ViolationSummary},
    constraint::Constraint,
    error::ReplayError,
    gzip::Gzip,
    header::{ClipKind, EpisodeEndSummary, Header},
    motion::Motion,
    violations::ViolationTracker,
};
use faceoff_airhockey::{AirHockeyWorld, describe_end};
use faceoff_episode::{EpisodeStart, StepRow, World};
use faceoff_sim::{EpisodeState, JOINTS, model::LINKS, table::frames::table_from_robot};
use faceoff_types::{EpisodeOutcome, Task, escape_unprintable};

/// An episode that is being recorded.
#[derive(Debug)]
pub(crate) struct Recording {
    episode: u32,
    /// The puck's true state before the first step: x, y, yaw and their velocities.
    puck_at_start: [f64; 6],
    /// The puck's true state after the last step so far.
    puck: [f64; 6],
    motion: Motion,
    agent_view: AgentView,
    tracker: ViolationTracker,
    violations: Vec<ViolationSummary>,
    /// Computation times, s.
    times_s: Vec<f64>,
}

/// The recorded data of a finished episode.
#[derive(Debug)]
pub(crate) struct EpisodeClips {
    pub motion: Clip,
    pub observed: Clip,
    pub summary: EpisodeIndexEntry,
}

impl Recording {
    /// `None` if the world is not one of air hockey, whose clips these are.
    pub fn begin(start: &EpisodeStart<'_>) -> Option<Self> {
        let state = world(start.world)?.state();
        let mut motion = Motion::new(state.opponent_q.is_some());
        motion.push(state);
        Some(Self {
            episode: start.episode,
            puck_at_start: state.puck,
            puck: state.puck,
            motion,
            agent_view: AgentView::new(0),
            tracker: ViolationTracker::default(),
            violations: Vec::new(),
            times_s: Vec::new(),
        })
    }

    /// Records the first observation; later ones come with the steps.
    pub fn observe(&mut self, observation: &[f64]) {
        if self.agent_view.observation_count() == 0 {
            self.agent_view.observe(observation);
        }
    }

    pub fn step(&mut self, row: &StepRow<'_>) {
        let Some(world) = world(row.world) else {
            return;
        };
        let (state, constraints) = (world.state(), world.constraints());
        let sample = row.step + 1;
        self.motion.push(state);
        self.motion.add_contacts(row.step, world.impacts());
        self.agent_view.observe(row.next_observation);
        self.agent_view
            .answer(sample, row.action, &row.timing, world.is_puck_lost());
        self.tracker.update(0, sample, constraints);
        for constraint in Constraint::ALL {
            let value = constraint.value(constraints);
            if value > 0.0 {
                self.add_violation(constraint, sample, value, state);
            }
        }
        self.times_s.push(row.timing.computation_time_s);
        self.puck = state.puck;
    }

    fn add_violation(
        &mut self,
        constraint: Constraint,
        sample: u32,
        value: f64,
        state: &EpisodeState,
    ) {
        if let Some(violation) = self
            .violations
            .iter_mut()
            .find(|violation| violation.constraint == constraint.name())
        {
            violation.samples += 1;
            violation.max_excess = violation.max_excess.max(value);
            return;
        }
        let [x, y, _] = table_from_robot(0, state.ee);
        let most_exceeded = |fraction_of_limit: [f64; JOINTS]| {
            let joints = (1_u32..).zip(fraction_of_limit);
            joints
                .max_by(|(_, a), (_, b)| a.total_cmp(b))
                .map(|(joint, _)| joint)
        };
        let joint = match constraint {
            Constraint::JointPos => most_exceeded(std::array::from_fn(|i| {
                state.q[i].abs() / LINKS[i].range_rad
            })),
            Constraint::JointVel => most_exceeded(std::array::from_fn(|i| {
                state.dq_filtered[i].abs() / LINKS[i].velocity_limit_rad_s
            })),
            Constraint::Ee | Constraint::Link => None,
        };
        self.violations.push(ViolationSummary {
            at: Some([x, y]),
            joint,
            ..ViolationSummary::begin(constraint.name(), sample, value)
        });
    }

    /// The clips and the summary for the index. Adds the computation times to `times`.
    pub fn end(mut self, outcome: &EpisodeOutcome, times: &mut TimeBins) -> EpisodeClips {
        let fault = outcome.fault.as_ref().map(|fault| &fault.fault);
        let description = describe_end(outcome.task, outcome.end, &self.puck, outcome.steps, fault);
        let description = escape_unprintable(&description).into_owned();
        // Details of a fault are not public.
        let public_description = match outcome.fault {
            Some(_) => describe_end(outcome.task, outcome.end, &self.puck, outcome.steps, None),
            None => description.clone(),
        };
        let end = |description| EpisodeEndSummary {
            end: outcome.end,
            success: outcome.success,
            description,
            steps: outcome.steps,
        };
        self.times_s.iter().for_each(|time_s| times.add(*time_s));
        let (observed_columns, late, tracking_gaps) = self.agent_view.take();
        let summary = EpisodeIndexEntry {
            task: outcome.task,
            episode: outcome.episode,
            steps: outcome.steps,
            success: outcome.success,
            end: outcome.end,
            end_description: description.clone(),
            puck_at_start: Some(position_and_velocity(&self.puck_at_start)),
            puck_at_end: Some(position_and_velocity(&self.puck)),
            violations: self.violations,
            longest_s: Some(self.times_s.iter().copied().fold(0.0, f64::max)),
            late_answers: u32::try_from(late.len()).unwrap_or(u32::MAX),
        };
        let (motion_columns, contacts) = self.motion.take();
        let samples = motion_columns
            .first()
            .map_or(0, |column| column.counts.len());
        let header = Header {
            episode: Some(self.episode),
            contacts,
            violations: self.tracker.take(),
            end: Some(end(public_description)),
            ..Header::new(
                &contest(outcome.task),
                0,
                u32::try_from(samples).unwrap_or(u32::MAX),
            )
        };
        EpisodeClips {
            observed: Clip {
                header: Header {
                    kind: ClipKind::Observed,
                    side: Some(0),
                    contacts: Vec::new(),
                    violations: Vec::new(),
                    late,
                    tracking_gaps,
                    end: Some(end(description)),
                    ..header.clone()
                },
                columns: observed_columns,
            },
            motion: Clip {
                header,
                columns: motion_columns,
            },
            summary,
        }
    }
}

impl EpisodeClips {
    /// The compressed bytes of both clips.
    pub fn compressed(&self, gzip: &mut Gzip) -> Result<[Vec<u8>; 2], ReplayError> {
        Ok([
            self.motion.compressed(gzip)?,
            self.observed.compressed(gzip)?,
        ])
    }
}

/// The world of air hockey behind the trait; `None` for another world.
fn world(world: &dyn World) -> Option<&AirHockeyWorld> {
    world.as_any().downcast_ref()
}

/// The contest in a clip's header: the task's name.
fn contest(task: Task) -> String {
    task.as_str().to_owned()
}

/// x, y, vx, vy, rounded to 0.1 mm and 0.1 mm/s.
fn position_and_velocity([x, y, _, vx, vy, _]: &[f64; 6]) -> [f64; 4] {
    [x, y, vx, vy].map(|value| (value * 1e4).round() / 1e4)
}
