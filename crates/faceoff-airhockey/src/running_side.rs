//! One *side* (agent and robot) of a running game. A game is divided into *windows* of equal length, which scoring treats like
//! episodes.

use crate::game_record::{RallyReadiness, SideFault};
use faceoff_episode::{AnswerTiming, TimeSum};
use faceoff_sim::{ConstraintValues, ViolatedConstraints};
use faceoff_types::{
    AgentFault, AgentTask, ForfeitCause, GameFault, GameLimits, GameWindow, Phase, Side,
    SideOutcome,
};

/// The state of one side of a running game.
#[derive(Debug, Clone)]
pub(crate) struct RunningSide {
    side: Side,
    /// The fault in this rally; after it the side's arm holds its position.
    fault: Option<AgentFault>,
    /// Must the side's agent be started before the next rally?
    needs_start: bool,
    /// The current window.
    window: GameWindow,
    /// Constraints violated in the current window.
    violated: ViolatedConstraints,
    /// Computation times of the answers in the current window.
    window_times: TimeSum,
    /// The windows before the current one.
    windows: Vec<GameWindow>,
    /// All faults of the game so far.
    faults: Vec<GameFault>,
    late_answers: u32,
    /// Computation times of all answers, in order, in seconds.
    answer_times_s: Vec<f64>,
    /// Total time for start-ups, resets and answers, in seconds.
    time_used_s: f64,
}

impl RunningSide {
    pub fn new(side: Side) -> Self {
        Self {
            side,
            fault: None,
            needs_start: true,
            window: GameWindow::default(),
            violated: ViolatedConstraints::default(),
            window_times: TimeSum::default(),
            windows: Vec::new(),
            faults: Vec::new(),
            late_answers: 0,
            answer_times_s: Vec::new(),
            time_used_s: 0.0,
        }
    }

    pub const fn needs_start(&self) -> bool {
        self.needs_start
    }

    /// The fault in this rally.
    pub const fn fault(&self) -> Option<&AgentFault> {
        self.fault.as_ref()
    }

    /// Records the start of a rally, or the failure to get ready for it.
    pub fn start_rally(&mut self, readiness: &RallyReadiness, rally: u32, game_step: u32) {
        self.fault = None;
        self.needs_start = false;
        self.time_used_s += readiness.time_s();
        match readiness {
            RallyReadiness::Ready { .. } => {}
            RallyReadiness::StartFailed { fault, .. } => {
                self.record_fault(fault.clone(), Phase::StartUp, rally, 0, game_step);
            }
            RallyReadiness::ResetFailed { fault, .. } => {
                self.record_fault(fault.clone(), Phase::Reset, rally, 0, game_step);
            }
        }
    }

    /// Records a fault. There is at most one per rally.
    pub fn record_fault(
        &mut self,
        fault: SideFault,
        phase: Phase,
        rally: u32,
        step: u32,
        game_step: u32,
    ) {
        let fault = AgentFault {
            fault: fault.kind,
            agent_task: AgentTask::Game { side: self.side },
            episode: (phase != Phase::StartUp).then_some(rally),
            step: (phase == Phase::Step).then_some(step),
            line: fault.line,
        };
        self.window.faults += 1;
        self.needs_start = true;
        self.faults.push(GameFault {
            game_step,
            fault: fault.clone(),
        });
        self.fault = Some(fault);
    }

    pub fn record_answer(&mut self, timing: &AnswerTiming, is_late: bool) {
        self.late_answers += u32::from(is_late);
        self.window_times.add(timing.computation_time_s);
        self.answer_times_s.push(timing.computation_time_s);
        self.add_time(timing.computation_time_s);
    }

    /// Adds time that is not the time of an answer.
    pub fn add_time(&mut self, time_s: f64) {
        self.time_used_s += time_s;
    }

    /// Records a control step in the current window.
    pub fn record_step(&mut self, constraints: &ConstraintValues) {
        self.window.steps += 1;
        constraints.mark(&mut self.violated);
    }

    /// Ends the current window.
    pub fn end_window(&mut self) {
        let window = std::mem::take(&mut self.window);
        let times = std::mem::take(&mut self.window_times);
        self.windows.push(GameWindow {
            computation_time: times.summary(),
            violations: std::mem::take(&mut self.violated).into(),
            ..window
        });
    }

    /// Why the side forfeits the game: the limit that it has exceeded, if any.
    pub fn forfeit_cause(&self, limits: &GameLimits) -> Option<ForfeitCause> {
        let (count, allowed) = (self.fault_count(), limits.max_faults);
        if count > allowed {
            return Some(ForfeitCause::Faults { count, allowed });
        }
        let (used_s, allowed_s) = (self.time_used_s, limits.total_s);
        (used_s > allowed_s).then_some(ForfeitCause::Time { used_s, allowed_s })
    }

    fn fault_count(&self) -> u32 {
        u32::try_from(self.faults.len()).unwrap_or(u32::MAX)
    }

    /// The outcome of the side, and the computation times of its answers.
    ///
    /// Windows have at least one step, and both sides have the same windows. If a fault ends the game between two windows, it
    /// counts in the last window, if there is one.
    pub fn finish(mut self, goals: u32, fouls: u32) -> (SideOutcome, Vec<f64>) {
        if self.window.steps > 0 {
            self.end_window();
        } else if let Some(last) = self.windows.last_mut() {
            last.faults += self.window.faults;
        }
        let outcome = SideOutcome {
            goals,
            fouls,
            windows: self.windows,
            answers: u32::try_from(self.answer_times_s.len()).unwrap_or(u32::MAX),
            late_answers: self.late_answers,
            faults: self.faults,
            time_used_s: self.time_used_s,
        };
        (outcome, self.answer_times_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::{AgentFaultKind, WINDOW_STEPS};

    /// Regression: the side that forfeited between two windows had a window without steps, unlike the other side.
    #[test]
    fn fault_between_windows_adds_no_empty_window() {
        let mut side = RunningSide::new(Side::First);
        for _ in 0..WINDOW_STEPS {
            side.record_step(&ConstraintValues::default());
        }
        side.end_window();
        let failed = RallyReadiness::StartFailed {
            startup_s: 1.0,
            fault: SideFault {
                kind: AgentFaultKind::ClosedOutput,
                line: None,
            },
        };
        side.start_rally(&failed, 1, WINDOW_STEPS);
        // If the game continues, the fault is in the next window.
        let mut continued = side.clone();
        continued.record_step(&ConstraintValues::default());
        // Steps and faults of each window.
        let faults = |side: RunningSide| -> Vec<(u32, u32)> {
            let windows = side.finish(0, 0).0.windows;
            windows.iter().map(|w| (w.steps, w.faults)).collect()
        };
        assert_eq!(faults(continued), [(WINDOW_STEPS, 0), (1, 1)]);
        // If the game is over, the fault is in the last window.
        assert_eq!(faults(side), [(WINDOW_STEPS, 1)]);
    }
}
