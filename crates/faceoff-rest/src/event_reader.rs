//! A reader of the event stream, which is one connection of a client. It decides which events of the log the client gets
//! next, and when. A client that reconnects continues at the id of its last event.

use crate::sse::is_still_valid;
use axum::response::sse::Event;
use faceoff_notify::{Audience, Notice, NoticeFilter, Page};
use faceoff_service::{
    app::App, priority_permits::PriorityPermit, problem::Problem, shutdown::Shutdown,
};
use faceoff_store::{Change, Requester};
use std::time::Duration;
use tokio::{
    sync::broadcast::{self, error::RecvError},
    time::{Instant, sleep, sleep_until},
};

/// Minimum time between two reads of the log; events in between are sent together.
const BATCH_INTERVAL: Duration = Duration::from_millis(200);
/// Time until the log is read even without a notification: another process may write to it, and tokens expire.
const POLL_INTERVAL: Duration = Duration::from_secs(5);
/// Longest connection; a client that reconnects loses no event.
const MAX_DURATION: Duration = Duration::from_secs(3600);
/// A client that is more events behind gets a `reset`: reloading everything is less work for both sides.
const MAX_BACKLOG: i64 = 5000;
/// After so many events that do not match the client's filter, the id of the last one is sent, so that a reconnect skips them.
const MAX_SKIPPED: i64 = 1000;

/// The client of a stream, and its filter.
#[derive(Debug)]
pub(crate) struct Subscription {
    /// As whom the client may see events.
    pub(crate) audience: Audience,
    /// Who has made the request; the stream ends when the token becomes invalid.
    pub(crate) requester: Option<Requester>,
    /// Which events the client wants.
    pub(crate) filter: NoticeFilter,
}

#[derive(Debug)]
pub(crate) struct EventReader {
    app: App,
    subscription: Subscription,
    changes: broadcast::Receiver<Change>,
    /// Name of the first message of the stream (`now` or `reset`), until it is sent.
    first_message: Option<&'static str>,
    /// Id of the last event that was read from the log.
    last_read: i64,
    /// Event id that was sent last.
    last_sent: i64,
    /// Earliest time of the next read of the log.
    next_read_at: Instant,
    /// When the stream ends.
    ends_at: Instant,
    shutdown: Option<Shutdown>,
    _permit: PriorityPermit,
}

impl EventReader {
    /// A reader that begins after the event with id `last_received`, or, without one, after the newest event.
    pub(crate) async fn open(
        app: App,
        subscription: Subscription,
        last_received: Option<i64>,
        shutdown: Option<Shutdown>,
        permit: PriorityPermit,
    ) -> Result<Self, Problem> {
        // Subscribed before the log is read, so that no event is missed.
        let changes = app.store.events();
        let newest = app.store.newest_event().await?;
        let (start_id, first_message) = match last_received {
            None => (newest, Some("now")),
            Some(id) if id > newest || newest - id > MAX_BACKLOG => (newest, Some("reset")),
            Some(id) => (id, None),
        };
        let now = Instant::now();
        Ok(Self {
            app,
            subscription,
            changes,
            first_message,
            last_read: start_id,
            last_sent: start_id,
            next_read_at: now,
            ends_at: now + MAX_DURATION,
            shutdown,
            _permit: permit,
        })
    }

    /// The next events, as soon as there are any; `None` at the end of the stream.
    pub(crate) async fn next(&mut self) -> Option<Vec<Event>> {
        let mut shutdown = self.shutdown.clone();
        let ends_at = self.ends_at;
        let batch = tokio::select! {
            () = Shutdown::wait(shutdown.as_mut()) => return None,
            () = sleep_until(ends_at) => return None,
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
        if let Some(name) = self.first_message.take() {
            let data = serde_json::json!({ "id": self.last_read });
            let event = Event::default().event(name).id(self.last_read.to_string());
            let event = event.json_data(data).map_err(Problem::internal)?;
            return Ok(Some(vec![event]));
        }
        loop {
            sleep_until(self.next_read_at).await;
            let page = self.app.feed.page_after(self.last_read).await?;
            // Checked after the log is read: a token that was revoked meanwhile gets no further event.
            if !is_still_valid(&self.app, self.subscription.requester.as_ref()).await? {
                return Ok(None);
            }
            let Some(page) = page else {
                self.wait().await;
                continue;
            };
            let events = self.matching_events(&page)?;
            self.last_read = page.last_event;
            // The pause applies also without matching events: a client must not make the server read the log at full speed.
            self.next_read_at = Instant::now() + BATCH_INTERVAL;
            if !events.is_empty() {
                return Ok(Some(events));
            }
        }
    }

    /// The events of a page that match the subscription, in order.
    fn matching_events(&mut self, page: &Page) -> Result<Vec<Event>, Problem> {
        let matches = |notice: &&Notice| {
            self.subscription.filter.matches(notice)
                && notice.is_visible_to(self.subscription.audience, &page.stage_visibility)
        };
        let notices: Vec<&Notice> = page.notices.iter().filter(matches).collect();
        let mut events = Vec::with_capacity(notices.len());
        for notice in notices {
            self.last_sent = notice.id;
            let event = Event::default().event("change").id(notice.id.to_string());
            events.push(event.json_data(notice.json()).map_err(Problem::internal)?);
        }
        if events.is_empty() && page.last_event - self.last_sent >= MAX_SKIPPED {
            self.last_sent = page.last_event;
            // Without data browsers dispatch no event, but remember the id.
            events.push(Event::default().id(page.last_event.to_string()));
        }
        Ok(events)
    }

    /// Waits until there may be new events.
    async fn wait(&mut self) {
        self.next_read_at = Instant::now() + BATCH_INTERVAL;
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
