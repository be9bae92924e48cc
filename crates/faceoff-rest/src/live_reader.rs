//! A reader of a live game's stream, which is one connection of a client. It decides which events the client gets next, and
//! when. A game that is run again has a new *attempt*; *live data* is what the running attempt reports to this process.

use crate::sse::is_still_valid;
use axum::response::sse::Event;
use faceoff_api::views::live::{LiveEnd, LiveEndState, LiveWait};
use faceoff_live::{LiveCursor, LiveSubscription, LiveUpdate};
use faceoff_service::{
    app::App,
    priority_permits::PriorityPermit,
    problem::{Problem, ProblemKind},
    shutdown::Shutdown,
};
use faceoff_store::{GameState, Requester, StoreError};
use faceoff_types::{GameEvent, GameId, LiveEvent, LiveGame};
use serde::Serialize;
use std::time::Duration;
use tokio::time::{Instant, sleep, sleep_until};

/// Minimum time between two batches of events, and so between two `position` events.
const BATCH_INTERVAL: Duration = Duration::from_millis(100);
/// Time between two checks whether the game has started or was cancelled.
const POLL_INTERVAL: Duration = Duration::from_secs(1);
/// Time between two checks of the request's token.
const TOKEN_CHECK_INTERVAL: Duration = Duration::from_secs(1);
/// Longest connection; a client that reconnects loses no event.
const MAX_DURATION: Duration = Duration::from_secs(3600);

#[derive(Debug)]
pub(crate) struct LiveReader {
    app: App,
    game: GameId,
    /// Who has made the request; the stream ends when the token becomes invalid.
    requester: Option<Requester>,
    /// Time of the next check of the token.
    next_token_check_at: Instant,
    /// The game's live data; `None` while there is none.
    subscription: Option<LiveSubscription>,
    /// The attempt and number of the last game event that the client has.
    cursor: Option<LiveCursor>,
    /// The attempt whose snapshot was sent.
    sent_attempt: Option<u32>,
    /// The control step of the position that was sent last.
    sent_step: Option<u32>,
    /// Whether `waiting` was sent since the last snapshot.
    is_waiting_sent: bool,
    /// Whether `over` was sent, which ends the stream.
    is_over: bool,
    /// Earliest time of the next batch.
    next_batch_at: Instant,
    /// When the stream ends, even if the game has not.
    ends_at: Instant,
    shutdown: Option<Shutdown>,
    _permit: PriorityPermit,
}

/// State of a game in the database.
enum StoredState {
    /// Pending or running, with the number of the running attempt; `None` if pending.
    Unfinished(Option<u32>),
    Over(LiveEndState),
}

impl LiveReader {
    pub(crate) fn new(
        app: App,
        game: GameId,
        requester: Option<Requester>,
        cursor: Option<LiveCursor>,
        shutdown: Option<Shutdown>,
        permit: PriorityPermit,
    ) -> Self {
        let now = Instant::now();
        Self {
            app,
            game,
            requester,
            next_token_check_at: now,
            subscription: None,
            cursor,
            sent_attempt: None,
            sent_step: None,
            is_waiting_sent: false,
            is_over: false,
            next_batch_at: now,
            ends_at: now + MAX_DURATION,
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
        let ends_at = self.ends_at;
        let batch = tokio::select! {
            () = Shutdown::wait(shutdown.as_mut()) => return None,
            () = sleep_until(ends_at) => return None,
            batch = self.next_batch() => batch,
        };
        self.next_batch_at = Instant::now() + BATCH_INTERVAL;
        match batch {
            Ok(events) => events,
            Err(problem) => {
                // The response has begun, so an error can only end it; the cause is logged.
                tracing::debug!(game = %self.game, detail = problem.detail(), "a game's stream ends");
                None
            }
        }
    }

    /// The next events; `None` once the token is invalid.
    async fn next_batch(&mut self) -> Result<Option<Vec<Event>>, Problem> {
        sleep_until(self.next_batch_at).await;
        loop {
            let now = Instant::now();
            if now >= self.next_token_check_at {
                if !is_still_valid(&self.app, self.requester.as_ref()).await? {
                    return Ok(None);
                }
                self.next_token_check_at = now + TOKEN_CHECK_INTERVAL;
            }
            if self.subscription.is_none() {
                self.subscription = self.app.live.games.subscribe(self.game);
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
                None => (self.events_without_live_data().await?, false),
            };
            if !events.is_empty() {
                return Ok(Some(events));
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
                    // The subscription does not report decisions about an ended game, such as a rerun.
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

    /// Adds the attempt's snapshot, unless it was sent, and all game events that the client does not have.
    fn push_game_events(
        &mut self,
        update: &LiveUpdate,
        events: &mut Vec<Event>,
    ) -> Result<(), Problem> {
        let attempt = update.state.attempt;
        if self.sent_attempt != Some(attempt) {
            self.sent_attempt = Some(attempt);
            self.sent_step = update.state.position.map(|position| position.step);
            self.is_waiting_sent = false;
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
                events.push(self.over_event(state)?);
            }
            // The attempt has ended, and its result is being stored.
            StoredState::Unfinished(Some(running)) if running == attempt && has_ended => {
                self.push_game_events(&update, &mut events)?;
                events.push(self.over_event(LiveEndState::Played)?);
            }
            StoredState::Unfinished(_) => {
                // The attempt ended without a result. It is skipped if the client has not seen its beginning.
                if self.sent_attempt == Some(attempt) {
                    self.push_game_events(&update, &mut events)?;
                }
                events.extend(self.waiting_event()?);
            }
        }
        Ok(events)
    }

    /// Whether the last event of the attempt, sent or not, is the end of the game.
    fn has_ended(&mut self, update: &LiveUpdate) -> bool {
        let last_event = match update.events.last() {
            Some(event) => Some(event.clone()),
            None => self
                .subscription
                .as_mut()
                .and_then(|subscription| subscription.read_since(None).events.pop()),
        };
        last_event.is_some_and(|last| matches!(last.event, GameEvent::Ended { .. }))
    }

    /// Events of a game without live data: no slot reports it to this process, or its data was dropped.
    async fn events_without_live_data(&mut self) -> Result<Vec<Event>, Problem> {
        let StoredState::Over(state) = self.stored_state().await? else {
            return Ok(self.waiting_event()?.into_iter().collect());
        };
        let mut events = Vec::new();
        if let Some(snapshot) = self.final_snapshot().await? {
            events.push(event("snapshot", &snapshot)?);
        }
        events.push(self.over_event(state)?);
        Ok(events)
    }

    /// The event `waiting`, unless it was sent: the game waits until a worker has a free slot for it.
    fn waiting_event(&mut self) -> Result<Option<Event>, Problem> {
        if self.is_waiting_sent {
            return Ok(None);
        }
        self.is_waiting_sent = true;
        event("waiting", &LiveWait { game: self.game }).map(Some)
    }

    /// The event `over`, after which the stream ends.
    fn over_event(&mut self, state: LiveEndState) -> Result<Event, Problem> {
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
            GameState::Queued => StoredState::Unfinished(None),
            GameState::Running { attempt, .. } => StoredState::Unfinished(Some(attempt)),
            GameState::Played(_) => StoredState::Over(LiveEndState::Played),
            GameState::PlatformFailed { .. } => StoredState::Over(LiveEndState::PlatformFailed),
            GameState::Void { .. } => StoredState::Over(LiveEndState::Void),
            GameState::Cancelled { .. } => StoredState::Over(LiveEndState::Cancelled),
        })
    }

    /// Snapshot of the end of a game without live data; `None` without a result.
    async fn final_snapshot(&self) -> Result<Option<LiveGame>, Problem> {
        let GameState::Played(result) = self.app.store.game(self.game).await?.state else {
            return Ok(None);
        };
        let score: faceoff_scoring::tournament::GameScore =
            serde_json::from_value(result.results).map_err(Problem::internal)?;
        Ok(Some(LiveGame {
            game: self.game,
            attempt: result.attempt,
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

/// Parses an event id as [`numbered_event`] writes it.
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
