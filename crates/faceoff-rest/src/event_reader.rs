//! A reader of the event stream: which events it gets next, and when. Its only state is its position in the log.

use axum::response::sse::Event;
use faceoff_notify::{Audience, Notice, NoticeFilter, Page};
use faceoff_service::{app::App, problem::Problem, shutdown::Shutdown};
use faceoff_store::{Change, StoreError};
use faceoff_types::TokenId;
use std::time::Duration;
use tokio::{
    sync::{
        OwnedSemaphorePermit,
        broadcast::{self, error::RecvError},
    },
    time::{Instant, sleep, sleep_until},
};

/// Minimum time between two reads of the log; events in between are sent together.
const BATCH_INTERVAL: Duration = Duration::from_millis(200);
/// Time between two reads without a notification: another process may write, and tokens expire.
const POLL_INTERVAL: Duration = Duration::from_secs(5);
/// Longest connection; a client that reconnects loses no event.
const MAX_DURATION: Duration = Duration::from_secs(3600);
/// A reader that is further behind gets a reset: reloading everything is less work for both sides.
const MAX_BACKLOG: i64 = 5000;
/// After so many events that do not match the reader's filter, only the id is sent: a reconnect then skips them.
const MAX_SKIPPED: i64 = 1000;

/// The client of a stream, and its filter.
#[derive(Debug)]
pub(crate) struct Subscription {
    pub(crate) reader: Audience,
    /// The token of the request; the stream ends when it becomes invalid.
    pub(crate) token: Option<TokenId>,
    pub(crate) about: NoticeFilter,
}

#[derive(Debug)]
pub(crate) struct EventReader {
    app: App,
    subscription: Subscription,
    changes: broadcast::Receiver<Change>,
    /// Name of the initial event.
    initial: Option<&'static str>,
    /// Id of the last event that was read.
    read: i64,
    /// Id that was sent last.
    sent: i64,
    not_before: Instant,
    until: Instant,
    shutdown: Option<Shutdown>,
    _permit: OwnedSemaphorePermit,
}

impl EventReader {
    /// A reader that begins after the event with id `from`, or now.
    pub(crate) async fn open(
        app: App,
        subscription: Subscription,
        from: Option<i64>,
        shutdown: Option<Shutdown>,
        permit: OwnedSemaphorePermit,
    ) -> Result<Self, Problem> {
        // Subscribed before the log is read, so that no event is missed.
        let changes = app.store.events();
        let newest = app.store.newest_event().await?;
        let (read, initial) = match from {
            None => (newest, Some("now")),
            Some(from) if from > newest || newest - from > MAX_BACKLOG => (newest, Some("reset")),
            Some(from) => (from, None),
        };
        let now = Instant::now();
        Ok(Self {
            app,
            subscription,
            changes,
            initial,
            read,
            sent: read,
            not_before: now,
            until: now + MAX_DURATION,
            shutdown,
            _permit: permit,
        })
    }

    /// The next events, as soon as there are any; `None` at the end of the stream.
    pub(crate) async fn next(&mut self) -> Option<Vec<Event>> {
        let mut shutdown = self.shutdown.clone();
        let until = self.until;
        let batch = tokio::select! {
            () = Shutdown::wait(shutdown.as_mut()) => return None,
            () = sleep_until(until) => return None,
            batch = self.next_batch() => batch,
        };
        match batch {
            Ok(events) => events,
            Err(problem) => {
                // The response has begun, so an error can only end it.
                tracing::debug!(detail = problem.detail(), "an event stream ends");
                None
            }
        }
    }

    async fn next_batch(&mut self) -> Result<Option<Vec<Event>>, Problem> {
        if let Some(name) = self.initial.take() {
            let data = serde_json::json!({ "id": self.read });
            let event = Event::default().event(name).id(self.read.to_string());
            let event = event.json_data(data).map_err(Problem::internal)?;
            return Ok(Some(vec![event]));
        }
        loop {
            sleep_until(self.not_before).await;
            let page = self.app.feed.after(self.read).await?;
            // Checked after the log is read: a token that was revoked meanwhile gets no further event.
            if !self.is_token_valid().await? {
                return Ok(None);
            }
            let Some(page) = page else {
                self.wait().await;
                continue;
            };
            let events = self.matching(&page)?;
            self.read = page.until;
            // Also without matching events: a client must not make the server read the log at full speed.
            self.not_before = Instant::now() + BATCH_INTERVAL;
            if !events.is_empty() {
                return Ok(Some(events));
            }
        }
    }

    /// Whether the token of the request is still valid.
    async fn is_token_valid(&self) -> Result<bool, Problem> {
        let Some(token) = self.subscription.token else {
            return Ok(true);
        };
        match self.app.store.token(token).await {
            Ok(token) => Ok(token.is_valid(self.app.config.clock.now())),
            Err(StoreError::NotFound(_)) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// The events of a page that match the subscription, in order.
    fn matching(&mut self, page: &Page) -> Result<Vec<Event>, Problem> {
        let matches = |notice: &&Notice| {
            self.subscription.about.matches(notice)
                && notice.is_visible_to(self.subscription.reader, &page.stages)
        };
        let notices: Vec<&Notice> = page.notices.iter().filter(matches).collect();
        let mut events = Vec::with_capacity(notices.len());
        for notice in notices {
            self.sent = notice.id;
            let event = Event::default().event("change").id(notice.id.to_string());
            events.push(event.json_data(notice.json()).map_err(Problem::internal)?);
        }
        if events.is_empty() && page.until - self.sent >= MAX_SKIPPED {
            self.sent = page.until;
            // Without data browsers dispatch no event, but remember the id.
            events.push(Event::default().id(page.until.to_string()));
        }
        Ok(events)
    }

    /// Waits until there may be new events.
    async fn wait(&mut self) {
        self.not_before = Instant::now() + BATCH_INTERVAL;
        let poll = sleep(POLL_INTERVAL);
        tokio::pin!(poll);
        loop {
            tokio::select! {
                () = &mut poll => return,
                change = self.changes.recv() => match change {
                    // Progress is not in the log.
                    Ok(Change::Progress(_)) => {}
                    Ok(Change::Recorded(_)) | Err(RecvError::Lagged(_)) => break,
                    Err(RecvError::Closed) => {
                        poll.await;
                        return;
                    }
                },
            }
        }
        // Everything up to now is in the log, which is read next.
        self.changes = self.changes.resubscribe();
    }
}
