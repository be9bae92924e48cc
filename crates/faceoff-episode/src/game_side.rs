use crate::{
    game_record::{Entry, SideFault},
    record::Answered,
    time_sum::TimeSum,
};
use faceoff_sim::ConstraintValues;
use faceoff_types::{
    AgentFault, Contest, ForfeitCause, GameFault, GameLimits, GameWindow, Phase, Side, SideOutcome,
};

/// One side of a game under way: what it has done so far.
#[derive(Debug, Clone)]
pub(crate) struct SideCourse {
    side: Side,
    /// Its fault in this rally: its arm holds since then.
    fault: Option<AgentFault>,
    /// It must be started before it can play.
    needs_start: bool,
    window: GameWindow,
    window_times: TimeSum,
    windows: Vec<GameWindow>,
    faults: Vec<GameFault>,
    late_answers: u32,
    /// Computation times of all answers, in order, in seconds.
    answer_times_s: Vec<f64>,
    time_used_s: f64,
}

impl SideCourse {
    pub fn new(side: Side) -> Self {
        Self {
            side,
            fault: None,
            needs_start: true,
            window: GameWindow::default(),
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

    /// Its fault in this rally.
    pub const fn fault(&self) -> Option<&AgentFault> {
        self.fault.as_ref()
    }

    /// Gets ready for a rally, or fails to.
    pub fn enter(&mut self, entry: &Entry, rally: u32, game_step: u32) {
        self.fault = None;
        self.needs_start = false;
        self.time_used_s += entry.time_s();
        match entry {
            Entry::Plays { .. } => {}
            Entry::FailedToStart { fault, .. } => {
                self.fail(fault.clone(), Phase::StartUp, rally, 0, game_step);
            }
            Entry::FailedToReset { fault, .. } => {
                self.fail(fault.clone(), Phase::Reset, rally, 0, game_step);
            }
        }
    }

    /// Counts its fault; it has at most one in a rally.
    pub fn fail(&mut self, fault: SideFault, phase: Phase, rally: u32, step: u32, game_step: u32) {
        let fault = AgentFault {
            fault: fault.kind,
            contest: Contest::Game { side: self.side },
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

    pub fn answer(&mut self, answered: &Answered, is_late: bool) {
        self.late_answers += u32::from(is_late);
        self.window_times.add(answered.computation_time_s);
        self.answer_times_s.push(answered.computation_time_s);
        self.spend(answered.computation_time_s);
    }

    /// Counts time that was no answer's.
    pub fn spend(&mut self, time_s: f64) {
        self.time_used_s += time_s;
    }

    /// Counts a control step.
    pub fn step(&mut self, constraints: &ConstraintValues) {
        self.window.steps += 1;
        constraints.mark(&mut self.window.violations);
    }

    /// A window of the game is over.
    pub fn end_window(&mut self) {
        let window = std::mem::take(&mut self.window);
        let times = std::mem::take(&mut self.window_times);
        self.windows.push(GameWindow {
            computation_time: times.summary(),
            ..window
        });
    }

    /// What it has used up, if anything.
    pub fn forfeits(&self, limits: &GameLimits) -> Option<ForfeitCause> {
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

    /// All that it did, and the computation times of its answers.
    ///
    /// A window is something that was played, and both sides have the same ones: a fault by which the game ends as a
    /// window would begin is one of the last that was played, if there is any.
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

    /// A window of no steps was counted for the side that forfeited as a window would begin, and not for the other.
    #[test]
    fn a_fault_as_a_window_would_begin_makes_no_window_that_nobody_played() {
        let mut side = SideCourse::new(Side::First);
        for _ in 0..WINDOW_STEPS {
            side.step(&ConstraintValues::default());
        }
        side.end_window();
        let failed = Entry::FailedToStart {
            startup_s: 1.0,
            fault: SideFault {
                kind: AgentFaultKind::ClosedOutput,
                line: None,
            },
        };
        side.enter(&failed, 1, WINDOW_STEPS);
        // The game goes on: the fault is the next window's.
        let mut goes_on = side.clone();
        goes_on.step(&ConstraintValues::default());
        let faults = |side: SideCourse| -> Vec<(u32, u32)> {
            let windows = side.finish(0, 0).0.windows;
            windows.iter().map(|w| (w.steps, w.faults)).collect()
        };
        assert_eq!(faults(goes_on), [(WINDOW_STEPS, 0), (1, 1)]);
        // The game is over.
        assert_eq!(faults(side), [(WINDOW_STEPS, 1)]);
    }
}
