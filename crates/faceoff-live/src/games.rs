//! Live state of games that are being played, for viewers in the browser. The database gets a game's result when the game ends.

use faceoff_types::{GameEvent, GameId, LiveEvent, LiveGame, LivePosition};
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use tokio::sync::watch;

/// Number of finished games that are kept, so that late viewers still see their end.
const MAX_FINISHED_LIVE_GAMES: usize = 32;

/// The games that the server's own slots and remote workers play, and the last finished ones. Cloning is cheap. Updating a
/// game never waits for its viewers.
#[derive(Debug, Clone, Default)]
pub struct LiveGames {
    /// In the order in which they were last started.
    games: Arc<Mutex<VecDeque<GameChannel>>>,
}

/// A game with the channel to its viewers.
type GameChannel = (GameId, watch::Sender<LiveAttempt>);

/// The live data of an attempt at a game.
#[derive(Debug)]
struct LiveAttempt {
    state: LiveGame,
    events: Vec<LiveEvent>,
}

/// A viewer's subscription to a game.
#[derive(Debug, Clone)]
pub struct LiveSubscription {
    attempt: watch::Receiver<LiveAttempt>,
}

/// A viewer's reading position in a game: an attempt and a number of its events. Later positions are greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LiveCursor {
    /// Number of the attempt, from 1.
    pub attempt: u32,
    /// Number of events that were read.
    pub events: u32,
}

/// The part of a game that a viewer has not read yet.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveUpdate {
    /// The current state of the game.
    pub state: LiveGame,
    /// The events after the viewer's cursor; all events of the attempt if there was no cursor, or one in another attempt.
    pub events: Vec<LiveEvent>,
    /// The position before the first of these events.
    pub start: LiveCursor,
    /// The position after the last of them.
    pub end: LiveCursor,
}

impl LiveGames {
    /// Starts an attempt at a game; its earlier attempts are forgotten.
    pub fn begin(&self, game: GameId, attempt: u32, steps: u32) {
        let new_attempt = LiveAttempt {
            state: LiveGame {
                game,
                attempt,
                steps,
                score: [0; 2],
                fouls: [0; 2],
                position: None,
                is_over: false,
            },
            events: Vec::new(),
        };
        let mut games = self.games();
        let index = games.iter().position(|(id, _)| *id == game);
        match index.and_then(|index| games.remove(index)) {
            Some((_, channel)) => {
                channel.send_replace(new_attempt);
                games.push_back((game, channel));
            }
            None => games.push_back((game, watch::Sender::new(new_attempt))),
        }
        remove_oldest_finished(&mut games);
    }

    /// Adds events, and updates the position. Ignored if the attempt has ended or is not the newest one.
    pub fn advance(
        &self,
        game: GameId,
        attempt: u32,
        events: Vec<LiveEvent>,
        position: Option<LivePosition>,
    ) {
        self.update(game, attempt, |current| {
            for event in events {
                current.record(event);
            }
            current.state.position = position.or(current.state.position);
        });
    }

    /// Ends an attempt. If its final event was not reported, it is marked as aborted.
    pub fn end_attempt(&self, game: GameId, attempt: u32) {
        self.update(game, attempt, |current| {
            current.record(LiveEvent {
                step: current.state.position.map_or(0, |position| position.step),
                event: GameEvent::Aborted,
            });
        });
    }

    /// Subscribes to a game. `None` if no slot of this server or of a remote worker has started it, or if it was forgotten
    /// since its end.
    #[must_use]
    pub fn subscribe(&self, game: GameId) -> Option<LiveSubscription> {
        let channel = self.find(game)?;
        Some(LiveSubscription {
            attempt: channel.subscribe(),
        })
    }

    /// Changes a running attempt and wakes its viewers. An attempt that has ended, or is not the newest one, does not change.
    fn update(&self, game: GameId, attempt: u32, change: impl FnOnce(&mut LiveAttempt)) {
        let Some(channel) = self.find(game) else {
            return;
        };
        channel.send_if_modified(|current| {
            let is_running = current.state.attempt == attempt && !current.state.is_over;
            if is_running {
                change(current);
            }
            is_running
        });
    }

    fn find(&self, game: GameId) -> Option<watch::Sender<LiveAttempt>> {
        let games = self.games();
        let (_, channel) = games.iter().rfind(|(id, _)| *id == game)?;
        Some(channel.clone())
    }

    fn games(&self) -> MutexGuard<'_, VecDeque<GameChannel>> {
        // A panic of another thread leaves the list consistent.
        self.games.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Removes finished games, the oldest first, until [`MAX_FINISHED_LIVE_GAMES`] of them are left.
fn remove_oldest_finished(games: &mut VecDeque<GameChannel>) {
    let is_over = |channel: &watch::Sender<LiveAttempt>| channel.borrow().state.is_over;
    let mut excess = games
        .iter()
        .filter(|(_, channel)| is_over(channel))
        .count()
        .saturating_sub(MAX_FINISHED_LIVE_GAMES);
    games.retain(|(_, channel)| {
        let is_removed = excess > 0 && is_over(channel);
        excess -= usize::from(is_removed);
        !is_removed
    });
}

impl LiveAttempt {
    /// Adds an event, and updates score and fouls by it.
    fn record(&mut self, event: LiveEvent) {
        match &event.event {
            GameEvent::Goal { score, .. } | GameEvent::Ended { score, .. } => {
                self.state.score = *score;
            }
            GameEvent::Foul { by, score } => {
                self.state.fouls[by.index()] += 1;
                self.state.score = *score;
            }
            _ => {}
        }
        self.state.is_over = event.event.is_last();
        self.events.push(event);
    }
}

impl LiveSubscription {
    /// Everything after the viewer's cursor. [`changed`](Self::changed) waits for more.
    pub fn read_since(&mut self, cursor: Option<LiveCursor>) -> LiveUpdate {
        let current = self.attempt.borrow_and_update();
        let attempt = current.state.attempt;
        let read_count = cursor
            .filter(|cursor| cursor.attempt == attempt)
            .map_or(0, |cursor| cursor.events as usize);
        let events = current
            .events
            .get(read_count..)
            .unwrap_or_default()
            .to_vec();
        let cursor_after = |events: usize| LiveCursor {
            attempt,
            events: u32::try_from(events).unwrap_or(u32::MAX),
        };
        LiveUpdate {
            state: current.state.clone(),
            start: cursor_after(current.events.len() - events.len()),
            end: cursor_after(current.events.len()),
            events,
        }
    }

    /// Waits for an update since the last [`read_since`](Self::read_since). Returns false if the game was forgotten, so
    /// that there will be no update. After the end of an attempt another one may start.
    pub async fn changed(&mut self) -> bool {
        self.attempt.changed().await.is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::Side;

    /// Length of the games, in control steps.
    const STEPS: u32 = 500;

    fn position_at(step: u32) -> Option<LivePosition> {
        Some(LivePosition {
            step,
            puck: [0.1, 0.2, 0.3],
            mallets: [[-0.8, 0.0], [0.8, 0.0]],
        })
    }

    fn event(step: u32, event: GameEvent) -> LiveEvent {
        LiveEvent { step, event }
    }

    const fn goal(score: [u32; 2]) -> GameEvent {
        let by = Side::First;
        GameEvent::Goal { by, score }
    }

    const fn cursor(attempt: u32, events: u32) -> LiveCursor {
        LiveCursor { attempt, events }
    }

    #[tokio::test]
    async fn subscription_reads_all_events_and_newest_position() {
        let live = LiveGames::default();
        let game = GameId::new();
        assert!(live.subscribe(game).is_none());
        live.begin(game, 1, STEPS);
        let mut subscription = live.subscribe(game).unwrap();
        let first = subscription.read_since(None);
        assert_eq!((first.end, first.events.len()), (cursor(1, 0), 0));
        assert_eq!((first.state.steps, first.state.position), (STEPS, None));

        live.advance(game, 1, vec![event(90, goal([1, 0]))], position_at(90));
        live.advance(game, 1, Vec::new(), position_at(100));
        live.advance(
            game,
            1,
            vec![event(
                120,
                GameEvent::Foul {
                    by: Side::Second,
                    score: [2, 0],
                },
            )],
            None,
        );
        assert!(subscription.changed().await);
        let second = subscription.read_since(Some(first.end));
        assert_eq!(second.events.len(), 2);
        assert_eq!((second.start, second.end), (cursor(1, 0), cursor(1, 2)));
        assert_eq!(second.state.position, position_at(100), "the newest stays");
        assert_eq!((second.state.score, second.state.fouls), ([2, 0], [0, 1]));
        // a viewer that falls behind, or returns, continues at its cursor
        assert_eq!(subscription.read_since(Some(cursor(1, 1))).events.len(), 1);
        assert_eq!(subscription.read_since(Some(second.end)).events, []);
        assert_eq!(
            subscription.read_since(Some(cursor(1, 9))).events,
            [],
            "a cursor beyond the last event"
        );
        let other_attempt = subscription.read_since(Some(cursor(7, 1)));
        assert_eq!(other_attempt.events.len(), 2, "all of the current attempt");
    }

    #[tokio::test]
    async fn new_attempt_starts_over_and_ignores_earlier_ones() {
        let live = LiveGames::default();
        let game = GameId::new();
        live.begin(game, 1, STEPS);
        live.advance(game, 1, vec![event(90, goal([1, 0]))], position_at(90));
        let mut subscription = live.subscribe(game).unwrap();
        let first = subscription.read_since(None);
        live.end_attempt(game, 1);
        assert!(subscription.changed().await);
        let aborted = subscription.read_since(Some(first.end));
        assert_eq!(aborted.events, [event(90, GameEvent::Aborted)]);
        assert!(aborted.state.is_over);

        live.begin(game, 2, STEPS);
        live.advance(game, 1, vec![event(95, goal([2, 0]))], position_at(95));
        live.end_attempt(game, 1);
        assert!(subscription.changed().await);
        let restarted = subscription.read_since(Some(aborted.end));
        assert_eq!((restarted.end, restarted.events.len()), (cursor(2, 0), 0));
        assert_eq!(
            (restarted.state.score, restarted.state.is_over),
            ([0; 2], false)
        );
        assert!(restarted.end > aborted.end);

        let end = GameEvent::Ended {
            score: [3, 1],
            winner: Some(Side::First),
            forfeits: [None; 2],
        };
        live.advance(game, 2, vec![event(STEPS, end.clone())], position_at(STEPS));
        // the attempt reported its end before, so it is not marked as aborted
        live.end_attempt(game, 2);
        let last = subscription.read_since(Some(restarted.end));
        assert_eq!(last.events, [event(STEPS, end)]);
        assert_eq!((last.state.score, last.state.is_over), ([3, 1], true));
    }

    #[tokio::test]
    async fn finished_games_are_forgotten_and_running_ones_are_not() {
        let live = LiveGames::default();
        // all but the second one finish: two more than are kept
        let games: Vec<GameId> = (0..MAX_FINISHED_LIVE_GAMES + 3)
            .map(|_| GameId::new())
            .collect();
        live.begin(games[0], 1, STEPS);
        let mut subscription = live.subscribe(games[0]).unwrap();
        live.end_attempt(games[0], 1);
        subscription.read_since(None);
        live.begin(games[1], 1, STEPS);
        for game in &games[2..] {
            live.begin(*game, 1, STEPS);
            live.end_attempt(*game, 1);
        }
        live.begin(GameId::new(), 1, STEPS);
        assert!(live.subscribe(games[0]).is_none());
        assert!(!subscription.changed().await, "its subscriptions end");
        assert!(live.subscribe(games[1]).is_some(), "it is running");
        assert!(live.subscribe(games[2]).is_none());
        assert!(live.subscribe(games[3]).is_some());
    }
}
