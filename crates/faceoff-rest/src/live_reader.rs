//! Somebody who follows a game: what is told next, and when.

use axum::response::sse::Event;
use faceoff_api::views::live::{LiveEnd, LiveEndState, LiveWait};
use faceoff_service::{
    app::App,
    ending::Ending,
    problem::{Problem, ProblemKind},
};
use faceoff_store::{GameState, LiveMark, LiveNews, LiveWatch, StoreError};
use faceoff_types::{GameHappening, GameId, LiveGame, LiveHappening};
use serde::Serialize;
use std::time::Duration;
use tokio::{
    sync::OwnedSemaphorePermit,
    time::{Instant, sleep, sleep_until},
};

/// Between two looks at a game that is played: so often a position is told at most.
const PACE: Duration = Duration::from_millis(100);
/// Between two looks whether a slot has begun it, or whether it was called off.
const WAITING: Duration = Duration::from_secs(1);
/// Nobody holds a connection for longer; who wants more comes again and loses nothing.
const LONGEST: Duration = Duration::from_secs(3600);

#[derive(Debug)]
pub(crate) struct LiveReader {
    app: App,
    game: GameId,
    watch: Option<LiveWatch>,
    seen: Option<LiveMark>,
    /// The attempt of which a snapshot was told on this stream.
    shown_attempt: Option<u32>,
    /// The step of the position that was told last.
    shown_step: Option<u32>,
    /// Was it told, since the last snapshot, that nobody plays the game?
    waits: bool,
    is_over: bool,
    /// Nothing is told before.
    not_before: Instant,
    until: Instant,
    ending: Option<Ending>,
    _place: OwnedSemaphorePermit,
}

/// How the database has a game.
enum Stands {
    /// It is, or is about to be, played: which attempt, if one is under way.
    Open(Option<u32>),
    Over(LiveEndState),
}

impl LiveReader {
    pub(crate) fn new(
        app: App,
        game: GameId,
        seen: Option<LiveMark>,
        ending: Option<Ending>,
        place: OwnedSemaphorePermit,
    ) -> Self {
        let now = Instant::now();
        Self {
            app,
            game,
            watch: None,
            seen,
            shown_attempt: None,
            shown_step: None,
            waits: false,
            is_over: false,
            not_before: now,
            until: now + LONGEST,
            ending,
            _place: place,
        }
    }

    /// What is told next, as soon as there is something; `None`: nothing more.
    pub(crate) async fn next(&mut self) -> Option<Vec<Event>> {
        if self.is_over {
            return None;
        }
        let mut ending = self.ending.clone();
        let until = self.until;
        let told = tokio::select! {
            () = Ending::wait(ending.as_mut()) => return None,
            () = sleep_until(until) => return None,
            told = self.told() => told,
        };
        self.not_before = Instant::now() + PACE;
        match told {
            Ok(events) => Some(events),
            Err(problem) => {
                // The answer has begun, so that nothing but its end can say so; the log has the cause.
                tracing::debug!(game = %self.game, detail = problem.detail(), "a stream ends");
                None
            }
        }
    }

    async fn told(&mut self) -> Result<Vec<Event>, Problem> {
        sleep_until(self.not_before).await;
        loop {
            if self.watch.is_none() {
                self.watch = self.app.store.live_games().watch(self.game);
            }
            let (events, is_watched) = match &mut self.watch {
                Some(watch) => {
                    let news = watch.news(self.seen);
                    if news.stands.is_over {
                        (self.after_the_end(news).await?, true)
                    } else {
                        (self.under_way(news)?, true)
                    }
                }
                None => (self.unwatched().await?, false),
            };
            if !events.is_empty() {
                return Ok(events);
            }
            self.wait(is_watched).await;
        }
    }

    /// Until there may be something else to tell.
    async fn wait(&mut self, is_watched: bool) {
        match &mut self.watch {
            Some(watch) if is_watched => {
                tokio::select! {
                    is_told = watch.changed() => {
                        if !is_told {
                            self.watch = None;
                        }
                    }
                    // What the organiser does with a game that is over is not told there.
                    () = sleep(WAITING) => {}
                }
            }
            _ => sleep(WAITING).await,
        }
    }

    /// An attempt goes on.
    fn under_way(&mut self, news: LiveNews) -> Result<Vec<Event>, Problem> {
        let mut events = Vec::new();
        self.tell(&news, &mut events)?;
        if let Some(position) = news.stands.position
            && self.shown_step != Some(position.step)
        {
            self.shown_step = Some(position.step);
            events.push(event("position", &position)?);
        }
        Ok(events)
    }

    /// A snapshot where none of the attempt was told, and all that happened since.
    fn tell(&mut self, news: &LiveNews, events: &mut Vec<Event>) -> Result<(), Problem> {
        let attempt = news.stands.attempt;
        if self.shown_attempt != Some(attempt) {
            self.shown_attempt = Some(attempt);
            self.shown_step = news.stands.position.map(|position| position.step);
            self.waits = false;
            events.push(event("snapshot", &news.stands)?);
        }
        for (happening, number) in news.happenings.iter().zip(news.after.happenings + 1..) {
            events.push(numbered(happening, attempt, number)?);
        }
        self.seen = Some(news.mark);
        Ok(())
    }

    /// The last attempt that was told of is over: with it the game, unless it is played again.
    async fn after_the_end(&mut self, news: LiveNews) -> Result<Vec<Event>, Problem> {
        let attempt = news.stands.attempt;
        let has_ended = self.has_ended(&news);
        let mut events = Vec::new();
        match self.stands().await? {
            Stands::Over(state) => {
                self.tell(&news, &mut events)?;
                events.push(self.end(state)?);
            }
            // Its result is being stored.
            Stands::Open(Some(running)) if running == attempt && has_ended => {
                self.tell(&news, &mut events)?;
                events.push(self.end(LiveEndState::Played)?);
            }
            Stands::Open(_) => {
                // What nobody was shown the beginning of is not told when it is over, and no result either.
                if self.shown_attempt == Some(attempt) {
                    self.tell(&news, &mut events)?;
                }
                events.extend(self.waiting()?);
            }
        }
        Ok(events)
    }

    fn has_ended(&mut self, news: &LiveNews) -> bool {
        let last = match news.happenings.last() {
            Some(last) => Some(last.clone()),
            None => self
                .watch
                .as_mut()
                .and_then(|watch| watch.news(None).happenings.pop()),
        };
        last.is_some_and(|last| matches!(last.what, GameHappening::Ended { .. }))
    }

    /// No slot of this process has played it, or long ago.
    async fn unwatched(&mut self) -> Result<Vec<Event>, Problem> {
        let Stands::Over(state) = self.stands().await? else {
            return Ok(self.waiting()?.into_iter().collect());
        };
        let mut events = Vec::new();
        if let Some(stands) = self.result().await? {
            events.push(event("snapshot", &stands)?);
        }
        events.push(self.end(state)?);
        Ok(events)
    }

    /// That nobody plays it at the moment, once.
    fn waiting(&mut self) -> Result<Option<Event>, Problem> {
        if self.waits {
            return Ok(None);
        }
        self.waits = true;
        event("waiting", &LiveWait { game: self.game }).map(Some)
    }

    fn end(&mut self, state: LiveEndState) -> Result<Event, Problem> {
        self.is_over = true;
        let game = self.game;
        event("over", &LiveEnd { game, state })
    }

    async fn stands(&self) -> Result<Stands, Problem> {
        let game = match self.app.store.game(self.game).await {
            Err(StoreError::NotFound(_)) => return Ok(Stands::Over(LiveEndState::Cancelled)),
            game => game?,
        };
        Ok(match game.state {
            GameState::Queued => Stands::Open(None),
            GameState::Running { attempt, .. } => Stands::Open(Some(attempt)),
            GameState::Played(_) => Stands::Over(LiveEndState::Played),
            GameState::Broken { .. } => Stands::Over(LiveEndState::Broken),
            GameState::Void { .. } => Stands::Over(LiveEndState::Void),
            GameState::Cancelled { .. } => Stands::Over(LiveEndState::Cancelled),
        })
    }

    /// How a game stood at its end whose happenings are forgotten.
    async fn result(&self) -> Result<Option<LiveGame>, Problem> {
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

fn numbered(happening: &LiveHappening, attempt: u32, number: u32) -> Result<Event, Problem> {
    Ok(event("happening", happening)?.id(format!("{attempt}.{number}")))
}

/// An id as [`numbered`] gives it.
///
/// # Errors
/// `InvalidRequest`.
pub(crate) fn parse_mark(text: &str) -> Result<LiveMark, Problem> {
    let parsed = text.split_once('.').and_then(|(attempt, happenings)| {
        Some(LiveMark {
            attempt: attempt.parse().ok()?,
            happenings: happenings.parse().ok()?,
        })
    });
    parsed.ok_or_else(|| {
        Problem::new(
            ProblemKind::InvalidRequest,
            format!(
                "the header Last-Event-ID is the id of the last event that came, as in 1.17, got {text:?}; without it all is \
                 told from the beginning"
            ),
        )
    })
}
