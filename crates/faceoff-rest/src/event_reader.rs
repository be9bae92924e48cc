//! Somebody who follows what happens: what is told next, and when. Of each only the id is kept that they have come to.

use axum::response::sse::Event;
use faceoff_notify::{About, Notice, Page, Reader};
use faceoff_service::{app::App, ending::Ending, problem::Problem};
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

/// Between two looks at the log: what happens in between is told together.
const PACE: Duration = Duration::from_millis(200);
/// Between two looks without a word of this process: another may write, and tokens expire.
const LOOK: Duration = Duration::from_secs(5);
/// Nobody holds a connection for longer; who wants more comes again and loses nothing.
const LONGEST: Duration = Duration::from_secs(3600);
/// Who is further behind asks for everything again, which is less work for both.
const FURTHEST: i64 = 5000;
/// After so many events of which nothing was told, the id is told by itself: who comes again does not go through them.
const UNTOLD: i64 = 1000;

#[derive(Debug)]
pub(crate) struct Follower {
    pub(crate) reader: Reader,
    /// By which they are who they are.
    pub(crate) token: Option<TokenId>,
    pub(crate) about: About,
}

#[derive(Debug)]
pub(crate) struct EventReader {
    app: App,
    follower: Follower,
    changes: broadcast::Receiver<Change>,
    /// What is told before anything that happens.
    first: Option<&'static str>,
    /// All events until this one are dealt with.
    seen: i64,
    /// The id that was told last.
    told: i64,
    not_before: Instant,
    until: Instant,
    ending: Option<Ending>,
    _seat: OwnedSemaphorePermit,
}

impl EventReader {
    /// One that begins after the event with id `from`, or now.
    pub(crate) async fn open(
        app: App,
        follower: Follower,
        from: Option<i64>,
        ending: Option<Ending>,
        seat: OwnedSemaphorePermit,
    ) -> Result<Self, Problem> {
        // Before the log is read: nothing comes in between.
        let changes = app.store.events();
        let newest = app.store.newest_event().await?;
        let (seen, first) = match from {
            None => (newest, Some("now")),
            Some(from) if from > newest || newest - from > FURTHEST => (newest, Some("reset")),
            Some(from) => (from, None),
        };
        let now = Instant::now();
        Ok(Self {
            app,
            follower,
            changes,
            first,
            seen,
            told: seen,
            not_before: now,
            until: now + LONGEST,
            ending,
            _seat: seat,
        })
    }

    /// What is told next, as soon as there is something; `None`: nothing more.
    pub(crate) async fn next(&mut self) -> Option<Vec<Event>> {
        let mut ending = self.ending.clone();
        let until = self.until;
        let told = tokio::select! {
            () = Ending::wait(ending.as_mut()) => return None,
            () = sleep_until(until) => return None,
            told = self.next_told() => told,
        };
        match told {
            Ok(events) => events,
            Err(problem) => {
                // The answer has begun, so that nothing but its end can say so.
                tracing::debug!(detail = problem.detail(), "a stream of events ends");
                None
            }
        }
    }

    async fn next_told(&mut self) -> Result<Option<Vec<Event>>, Problem> {
        if let Some(name) = self.first.take() {
            let data = serde_json::json!({ "id": self.seen });
            let event = Event::default().event(name).id(self.seen.to_string());
            let event = event.json_data(data).map_err(Problem::internal)?;
            return Ok(Some(vec![event]));
        }
        loop {
            sleep_until(self.not_before).await;
            let page = self.app.feed.after(self.seen).await?;
            // After the log is read: a token that was revoked with the newest of it gets nothing of it.
            if !self.is_welcome().await? {
                return Ok(None);
            }
            let Some(page) = page else {
                self.wait().await;
                continue;
            };
            let events = self.told_of(&page)?;
            self.seen = page.until;
            // Also where nothing of it is for this reader: a stranger who comes again must not read the log at full speed.
            self.not_before = Instant::now() + PACE;
            if !events.is_empty() {
                return Ok(Some(events));
            }
        }
    }

    /// Is the token still worth what it was when the stream began?
    async fn is_welcome(&self) -> Result<bool, Problem> {
        let Some(token) = self.follower.token else {
            return Ok(true);
        };
        match self.app.store.token(token).await {
            Ok(token) => Ok(token.is_good(self.app.config.clock.now())),
            Err(StoreError::NotFound(_)) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// What of a page is told, in order.
    fn told_of(&mut self, page: &Page) -> Result<Vec<Event>, Problem> {
        let is_told = |notice: &&Notice| {
            self.follower.about.takes(notice)
                && notice.is_told_to(self.follower.reader, &page.stages)
        };
        let told: Vec<&Notice> = page.notices.iter().filter(is_told).collect();
        let mut events = Vec::with_capacity(told.len());
        for notice in told {
            self.told = notice.id;
            let event = Event::default().event("change").id(notice.id.to_string());
            events.push(event.json_data(notice.json()).map_err(Problem::internal)?);
        }
        if events.is_empty() && page.until - self.told >= UNTOLD {
            self.told = page.until;
            // Without data it is no event, but a browser remembers the id.
            events.push(Event::default().id(page.until.to_string()));
        }
        Ok(events)
    }

    /// Until there may be something else to tell.
    async fn wait(&mut self) {
        self.not_before = Instant::now() + PACE;
        let look = sleep(LOOK);
        tokio::pin!(look);
        loop {
            tokio::select! {
                () = &mut look => return,
                change = self.changes.recv() => match change {
                    // Of progress nothing is in the log.
                    Ok(Change::Progress(_)) => {}
                    Ok(Change::Recorded(_)) | Err(RecvError::Lagged(_)) => break,
                    Err(RecvError::Closed) => {
                        look.await;
                        return;
                    }
                },
            }
        }
        // What was told until now is in the log, which is read next.
        self.changes = self.changes.resubscribe();
    }
}
