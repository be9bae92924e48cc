//! A competition of a mass on a line, which the agent accelerates. It has nothing of air hockey: two tasks, one kind of violation, no
//! tiers, one layout of actions, and profiles with a constant wind.

use faceoff_episode::{
    Conditions, InvalidConditions, Simulator, StateColumns, World, WorldFactory,
};
use faceoff_types::*;
use std::{any::Any, sync::Arc};

/// Come to the origin.
pub const REACH: Task = Task::new("reach");
/// Be at the origin, at rest, when the time is up.
pub const SETTLE: Task = Task::new("settle");
pub const SPEEDING: ViolationName = ViolationName::new("speeding");
pub const CALM: Profile = Profile::new("calm");
pub const WINDY: Profile = Profile::new("windy");
const ARRIVED: EpisodeEnd = EpisodeEnd::new("arrived");

const STEP_S: f64 = 0.1;
const SPEED_LIMIT_M_S: f64 = 1.0;
const TOLERANCE: f64 = 0.05;

/// The competition with its simulator.
#[derive(Debug)]
pub struct PointMass {
    competition: Arc<Competition>,
}

impl PointMass {
    pub fn new() -> Arc<Self> {
        let task = |task, title: &str, aim: &str| TaskInfo {
            task,
            title: title.to_owned(),
            aim: aim.to_owned(),
            achievement: "arrival".to_owned(),
            drawing: String::new(),
            weight: Millionths::new(500_000),
            max_steps: 80,
            control_step_s: STEP_S,
        };
        let profile = |profile, letter, description: &str| ProfileInfo {
            profile,
            title: profile.to_string(),
            description: description.to_owned(),
            letter,
            is_in_ablations: true,
        };
        let end = |end, title: &str| EndInfo {
            end,
            title: title.to_owned(),
        };
        let columns = || ["position", "velocity"].map(RecordingColumn::new).into();
        Arc::new(Self {
            competition: Arc::new(Competition {
                id: "point-mass".to_owned(),
                title: "Point Mass Challenge".to_owned(),
                short_title: "Point Mass".to_owned(),
                subject: "pushing a point mass".to_owned(),
                summary: "Programs push a point mass.".to_owned(),
                has_replays: false,
                has_games: false,
                tasks: vec![
                    task(REACH, "Reach", "Come to the origin."),
                    task(SETTLE, "Settle", "Come to rest at the origin."),
                ],
                rulesets: vec![RulesetInfo {
                    ruleset: Ruleset::new("points-1"),
                    action_limit: ACTION_LIMIT,
                }],
                ends: vec![
                    end(EpisodeEnd::HORIZON, "time limit reached"),
                    end(ARRIVED, "arrived"),
                    end(EpisodeEnd::AGENT_FAULT, "agent fault"),
                ],
                violations: vec![ViolationInfo {
                    name: SPEEDING,
                    title: "speed".to_owned(),
                    column_heading: "too fast".to_owned(),
                    short: "fast".to_owned(),
                    description: "too fast".to_owned(),
                    measure: "Speed, m/s beyond the limit.".to_owned(),
                    points: [2.0, 2.0],
                }],
                tiers: None,
                profiles: vec![
                    profile(CALM, 'C', "No wind."),
                    profile(WINDY, 'W', "A constant wind."),
                ],
                ideal_profile: CALM,
                counting_profile: WINDY,
                magnitudes: vec![MagnitudeInfo {
                    group: "wind".to_owned(),
                    name: "strength_m_s2".to_owned(),
                    description: "The strongest wind of a season.".to_owned(),
                    default: Magnitude::Number(0.2),
                    bounds: [0.0, 1.0],
                }],
                actions: ActionSpace {
                    agents_choose_layout: false,
                    layouts: vec![ActionLayout::new(None, &[1])],
                },
                recording: RecordingColumns {
                    observation: columns(),
                    state: columns(),
                    limits: vec![SPEEDING],
                },
            }),
        })
    }
}

impl Simulator for PointMass {
    fn competition(&self) -> &Arc<Competition> {
        &self.competition
    }

    fn fingerprint(&self) -> &str {
        "point mass 1"
    }

    fn hello_env(&self, agent_task: AgentTask) -> Result<String, UnknownTask> {
        self.competition.find_task(agent_task.name().as_str())?;
        Ok(format!(r#"{{"step_s":{STEP_S}}}"#))
    }

    fn world_factory(
        &self,
        conditions: &Conditions<'_>,
    ) -> Result<Box<dyn WorldFactory>, InvalidConditions> {
        self.competition.find_profile(conditions.profile.as_str())?;
        let strength = conditions.perturbations.get("wind", "strength_m_s2");
        let strength_m_s2 = match strength {
            None => 0.2,
            Some(Magnitude::Number(strength)) => strength,
            Some(other) => return Err(InvalidConditions::Magnitudes(format!("wind is {other}"))),
        };
        let is_windy = conditions.profile == WINDY;
        Ok(Box::new(Line {
            seed: conditions.seed,
            wind_m_s2: if is_windy {
                strength_m_s2 * fraction(conditions.mismatch_seed)
            } else {
                0.0
            },
            competition: self.competition.clone(),
        }))
    }
}

/// A number from 0 to 1 that the seed determines.
fn fraction(seed: Seed) -> f64 {
    f64::from(seed.as_bytes()[0]) / 255.0
}

/// Creates the world of each episode: a mass at a start position that the seed determines.
struct Line {
    seed: Seed,
    wind_m_s2: f64,
    competition: Arc<Competition>,
}

impl WorldFactory for Line {
    fn seed(&self, task: Task, index: u32) -> Seed {
        self.seed.episode(task, index)
    }

    fn max_steps(&self, task: Task) -> u32 {
        self.competition.max_steps(task)
    }

    fn reset(
        &self,
        task: Task,
        index: u32,
        _: Option<ActionLayout>,
    ) -> Result<Box<dyn World>, UnknownTask> {
        let task = self.competition.find_task(task.as_str())?;
        let start_m = 1.0 + fraction(self.seed(task, index));
        Ok(Box::new(Mass {
            task,
            wind_m_s2: self.wind_m_s2,
            state: [start_m, 0.0],
            excess: [-SPEED_LIMIT_M_S],
            steps: 0,
            was_speeding: false,
        }))
    }
}

/// The world of an episode.
struct Mass {
    task: Task,
    wind_m_s2: f64,
    /// Position (m) and velocity (m/s).
    state: [f64; 2],
    /// Speed beyond the limit, m/s.
    excess: [f64; 1],
    steps: u32,
    was_speeding: bool,
}

impl World for Mass {
    fn steps(&self) -> u32 {
        self.steps
    }

    fn observation(&self) -> &[f64] {
        &self.state
    }

    fn step(&mut self, action: &[f64]) -> Option<EpisodeEnd> {
        self.state[1] += (action[0] + self.wind_m_s2) * STEP_S;
        self.state[0] += self.state[1] * STEP_S;
        self.excess = [self.state[1].abs() - SPEED_LIMIT_M_S];
        self.was_speeding |= self.excess[0] > 0.0;
        self.steps += 1;
        (self.task == REACH && self.success()).then_some(ARRIVED)
    }

    fn divergence(&self) -> Option<String> {
        let has_diverged = self.state[0].abs() > 100.0;
        has_diverged.then(|| "the mass is lost".to_owned())
    }

    fn success(&self) -> bool {
        let [position, velocity] = self.state;
        position.abs() < TOLERANCE && (self.task == REACH || velocity.abs() < TOLERANCE)
    }

    fn violations(&self) -> Violations {
        [(SPEEDING, self.was_speeding)].into_iter().collect()
    }

    fn record_state(&self, columns: &mut dyn StateColumns) {
        columns.put(&self.state);
    }

    fn constraint_values(&self) -> &[f64] {
        &self.excess
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
