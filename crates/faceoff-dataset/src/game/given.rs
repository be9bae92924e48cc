//! What nothing but the record of a game tells: answers, their times, faults, and how a side got ready.

use crate::{
    dataset::Columns, interpolation_text, table::SIDE_TIMES, times::seconds, verify::Difference,
};
use arrow_array::{
    Array, Float64Array, Int64Array, ListArray, RecordBatch,
    cast::AsArray,
    types::{Float64Type, Int64Type},
};
use faceoff_episode::{AnswerTiming, Effect, RallyEntry, Response, SideFault};
use faceoff_types::{ACTION_LIMIT, AgentFault, AgentFaultKind, AgentTask, Interpolation, Side};

/// Where something is recorded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub file: &'static str,
    pub rally: u32,
    pub step: Option<u32>,
}

impl Place {
    pub fn differs(
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

/// How one side got ready for a rally, and its fault in it.
#[derive(Debug)]
pub(super) struct GivenEntry {
    pub entry: RallyEntry,
    /// Its fault at one of the rally's steps.
    pub later: Option<AgentFault>,
}

impl GivenEntry {
    /// From a row; `must_start` says whether the side had to be started.
    pub fn read(
        row: &RecordBatch,
        side: Side,
        must_start: bool,
        at: Place,
    ) -> Result<Self, Difference> {
        let columns = Columns(row);
        let fault = columns
            .text("fault", 0)
            .map(serde_json::from_str::<AgentFault>)
            .transpose()
            .map_err(|error| at.differs("fault", error.to_string(), "a fault as JSON"))?;
        if let Some(fault) = &fault {
            let its_own = fault.agent_task == AgentTask::Game { side };
            let in_time = match (fault.episode, fault.step) {
                (None, None) => true,
                (Some(rally), _) => rally == at.rally,
                (None, Some(_)) => false,
            };
            if !(its_own && in_time) {
                let expected = format!("a fault of side {} in this rally", side.number());
                return Err(at.differs("fault", fault.to_string(), expected));
            }
        }
        // A world diverges by an answer, and that it did is seen again when the answer is played.
        if let Some(fault) = &fault
            && matches!(fault.fault, AgentFaultKind::Diverged { .. })
            && fault.step.is_none()
        {
            let expected = "a fault that the agent was seen to make";
            return Err(at.differs("fault", fault.to_string(), expected));
        }
        let startup_s = time(row, "startup_ns", 0, at)?;
        let reset_s = time(row, "reset_ns", 0, at)?;
        let interpolation = columns
            .text("interpolation", 0)
            .map(|text| {
                interpolation_text::parse(text)
                    .ok_or_else(|| at.differs("interpolation", text, "1 to 5, -1 or null"))
            })
            .transpose()?;
        match (startup_s.is_some(), must_start) {
            (true, false) => {
                let expected = "nothing: it had been started before";
                return Err(at.differs("startup_ns", "a time", expected));
            }
            (false, true) => {
                let expected = "a time: it had to be started";
                return Err(at.differs("startup_ns", "nothing", expected));
            }
            _ => {}
        }
        let started = fault.as_ref().is_none_or(|fault| fault.episode.is_some());
        let (entry, later) = match (startup_s, interpolation, reset_s) {
            (Some(startup_s), None, None) if !started => {
                let fault = fault.map(side_fault).ok_or_else(|| {
                    at.differs("fault", "nothing", "the fault by which it did not start")
                })?;
                (RallyEntry::StartFailed { startup_s, fault }, None)
            }
            (startup_s, Some(interpolation), Some(reset_s)) if started => match fault {
                Some(fault) if fault.step.is_none() => {
                    let entry = RallyEntry::ResetFailed {
                        startup_s,
                        interpolation,
                        reset_s,
                        fault: side_fault(fault),
                    };
                    (entry, None)
                }
                later => {
                    let entry = RallyEntry::Ready {
                        startup_s,
                        interpolation,
                        reset_s,
                    };
                    (entry, later)
                }
            },
            (_, interpolation, _) => {
                let recorded = interpolation.map_or("nothing".to_owned(), |code| code.to_string());
                let expected = if started {
                    "the agent's, with the time of its reset"
                } else {
                    "nothing, and no time of a reset: it had not started"
                };
                return Err(at.differs("interpolation", recorded, expected));
            }
        };
        Ok(Self { entry, later })
    }
}

fn side_fault(fault: AgentFault) -> SideFault {
    SideFault {
        kind: fault.fault,
        line: fault.line,
    }
}

/// What came from one side in a control step.
#[derive(Debug)]
pub(super) enum GivenResponse {
    Answer {
        action: Float64Array,
        answered: AnswerTiming,
    },
    Fault {
        fault: SideFault,
        answered: AnswerTiming,
    },
    Held,
}

impl GivenResponse {
    /// From a row of the side's steps. `asked`: was it to be asked? `fault` is the one that its entry tells.
    pub fn read(
        steps: &RecordBatch,
        row: usize,
        interpolation: Interpolation,
        asked: bool,
        fault: Option<&AgentFault>,
        at: Place,
    ) -> Result<Self, Difference> {
        let text = Columns(steps).text("effect", row).unwrap_or("nothing");
        let effect = Effect::ALL
            .into_iter()
            .find(|effect| effect.as_str() == text);
        let wrong = |expected: &str| Err(at.differs("effect", text, expected));
        match effect {
            None => wrong("in_time, late, fault or held"),
            Some(Effect::Held) if asked => wrong("in_time, late or fault: it had no fault before"),
            Some(Effect::Held) => Ok(Self::Held),
            Some(_) if !asked => wrong("held, after its fault"),
            Some(Effect::Fault) => {
                let fault = fault.filter(|fault| fault.step == at.step);
                let Some(fault) = fault.cloned() else {
                    return wrong("in_time or late: no fault of this step is recorded");
                };
                if matches!(fault.fault, AgentFaultKind::Diverged { .. }) {
                    return wrong("in_time or late: a world diverges by an answer");
                }
                Ok(Self::Fault {
                    fault: side_fault(fault),
                    answered: answered(steps, row, at)?,
                })
            }
            Some(Effect::InTime | Effect::Late) => Ok(Self::Answer {
                action: action(steps, row, interpolation, at)?,
                answered: answered(steps, row, at)?,
            }),
        }
    }

    pub fn response(&self) -> Response<'_> {
        match self {
            Self::Answer { action, answered } => Response::Answer {
                action: action.values(),
                timing: *answered,
            },
            Self::Fault { fault, answered } => Response::Fault {
                fault: fault.clone(),
                timing: *answered,
            },
            Self::Held => Response::Held,
        }
    }
}

/// The recorded action: it is the simulation's input, so it must be one.
fn action(
    steps: &RecordBatch,
    row: usize,
    interpolation: Interpolation,
    at: Place,
) -> Result<Float64Array, Difference> {
    let expected = format!(
        "{} numbers of at most {ACTION_LIMIT} in magnitude",
        interpolation.len()
    );
    let actions: &ListArray = steps["action"].as_list();
    if actions.is_null(row) {
        return Err(at.differs("action", "nothing", expected));
    }
    let values = actions.value(row);
    let action: &Float64Array = values.as_primitive::<Float64Type>();
    let there = action.len() - action.null_count();
    if there != interpolation.len() || action.null_count() > 0 {
        return Err(at.differs("action", format!("{there} numbers"), expected));
    }
    let allowed = |number: &&f64| number.abs() <= ACTION_LIMIT;
    match action.values().iter().find(|number| !allowed(number)) {
        Some(number) => Err(at.differs("action", format!("{number:?}"), expected)),
        None => Ok(action.clone()),
    }
}

fn answered(steps: &RecordBatch, row: usize, at: Place) -> Result<AnswerTiming, Difference> {
    let [computation, host, cpu] = SIDE_TIMES;
    let needed = |name: &str| {
        time(steps, name, row, at)?.ok_or_else(|| at.differs(name, "nothing", "a time"))
    };
    Ok(AnswerTiming {
        computation_time_s: needed(computation)?,
        host_time_s: needed(host)?,
        cpu_time_s: time(steps, cpu, row, at)?,
    })
}

/// A recorded time in seconds, which nothing else tells.
fn time(rows: &RecordBatch, name: &str, row: usize, at: Place) -> Result<Option<f64>, Difference> {
    let column: &Int64Array = rows[name].as_primitive::<Int64Type>();
    if column.is_null(row) {
        return Ok(None);
    }
    match column.value(row) {
        negative @ ..0 => Err(at.differs(name, negative.to_string(), "at least 0")),
        time => Ok(Some(seconds(time))),
    }
}
