//! A reader of a live game's stream: which events it gets next, and when.

use axum::response::sse::Event;
use faceoff_api::views::live::{LiveEnd, LiveEndState, LiveWait};
use faceoff_service::{
    app::App,
    problem::{Problem, ProblemKind},
    shutdown::Shutdown,
};
use faceoff_store::{GameState, LiveCursor, LiveSubscription, LiveUpdate, StoreError};
use faceoff_types::{GameEvent, GameId, LiveEvent, LiveGame};
use serde::Serialize;
use std::time::Duration;
use tokio::{
    sync::OwnedSemaphorePermit,
    time::{Instant, sleep, sleep_until},
};

/// Minimum time between two batches of a running game, and so between two positions.
const BATCH_INTERVAL: Duration = Duration::from_millis(100);
/// Time between two checks whether the game has started or was cancelled.
const POLL_INTERVAL: Duration = Duration::from_secs(1);
/// Longest connection; a client that reconnects loses no event.
const MAX_DURATION: Duration = Duration::from_secs(3600);

#[derive(Debug)]
pub(crate) struct LiveReader {
    app: App,
    game: GameId,
    subscription: Option<LiveSubscription>,
    cursor: Option<LiveCursor>,
    /// The attempt whose snapshot was sent.
    sent_attempt: Option<u32>,
    /// The step of the position that was sent last.
    sent_step: Option<u32>,
    /// Whether `waiting` was sent since the last snapshot.
    sent_waiting: bool,
    is_over: bool,
    /// Earliest time of the next batch.
    not_before: Instant,
    until: Instant,
    shutdown: Option<Shutdown>,
    _permit: OwnedSemaphorePermit,
}

/// State of a game in the database.
enum StoredState {
    /// Pending or running; the running attempt.
    Open(Option<u32>),
    Over(LiveEndState),
}

impl LiveReader {
    pub(crate) fn new(
        app: App,
        game: GameId,
        cursor: Option<LiveCursor>,
        shutdown: Option<Shutdown>,
        permit: OwnedSemaphorePermit,
    ) -> Self {
        let now = Instant::now();
        Self {
            app,
            game,
            subscription: None,
            cursor,
            sent_attempt: None,
            sent_step: None,
            sent_waiting: false,
            is_over: false,
            not_before: now,
            until: now + MAX_DURATION,
            shutdown,
            _permit: permit,
        }
    }

    /// The next events, as soon as there are any; `None` at the end of the stream.
    pub(crate) async fn next(&mut self) -> Option<Vec<Event>> {
        if self.is_over {
            return None;
        }
        let mut shutdown = self.shutdown.clone();
        let until = self.until;
        let batch = tokio::select! {
            () = Shutdown::wait(shutdown.as_mut()) => return None,
            () = sleep_until(until) => return None,
            batch = self.next_batch() => batch,
        };
        self.not_before = Instant::now() + BATCH_INTERVAL;
        match batch {
            Ok(events) => Some(events),
            Err(problem) => {
                // The response has begun, so an error can only end it; the cause is logged.
                tracing::debug!(game = %self.game, detail = problem.detail(), "a game's stream ends");
                None
            }
        }
    }

    async fn next_batch(&mut self) -> Result<Vec<Event>, Problem> {
        sleep_until(self.not_before).await;
        loop {
            if self.subscription.is_none() {
                self.subscription = self.app.store.live_games().subscribe(self.game);
            }
            let (events, is_live) = match &mut self.subscription {
                Some(subscription) => {
                    let update = subscription.read_since(self.cursor);
                    if update.state.is_over {
                        (self.events_after_end(update).await?, true)
                    } else {
                        (self.running_events(update)?, true)
                    }
                }
                None => (self.without_live_data().await?, false),
            };
            if !events.is_empty() {
                return Ok(events);
            }
            self.wait(is_live).await;
        }
    }

    /// Waits until there may be new events.
    async fn wait(&mut self, is_live: bool) {
        match &mut self.subscription {
            Some(subscription) if is_live => {
                tokio::select! {
                    has_changed = subscription.changed() => {
                        if !has_changed {
                            self.subscription = None;
                        }
                    }
                    // The subscription does not report what organisers do with a game that has ended.
                    () = sleep(POLL_INTERVAL) => {}
                }
            }
            _ => sleep(POLL_INTERVAL).await,
        }
    }

    /// Events of a running attempt.
    fn running_events(&mut self, update: LiveUpdate) -> Result<Vec<Event>, Problem> {
        let mut events = Vec::new();
        self.push_game_events(&update, &mut events)?;
        if let Some(position) = update.state.position
            && self.sent_step != Some(position.step)
        {
            self.sent_step = Some(position.step);
            events.push(event("position", &position)?);
        }
        Ok(events)
    }

    /// Adds the attempt's snapshot, unless it was sent, and all game events since.
    fn push_game_events(
        &mut self,
        update: &LiveUpdate,
        events: &mut Vec<Event>,
    ) -> Result<(), Problem> {
        let attempt = update.state.attempt;
        if self.sent_attempt != Some(attempt) {
            self.sent_attempt = Some(attempt);
            self.sent_step = update.state.position.map(|position| position.step);
            self.sent_waiting = false;
            events.push(event("snapshot", &update.state)?);
        }
        for (game_event, number) in update.events.iter().zip(update.start.events + 1..) {
            events.push(numbered_event(game_event, attempt, number)?);
        }
        self.cursor = Some(update.end);
        Ok(())
    }

    /// Events after the end of an attempt: the game has ended, unless it is rerun.
    async fn events_after_end(&mut self, update: LiveUpdate) -> Result<Vec<Event>, Problem> {
        let attempt = update.state.attempt;
        let has_ended = self.has_ended(&update);
        let mut events = Vec::new();
        match self.stored_state().await? {
            StoredState::Over(state) => {
                self.push_game_events(&update, &mut events)?;
                events.push(self.end(state)?);
            }
            // The attempt has ended, and its result is being stored.
            StoredState::Open(Some(running)) if running == attempt && has_ended => {
                self.push_game_events(&update, &mut events)?;
                events.push(self.end(LiveEndState::Played)?);
            }
            StoredState::Open(_) => {
                // An attempt without a result whose beginning was not sent is skipped.
                if self.sent_attempt == Some(attempt) {
                    self.push_game_events(&update, &mut events)?;
                }
                events.extend(self.waiting()?);
            }
        }
        Ok(events)
    }

    fn has_ended(&mut self, update: &LiveUpdate) -> bool {
        let last = match update.events.last() {
            Some(last) => Some(last.clone()),
            None => self
                .subscription
                .as_mut()
                .and_then(|subscription| subscription.read_since(None).events.pop()),
        };
        last.is_some_and(|last| matches!(last.event, GameEvent::Ended { .. }))
    }

    /// Events of a game without live data: no slot reports it to this process, or its data was dropped.
    async fn without_live_data(&mut self) -> Result<Vec<Event>, Problem> {
        let StoredState::Over(state) = self.stored_state().await? else {
            return Ok(self.waiting()?.into_iter().collect());
        };
        let mut events = Vec::new();
        if let Some(snapshot) = self.final_snapshot().await? {
            events.push(event("snapshot", &snapshot)?);
        }
        events.push(self.end(state)?);
        Ok(events)
    }

    /// The event that the game waits for a slot, once.
    fn waiting(&mut self) -> Result<Option<Event>, Problem> {
        if self.sent_waiting {
            return Ok(None);
        }
        self.sent_waiting = true;
        event("waiting", &LiveWait { game: self.game }).map(Some)
    }

    fn end(&mut self, state: LiveEndState) -> Result<Event, Problem> {
        self.is_over = true;
        let game = self.game;
        event("over", &LiveEnd { game, state })
    }

    async fn stored_state(&self) -> Result<StoredState, Problem> {
        let game = match self.app.store.game(self.game).await {
            Err(StoreError::NotFound(_)) => return Ok(StoredState::Over(LiveEndState::Cancelled)),
            game => game?,
        };
        Ok(match game.state {
            GameState::Queued => StoredState::Open(None),
            GameState::Running { attempt, .. } => StoredState::Open(Some(attempt)),
            GameState::Played(_) => StoredState::Over(LiveEndState::Played),
            GameState::PlatformFailed { .. } => StoredState::Over(LiveEndState::Broken),
            GameState::Void { .. } => StoredState::Over(LiveEndState::Void),
            GameState::Cancelled { .. } => StoredState::Over(LiveEndState::Cancelled),
        })
    }

    /// Snapshot of the end of a game without live data; `None` without a result.
    async fn final_snapshot(&self) -> Result<Option<LiveGame>, Problem> {
        let GameState::Played(row) = self.app.store.game(self.game).await?.state else {
            return Ok(None);
        };
        let score: faceoff_scoring::tournament::GameScore =
            serde_json::from_value(row.score).map_err(Problem::internal)?;
        Ok(Some(LiveGame {
            game: self.game,
            attempt: row.attempt,
            steps: score.steps,
            score: score.sides.each_ref().map(|side| side.score),
            fouls: score.sides.each_ref().map(|side| side.fouls),
            position: None,
            is_over: true,
        }))
    }
}

fn event(name: &str, data: &impl Serialize) -> Result<Event, Problem> {
    let event = Event::default().event(name);
    event.json_data(data).map_err(Problem::internal)
}

fn numbered_event(game_event: &LiveEvent, attempt: u32, number: u32) -> Result<Event, Problem> {
    Ok(event("happening", game_event)?.id(format!("{attempt}.{number}")))
}

/// Parses an event id as [`numbered`] writes it.
///
/// # Errors
/// `InvalidRequest`.
pub(crate) fn parse_cursor(text: &str) -> Result<LiveCursor, Problem> {
    let parsed = text.split_once('.').and_then(|(attempt, events)| {
        Some(LiveCursor {
            attempt: attempt.parse().ok()?,
            events: events.parse().ok()?,
        })
    });
    parsed.ok_or_else(|| {
        Problem::new(
            ProblemKind::InvalidRequest,
            format!(
                "expected the header Last-Event-ID to be the id of an event, as in 1.17, got {text:?}; leave it out to start \
                 from the beginning"
            ),
        )
    })
}
