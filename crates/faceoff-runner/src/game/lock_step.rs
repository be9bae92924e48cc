//! Both sides are asked before either is waited for, and whatever one does, the other's clock is its own. Where both
//! share CPUs, who has answered is frozen until it is asked again: it would compute in the other's time.

use super::side_player::SidePlayer;
use crate::{calibration::Calibration, fault::PlatformFault, session::Session};
use faceoff_episode::{GameCourse, GameSink, Question};
use faceoff_sandbox::{Layer, SandboxError};
use faceoff_types::{Side, TimeLimits};
use std::time::{Duration, Instant};

/// What takes longer than this while one side is seen to has kept us from looking at the other.
const AWAY: Duration = Duration::from_millis(1);

/// What becomes of a side that has answered before the other one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OnceAnswered {
    /// It has CPUs of its own.
    GoesOn,
    /// It is frozen until it is asked again.
    IsFrozen,
}

/// Plays a game to its end; `cancelled` is asked before each step.
pub(super) fn play<S: GameSink>(
    course: &mut GameCourse<S>,
    sides: &mut [SidePlayer<'_>; 2],
    calibrations: &mut [Calibration; 2],
    answered: OnceAnswered,
    cancelled: impl Fn(&mut S) -> bool,
) -> Result<(), PlatformFault> {
    while course.end().is_none() {
        get_ready(course, sides, answered)?;
        let (rally, mut steps) = (course.rally(), 0);
        while course.is_in_rally() {
            if cancelled(course.sink()) {
                return Err(PlatformFault::Cancelled);
            }
            step(course, sides, answered)?;
            steps += 1;
        }
        for side in &mut *sides {
            side.tell_end(rally, steps)?;
            rest(side, answered);
        }
        for calibration in &mut *calibrations {
            calibration.between_episodes()?;
        }
    }
    for side in sides {
        side.finish()?;
    }
    Ok(())
}

/// Starts who must be started, announces the rally to both, and begins it.
fn get_ready<S: GameSink>(
    course: &mut GameCourse<S>,
    sides: &mut [SidePlayer<'_>; 2],
    answered: OnceAnswered,
) -> Result<(), PlatformFault> {
    let rally = course.rally();
    let [first, second] = sides;
    rest(second, answered);
    let first_started = first.start()?;
    rest(first, answered);
    let second_started = second.start()?;
    if answered == OnceAnswered::IsFrozen && !(first.can_freeze() && second.can_freeze()) {
        return Err(no_freezer().into());
    }
    ask_both(sides, |_, player| {
        player.ask(|session| session.send_reset(rally))
    })?;
    wait_for_both(sides, answered)?;
    let [first, second] = sides;
    let entries = [first.entry(first_started), second.entry(second_started)];
    course.start_rally(entries)?;
    end_faulty(course, sides);
    Ok(())
}

/// Stops a side that is asked nothing, until it is asked again.
fn rest(side: &mut SidePlayer<'_>, answered: OnceAnswered) {
    if answered == OnceAnswered::IsFrozen {
        side.freeze();
    }
}

/// Asks both for one step and plays it.
fn step<S: GameSink>(
    course: &mut GameCourse<S>,
    sides: &mut [SidePlayer<'_>; 2],
    answered: OnceAnswered,
) -> Result<(), PlatformFault> {
    let questions = [
        course.question(Side::First)?,
        course.question(Side::Second)?,
    ];
    ask_both(sides, |side, player| match questions[side.index()] {
        Some(Question { step, observation }) => {
            player.ask(|session| session.send_step(step, observation))
        }
        None => Ok(()),
    })?;
    wait_for_both(sides, answered)?;
    let [first, second] = &*sides;
    course.answer([first.response(), second.response()])?;
    end_faulty(course, sides);
    Ok(())
}

/// Ends the processes of who has a fault in this rally, if they run.
fn end_faulty<S: GameSink>(course: &GameCourse<S>, sides: &mut [SidePlayer<'_>; 2]) {
    for (side, player) in Side::BOTH.into_iter().zip(sides) {
        if let Some(fault) = course.fault(side)
            && !player.is_noted()
        {
            player.end_by(fault);
        }
    }
}

/// Asks one after the other.
fn ask_both(
    sides: &mut [SidePlayer<'_>; 2],
    mut ask: impl FnMut(Side, &mut SidePlayer<'_>) -> Result<(), PlatformFault>,
) -> Result<(), PlatformFault> {
    let [first, second] = sides;
    ask(Side::First, first)?;
    let before = Instant::now();
    ask(Side::Second, second)?;
    tell_if_away(first, before);
    Ok(())
}

/// Waits until neither side's answer is due; the first that comes is taken first.
fn wait_for_both(
    sides: &mut [SidePlayer<'_>; 2],
    answered: OnceAnswered,
) -> Result<(), PlatformFault> {
    let [first, second] = sides;
    loop {
        match (first.due(), second.due()) {
            (None, None) => return Ok(()),
            (Some(_), None) => wait_for_last(first, second, answered)?,
            (None, Some(_)) => wait_for_last(second, first, answered)?,
            (Some(a), Some(b)) => {
                Session::wait_for_any(&[a, b], Instant::now() + TimeLimits::LONGEST)?;
                look(first, second)?;
                look(second, first)?;
            }
        }
    }
}

/// For so long nobody is frozen for the other's sake: to freeze and thaw takes longer than most answers, and
/// the little that can be computed meanwhile counts as the next step's, as in any game.
const FREEZES_AFTER: Duration = Duration::from_micros(200);

/// Waits for the side that is late, whose other has answered.
fn wait_for_last(
    late: &mut SidePlayer<'_>,
    other: &mut SidePlayer<'_>,
    answered: OnceAnswered,
) -> Result<(), PlatformFault> {
    if answered == OnceAnswered::IsFrozen {
        late.look(Instant::now() + FREEZES_AFTER)?;
        if late.due().is_none() {
            return Ok(());
        }
        other.freeze();
    }
    late.look(Instant::now() + TimeLimits::LONGEST)
}

fn no_freezer() -> SandboxError {
    SandboxError::Unavailable {
        layer: Layer::CgroupCpu,
        why: "the agents of a game share CPUs here, so that who has answered must be stopped until it is asked again, \
              and this service may use no freezer of cgroups: give each side CPUs of its own (three for a slot), run the \
              service as root, or hand it a cgroup of the freezer as of the other controllers"
            .to_owned(),
    }
}

/// Looks at one side. To learn how an agent ended may take seconds, which are not the other's.
fn look(looked_at: &mut SidePlayer<'_>, other: &mut SidePlayer<'_>) -> Result<(), PlatformFault> {
    let before = Instant::now();
    looked_at.look(before)?;
    tell_if_away(other, before);
    Ok(())
}

fn tell_if_away(other: &mut SidePlayer<'_>, since: Instant) {
    let away = since.elapsed();
    if away > AWAY {
        other.was_not_looked_at(away);
    }
}
