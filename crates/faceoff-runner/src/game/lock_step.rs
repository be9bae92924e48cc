//! Runs both sides of a game in *lock-step*: both get their question before the evaluator waits for either answer, and neither can affect
//! the measured time of the other. If both share CPUs, a side that has answered is frozen until its next
//! question, because it would otherwise compute in the other's time.

use super::side_player::{SidePlayer, StartResult};
use crate::{calibration::Calibration, fault::PlatformFault, session::Session};
use faceoff_airhockey::{GameSink, RunningGame};
use faceoff_episode::ActionRequest;
use faceoff_sandbox::{Layer, SandboxError};
use faceoff_types::{AgentFault, AgentTask, Side, TimeLimits};
use std::time::{Duration, Instant};

/// If handling one side takes longer than this, the time counts as *absence* of the evaluator for the other side, which is not charged
/// for it.
const MIN_ABSENCE: Duration = Duration::from_millis(1);

/// What happens to a side that has answered before the other one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AfterAnswer {
    /// It has its own CPUs and continues.
    Continue,
    /// It is frozen until its next question.
    Freeze,
}

/// A sink that also learns of the agents' starts, and can stop the game.
pub(super) trait ControllingSink: GameSink {
    /// An agent was started: it has answered `hello`, or had this fault.
    fn on_start(&mut self, side: Side, fault: Option<&AgentFault>);
    /// Should the game stop? Called after each start and before each step.
    fn cancelled(&self) -> bool;
}

/// Runs a game to its end, or until its sink stops it.
pub(super) fn play<S: ControllingSink>(
    game: &mut RunningGame<S>,
    sides: &mut [SidePlayer<'_>; 2],
    calibrations: &mut [Calibration; 2],
    after_answer: AfterAnswer,
) -> Result<(), PlatformFault> {
    while game.end().is_none() {
        start_rally(game, sides, after_answer)?;
        let (rally, mut steps) = (game.rally(), 0);
        while game.is_in_rally() {
            check_cancelled(game)?;
            step(game, sides, after_answer)?;
            steps += 1;
        }
        for side in &mut *sides {
            side.send_end(rally, steps)?;
            freeze_idle(side, after_answer);
        }
        for calibration in &mut *calibrations {
            calibration.measure_between_episodes()?;
        }
    }
    for side in sides {
        side.finish()?;
    }
    Ok(())
}

/// Starts the agents that are not running, announces the rally to both sides, and begins it.
fn start_rally<S: ControllingSink>(
    game: &mut RunningGame<S>,
    sides: &mut [SidePlayer<'_>; 2],
    after_answer: AfterAnswer,
) -> Result<(), PlatformFault> {
    let rally = game.rally();
    let [first, second] = sides;
    freeze_idle(second, after_answer);
    let first_start = first.start()?;
    report_start(game, Side::First, &first_start)?;
    freeze_idle(first, after_answer);
    let second_start = second.start()?;
    report_start(game, Side::Second, &second_start)?;
    if after_answer == AfterAnswer::Freeze && !(first.can_freeze() && second.can_freeze()) {
        return Err(missing_freezer_error().into());
    }
    ask_both(sides, |_, player| {
        player.ask(|session| session.send_reset(rally))
    })?;
    wait_for_both(sides, after_answer)?;
    let [first, second] = sides;
    let readiness = [
        first.rally_readiness(first_start),
        second.rally_readiness(second_start),
    ];
    game.start_rally(readiness)?;
    kill_faulty_agents(game, sides);
    Ok(())
}

/// Reports a start, after which the sink may stop the game.
fn report_start<S: ControllingSink>(
    game: &mut RunningGame<S>,
    side: Side,
    start: &StartResult,
) -> Result<(), PlatformFault> {
    match start {
        StartResult::Ready { startup_s: None } => return Ok(()),
        StartResult::Ready { startup_s: Some(_) } => game.sink().on_start(side, None),
        StartResult::Failed { fault, .. } => {
            let fault = AgentFault {
                fault: fault.kind.clone(),
                agent_task: AgentTask::Game { side },
                episode: None,
                step: None,
                line: fault.line.clone(),
            };
            game.sink().on_start(side, Some(&fault));
        }
    }
    check_cancelled(game)
}

fn check_cancelled<S: ControllingSink>(game: &mut RunningGame<S>) -> Result<(), PlatformFault> {
    if game.sink().cancelled() {
        Err(PlatformFault::Cancelled)
    } else {
        Ok(())
    }
}

/// Freezes a side without a pending question until its next question.
fn freeze_idle(side: &mut SidePlayer<'_>, after_answer: AfterAnswer) {
    if after_answer == AfterAnswer::Freeze {
        side.freeze();
    }
}

/// Requests one step from both sides and simulates it.
fn step<S: GameSink>(
    game: &mut RunningGame<S>,
    sides: &mut [SidePlayer<'_>; 2],
    after_answer: AfterAnswer,
) -> Result<(), PlatformFault> {
    let requests = [
        game.action_request(Side::First)?,
        game.action_request(Side::Second)?,
    ];
    ask_both(sides, |side, player| match requests[side.index()] {
        Some(ActionRequest { step, observation }) => {
            player.ask(|session| session.send_step(step, observation))
        }
        None => Ok(()),
    })?;
    wait_for_both(sides, after_answer)?;
    let [first, second] = &*sides;
    game.answer([first.response(), second.response()])?;
    kill_faulty_agents(game, sides);
    Ok(())
}

/// Kills the running processes of sides with a fault in this rally.
fn kill_faulty_agents<S: GameSink>(game: &RunningGame<S>, sides: &mut [SidePlayer<'_>; 2]) {
    for (side, player) in Side::BOTH.into_iter().zip(sides) {
        if let Some(fault) = game.fault(side)
            && !player.is_fault_logged()
        {
            player.end_with_fault(fault);
        }
    }
}

/// Asks the first side, then the second.
fn ask_both(
    sides: &mut [SidePlayer<'_>; 2],
    mut ask: impl FnMut(Side, &mut SidePlayer<'_>) -> Result<(), PlatformFault>,
) -> Result<(), PlatformFault> {
    let [first, second] = sides;
    ask(Side::First, first)?;
    let started_at = Instant::now();
    ask(Side::Second, second)?;
    record_absence(first, started_at);
    Ok(())
}

/// Waits until neither side's answer is pending; takes the answers in the order of their arrival.
fn wait_for_both(
    sides: &mut [SidePlayer<'_>; 2],
    after_answer: AfterAnswer,
) -> Result<(), PlatformFault> {
    let [first, second] = sides;
    loop {
        match (first.pending_session(), second.pending_session()) {
            (None, None) => return Ok(()),
            (Some(_), None) => wait_for_last(first, second, after_answer)?,
            (None, Some(_)) => wait_for_last(second, first, after_answer)?,
            (Some(first_session), Some(second_session)) => {
                Session::wait_for_any(
                    &[first_session, second_session],
                    Instant::now() + TimeLimits::MAX_WAIT,
                )?;
                poll_side(first, second)?;
                poll_side(second, first)?;
            }
        }
    }
}

/// Delay before a side that has answered is frozen. Freezing and thawing takes longer than most answers, and CPU
/// time used in this delay counts towards the next step, as in any game.
const FREEZE_DELAY: Duration = Duration::from_micros(200);

/// Waits for the side whose answer is still pending, after the other has answered.
fn wait_for_last(
    pending: &mut SidePlayer<'_>,
    other: &mut SidePlayer<'_>,
    after_answer: AfterAnswer,
) -> Result<(), PlatformFault> {
    if after_answer == AfterAnswer::Freeze {
        pending.poll(Instant::now() + FREEZE_DELAY)?;
        if pending.pending_session().is_none() {
            return Ok(());
        }
        other.freeze();
    }
    pending.poll(Instant::now() + TimeLimits::MAX_WAIT)
}

fn missing_freezer_error() -> SandboxError {
    SandboxError::Unavailable {
        layer: Layer::CgroupCpu,
        reason: "the agents of a game share CPUs here, so that an agent that has answered must be frozen until its \
                 next question, and this service may use no freezer of cgroups: give each side CPUs of its own (three \
                 for a slot), run the service as root, or give it a cgroup of the freezer as of the other controllers"
            .to_owned(),
    }
}

/// Checks without waiting whether one side has answered. Diagnosing the exit of an agent may take seconds, which must not count for the
/// other side.
fn poll_side(polled: &mut SidePlayer<'_>, other: &mut SidePlayer<'_>) -> Result<(), PlatformFault> {
    let started_at = Instant::now();
    polled.poll(started_at)?;
    record_absence(other, started_at);
    Ok(())
}

/// Records the time since `started_at` as absence of the evaluator for the side `other`.
fn record_absence(other: &mut SidePlayer<'_>, started_at: Instant) {
    let absence = started_at.elapsed();
    if absence > MIN_ABSENCE {
        other.add_absence(absence);
    }
}
