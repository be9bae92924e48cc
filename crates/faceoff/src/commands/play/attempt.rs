//! One attempt at a game. It ends without a result if an agent starts without an answer and has not answered before.

use super::{bar::Bar, matchup::Matchup, table};
use crate::commands::{
    side_notes::Notes,
    silent_agent::{self, is_silent_start},
};
use faceoff_airhockey::{GameStepRow, RallyRow};
use faceoff_runner::{GameObserver, GameReport, PlatformFault};
use faceoff_types::{AgentFault, Seed, Side};
use std::{path::Path, sync::mpsc, thread};

/// Why an attempt has no result.
#[derive(Debug, thiserror::Error)]
pub(super) enum AttemptError {
    #[error(transparent)]
    Platform(#[from] PlatformFault),
    /// An agent never answered; the text says which, and for how long.
    #[error("{0}")]
    Silent(String),
}

/// One attempt at a game: its seed, which bundle is at home, and the output folder.
pub(super) struct Attempt<'a> {
    pub(super) seed: Seed,
    /// The second bundle is at home.
    pub(super) swapped: bool,
    pub(super) out: &'a Path,
}

/// Plays the games between two agents, and knows which of them have answered.
pub(super) struct GamePlayer<'a> {
    matchup: &'a Matchup,
    notes: Notes,
    /// Has each agent, in the sequence of the command line, answered in any game?
    has_answered: [bool; 2],
}

impl<'a> GamePlayer<'a> {
    pub(super) const fn new(matchup: &'a Matchup, notes: Notes) -> Self {
        Self {
            matchup,
            notes,
            has_answered: [false; 2],
        }
    }

    /// Plays a game. After 5 s without an answer, prints the likely causes.
    pub(super) fn play(
        &mut self,
        attempt: &Attempt<'_>,
        bar: &Bar,
    ) -> Result<GameReport, AttemptError> {
        let mut agents = self.matchup.agents();
        if attempt.swapped {
            agents.reverse();
            self.has_answered.reverse();
        }
        let names =
            Side::BOTH.map(|side| format!("side {} ({})", side.number(), agents[side.index()]));
        let (ended_start, ended_starts) = mpsc::channel();
        let (notes, printer) = (self.notes, bar.printer());
        let mut observer = StartObserver {
            bar,
            has_answered: self.has_answered,
            ended_start: Some(ended_start),
            silent: None,
            log: String::new(),
        };
        let played = thread::scope(|scope| {
            let names = names.each_ref().map(String::as_str);
            scope.spawn(move || {
                silent_agent::explain(&names, &ended_starts, |note| {
                    printer.suspend(|| notes.print(note));
                });
            });
            let Attempt { seed, swapped, out } = *attempt;
            let played = self.matchup.play(seed, swapped, out, &mut observer);
            // Closes the channel, which ends the thread above.
            observer.ended_start = None;
            played
        });
        let StartObserver {
            bar,
            has_answered,
            silent,
            log,
            ..
        } = observer;
        self.has_answered = has_answered;
        if attempt.swapped {
            self.has_answered.reverse();
        }
        match (played, silent) {
            (Err(PlatformFault::Cancelled), Some((side, fault))) => {
                let name = &names[side.index()];
                bar.print_above(|| {
                    if log.trim().is_empty() {
                        notes.print(format_args!("{name} wrote nothing to standard error"));
                    } else {
                        notes.print(format_args!("{}", table::log_tail(side, &log).trim_end()));
                    }
                });
                let reason = silent_agent::stop_reason(name, "game", &fault);
                Err(AttemptError::Silent(reason))
            }
            (played, _) => Ok(played?),
        }
    }
}

/// Shows the progress of a game, and stops it if a start of an agent ends without an answer and the agent has not answered before: its
/// other starts would end in the same way.
struct StartObserver<'a> {
    bar: &'a Bar,
    /// By side.
    has_answered: [bool; 2],
    /// Reports the end of each start; `None` when the game is over.
    ended_start: Option<mpsc::Sender<()>>,
    /// The side whose agent never answered, and the fault of its start.
    silent: Option<(Side, AgentFault)>,
    /// The log of that side.
    log: String,
}

impl GameObserver for StartObserver<'_> {
    fn on_start(&mut self, side: Side, fault: Option<&AgentFault>) {
        let has_answered = &mut self.has_answered[side.index()];
        match fault {
            None => *has_answered = true,
            Some(fault) if !*has_answered && is_silent_start(&fault.fault) => {
                self.silent = Some((side, fault.clone()));
            }
            Some(_) => {}
        }
        if let Some(ended_start) = &self.ended_start {
            // The receiver is gone after the first start of both sides.
            let _is_received = ended_start.send(());
        }
    }

    fn on_step(&mut self, _: &GameStepRow<'_>) {
        self.bar.add_step();
    }

    fn on_rally_end(&mut self, row: &RallyRow<'_>) {
        self.bar.show_score(row.score);
    }

    fn log(&mut self, side: Side, log: &str) {
        if self
            .silent
            .as_ref()
            .is_some_and(|(silent, _)| *silent == side)
        {
            log.clone_into(&mut self.log);
        }
    }

    fn cancelled(&self) -> bool {
        self.silent.is_some()
    }
}
