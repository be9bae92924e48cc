//! Inputs of a game that cannot be simulated and are read from its recording: answers, their times, faults, and the
//! start and reset of each side.

use crate::{dataset::Columns, table::SIDE_TIMES, times::seconds, verify::Difference};
use arrow_array::{
    Array, Float64Array, Int64Array, ListArray, RecordBatch,
    cast::AsArray,
    types::{Float64Type, Int64Type},
};
use faceoff_airhockey::{Effect, RallyReadiness, Response, SideFault, action_space};
use faceoff_episode::AnswerTiming;
use faceoff_sim::Interpolation;
use faceoff_types::{ACTION_LIMIT, AgentFault, AgentFaultKind, AgentTask, Side};

/// Location of a row in a recording.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowLocation {
    pub file: &'static str,
    pub rally: u32,
    pub step: Option<u32>,
}

impl RowLocation {
    pub fn difference(
        self,
        field: &str,
        recorded: impl Into<String>,
        expected: impl Into<String>,
    ) -> Difference {
        Difference {
            file: self.file,
            task: None,
            episode: None,
            rally: Some(self.rally),
            step: self.step,
            field: field.to_owned(),
            recorded: recorded.into(),
            expected: expected.into(),
        }
    }
}

/// How one side entered a rally (start and reset of its agent), and the side's fault in the rally.
#[derive(Debug)]
pub(super) struct RecordedEntry {
    pub readiness: RallyReadiness,
    /// The fault at one of the rally's steps.
    pub step_fault: Option<AgentFault>,
}

impl RecordedEntry {
    /// Reads a row; `must_start` says whether the side had to be started.
    pub fn read(
        row: &RecordBatch,
        side: Side,
        must_start: bool,
        location: RowLocation,
    ) -> Result<Self, Difference> {
        let columns = Columns(row);
        let fault = columns
            .text("fault", 0)
            .map(serde_json::from_str::<AgentFault>)
            .transpose()
            .map_err(|error| location.difference("fault", error.to_string(), "a fault as JSON"))?;
        if let Some(fault) = &fault {
            let is_own = fault.agent_task == AgentTask::Game { side };
            let is_current = match (fault.episode, fault.step) {
                (None, None) => true,
                (Some(rally), _) => rally == location.rally,
                (None, Some(_)) => false,
            };
            if !(is_own && is_current) {
                let expected = format!("a fault of side {} in this rally", side.number());
                return Err(location.difference("fault", fault.to_string(), expected));
            }
        }
        // A divergence is caused by an answer, and the simulation of that answer shows it.
        if let Some(fault) = &fault
            && matches!(fault.fault, AgentFaultKind::Diverged { .. })
            && fault.step.is_none()
        {
            let expected = "a fault of the agent at its start or reset";
            return Err(location.difference("fault", fault.to_string(), expected));
        }
        let startup_s = read_time(row, "startup_ns", 0, location)?;
        let reset_s = read_time(row, "reset_ns", 0, location)?;
        let interpolation = columns
            .text("interpolation", 0)
            .map(|text| {
                parse_interpolation(text).ok_or_else(|| {
                    location.difference("interpolation", text, action_space().codes_text())
                })
            })
            .transpose()?;
        match (startup_s.is_some(), must_start) {
            (true, false) => {
                let expected = "nothing: the agent was already running";
                return Err(location.difference("startup_ns", "a time", expected));
            }
            (false, true) => {
                let expected = "a time: the agent had to be started";
                return Err(location.difference("startup_ns", "nothing", expected));
            }
            _ => {}
        }
        // Only a fault at the agent's start names no rally (`episode`).
        let started = fault.as_ref().is_none_or(|fault| fault.episode.is_some());
        let (readiness, step_fault) = match (startup_s, interpolation, reset_s) {
            (Some(startup_s), None, None) if !started => {
                let fault = fault.map(side_fault).ok_or_else(|| {
                    location.difference("fault", "nothing", "the fault that prevented the start")
                })?;
                (RallyReadiness::StartFailed { startup_s, fault }, None)
            }
            (startup_s, Some(interpolation), Some(reset_s)) if started => match fault {
                Some(fault) if fault.step.is_none() => {
                    let readiness = RallyReadiness::ResetFailed {
                        startup_s,
                        interpolation,
                        reset_s,
                        fault: side_fault(fault),
                    };
                    (readiness, None)
                }
                step_fault => {
                    let readiness = RallyReadiness::Ready {
                        startup_s,
                        interpolation,
                        reset_s,
                    };
                    (readiness, step_fault)
                }
            },
            (_, interpolation, _) => {
                let recorded = interpolation.map_or("nothing".to_owned(), |code| code.to_string());
                let expected = if started {
                    "the agent's interpolation, with the time of its reset"
                } else {
                    "nothing, and no time of a reset: the agent had not started"
                };
                return Err(location.difference("interpolation", recorded, expected));
            }
        };
        Ok(Self {
            readiness,
            step_fault,
        })
    }
}

fn side_fault(fault: AgentFault) -> SideFault {
    SideFault {
        kind: fault.fault,
        line: fault.line,
    }
}

/// The response of one side in a control step.
#[derive(Debug)]
pub(super) enum RecordedResponse {
    Answer {
        action: Float64Array,
        timing: AnswerTiming,
    },
    Fault {
        fault: SideFault,
        timing: AnswerTiming,
    },
    /// No answer: the side had a fault earlier in the rally, and its robot holds still.
    Held,
}

impl RecordedResponse {
    /// Reads a row of the side's steps. `is_active` is true if the side had no fault earlier in the rally; `fault` is the
    /// fault in the side's [`RecordedEntry`].
    pub fn read(
        steps: &RecordBatch,
        row: usize,
        interpolation: Interpolation,
        is_active: bool,
        fault: Option<&AgentFault>,
        location: RowLocation,
    ) -> Result<Self, Difference> {
        let text = Columns(steps).text("effect", row).unwrap_or("nothing");
        let effect = Effect::ALL
            .into_iter()
            .find(|effect| effect.as_str() == text);
        let wrong = |expected: &str| Err(location.difference("effect", text, expected));
        match effect {
            None => wrong("in_time, late, fault or held"),
            Some(Effect::Held) if is_active => {
                wrong("in_time, late or fault: the side had no fault before")
            }
            Some(Effect::Held) => Ok(Self::Held),
            Some(_) if !is_active => wrong("held, after its fault"),
            Some(Effect::Fault) => {
                let fault = fault.filter(|fault| fault.step == location.step);
                let Some(fault) = fault.cloned() else {
                    return wrong("in_time or late: no fault of this step is recorded");
                };
                if matches!(fault.fault, AgentFaultKind::Diverged { .. }) {
                    return wrong("in_time or late: only an answer can make a world diverge");
                }
                Ok(Self::Fault {
                    fault: side_fault(fault),
                    timing: read_timing(steps, row, location)?,
                })
            }
            Some(Effect::InTime | Effect::Late) => Ok(Self::Answer {
                action: read_action(steps, row, interpolation, location)?,
                timing: read_timing(steps, row, location)?,
            }),
        }
    }

    pub fn response(&self) -> Response<'_> {
        match self {
            Self::Answer { action, timing } => Response::Answer {
                action: action.values(),
                timing: *timing,
            },
            Self::Fault { fault, timing } => Response::Fault {
                fault: fault.clone(),
                timing: *timing,
            },
            Self::Held => Response::Held,
        }
    }
}

/// The recorded action, checked, since it is an input of the simulation.
fn read_action(
    steps: &RecordBatch,
    row: usize,
    interpolation: Interpolation,
    location: RowLocation,
) -> Result<Float64Array, Difference> {
    let expected = format!(
        "{} numbers of at most {ACTION_LIMIT} in magnitude",
        interpolation.len()
    );
    let actions: &ListArray = steps["action"].as_list();
    if actions.is_null(row) {
        return Err(location.difference("action", "nothing", expected));
    }
    let values = actions.value(row);
    let action: &Float64Array = values.as_primitive::<Float64Type>();
    let present = action.len() - action.null_count();
    if present != interpolation.len() || action.null_count() > 0 {
        return Err(location.difference("action", format!("{present} numbers"), expected));
    }
    let allowed = |number: &&f64| number.abs() <= ACTION_LIMIT;
    match action.values().iter().find(|number| !allowed(number)) {
        Some(number) => Err(location.difference("action", format!("{number:?}"), expected)),
        None => Ok(action.clone()),
    }
}

fn read_timing(
    steps: &RecordBatch,
    row: usize,
    location: RowLocation,
) -> Result<AnswerTiming, Difference> {
    let [computation, host, cpu] = SIDE_TIMES;
    let required_time = |name: &str| {
        read_time(steps, name, row, location)?
            .ok_or_else(|| location.difference(name, "nothing", "a time"))
    };
    Ok(AnswerTiming {
        computation_time_s: required_time(computation)?,
        host_time_s: required_time(host)?,
        cpu_time_s: read_time(steps, cpu, row, location)?,
    })
}

/// A recorded time in seconds; `None` if the column is null.
fn read_time(
    rows: &RecordBatch,
    name: &str,
    row: usize,
    location: RowLocation,
) -> Result<Option<f64>, Difference> {
    let column: &Int64Array = rows[name].as_primitive::<Int64Type>();
    if column.is_null(row) {
        return Ok(None);
    }
    match column.value(row) {
        negative @ ..0 => Err(location.difference(name, negative.to_string(), "at least 0")),
        time => Ok(Some(seconds(time))),
    }
}

/// Parses the code of an interpolation: `1` … `5`, `-1` or `null`.
fn parse_interpolation(text: &str) -> Option<Interpolation> {
    let layout = action_space().parse(text)?;
    Interpolation::from_code(layout.code()).ok()
}
