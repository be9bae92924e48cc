//! Games as they are played, for those who watch: in memory alone, since what counts is stored in the end.

use crate::boxed;
use faceoff_types::{GameHappening, GameId, LiveGame, LiveHappening, LivePosition};
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use tokio::sync::watch;

/// How many games that are over are kept, so that who comes late still gets the end.
pub const LIVE_GAMES_KEPT: usize = 32;

/// The games that this process's slots play, and the last ones that they played. Cloning is cheap. Who tells of a
/// game never waits for who watches it.
#[derive(Debug, Clone, Default)]
pub struct LiveGames {
    /// Those begun last are at the end.
    games: Arc<Mutex<VecDeque<Known>>>,
}

/// A game that is kept, and who may be told of it.
type Known = (GameId, watch::Sender<Told>);

/// What was told of an attempt at a game.
#[derive(Debug)]
struct Told {
    stands: LiveGame,
    happenings: Vec<LiveHappening>,
}

/// Somebody who watches a game.
#[derive(Debug, Clone)]
pub struct LiveWatch {
    told: watch::Receiver<Told>,
}

/// How far somebody has read: in which attempt, and how many happenings of it. Those that happen later are greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LiveMark {
    /// From 1.
    pub attempt: u32,
    /// Happenings read; so the number of the last one, from 1.
    pub happenings: u32,
}

/// What somebody has not read yet.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveNews {
    /// How the game stands.
    pub stands: LiveGame,
    /// What happened after the mark that was given; all of the attempt, if that is of another attempt or none was.
    pub happenings: Vec<LiveHappening>,
    /// Before the first of these happenings.
    pub after: LiveMark,
    /// After the last of them.
    pub mark: LiveMark,
}

impl LiveGames {
    /// A slot begins a game: what was told of earlier attempts is forgotten.
    pub fn begin(&self, game: GameId, attempt: u32, steps: u32) {
        let begun = Told {
            stands: LiveGame {
                game,
                attempt,
                steps,
                score: [0; 2],
                fouls: [0; 2],
                position: None,
                is_over: false,
            },
            happenings: Vec::new(),
        };
        let mut games = self.games();
        let at = games.iter().position(|(known, _)| *known == game);
        match at.and_then(|at| games.remove(at)) {
            Some((_, told)) => {
                told.send_replace(begun);
                games.push_back((game, told));
            }
            None => games.push_back((game, watch::Sender::new(begun))),
        }
        forget_the_oldest(&mut games);
    }

    /// Tells what happened, and where things are. Of another attempt than the last one begun, or of one that is over,
    /// it is not heard.
    pub fn advance(
        &self,
        game: GameId,
        attempt: u32,
        happenings: Vec<LiveHappening>,
        position: Option<LivePosition>,
    ) {
        self.tell(game, attempt, |told| {
            for happening in happenings {
                told.hear(happening);
            }
            told.stands.position = position.or(told.stands.position);
        });
    }

    /// Nothing more is told of an attempt. One whose end was not told was broken off.
    pub fn over(&self, game: GameId, attempt: u32) {
        self.tell(game, attempt, |told| {
            told.hear(LiveHappening {
                step: told.stands.position.map_or(0, |position| position.step),
                what: GameHappening::BrokenOff,
            });
        });
    }

    /// To watch a game; none if no slot of this process has begun it, or many others since it was over.
    #[must_use]
    pub fn watch(&self, game: GameId) -> Option<LiveWatch> {
        let told = self.find(game)?;
        Some(LiveWatch {
            told: told.subscribe(),
        })
    }

    fn tell(&self, game: GameId, attempt: u32, change: impl FnOnce(&mut Told)) {
        let Some(told) = self.find(game) else {
            return;
        };
        told.send_if_modified(|told| {
            let is_heard = told.stands.attempt == attempt && !told.stands.is_over;
            if is_heard {
                change(told);
            }
            is_heard
        });
    }

    fn find(&self, game: GameId) -> Option<watch::Sender<Told>> {
        let games = self.games();
        let (_, told) = games.iter().rfind(|(known, _)| *known == game)?;
        Some(told.clone())
    }

    fn games(&self) -> MutexGuard<'_, VecDeque<Known>> {
        // A panic in between leaves a list that is whole.
        self.games.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Of those that are over, all but the last [`LIVE_GAMES_KEPT`].
fn forget_the_oldest(games: &mut VecDeque<Known>) {
    let is_over = |told: &watch::Sender<Told>| told.borrow().stands.is_over;
    let mut excess = games
        .iter()
        .filter(|(_, told)| is_over(told))
        .count()
        .saturating_sub(LIVE_GAMES_KEPT);
    games.retain(|(_, told)| {
        let goes = excess > 0 && is_over(told);
        excess -= usize::from(goes);
        !goes
    });
}

impl Told {
    fn hear(&mut self, happening: LiveHappening) {
        match &happening.what {
            GameHappening::Goal { score, .. } | GameHappening::Ended { score, .. } => {
                self.stands.score = *score;
            }
            GameHappening::Foul { by, score } => {
                self.stands.fouls[by.index()] += 1;
                self.stands.score = *score;
            }
            _ => {}
        }
        self.stands.is_over = happening.what.is_last();
        self.happenings.push(happening);
    }
}

impl LiveWatch {
    /// What somebody who has read as far as `seen` has not read yet; what comes later is [`changed`](Self::changed).
    pub fn news(&mut self, seen: Option<LiveMark>) -> LiveNews {
        let told = self.told.borrow_and_update();
        let attempt = told.stands.attempt;
        let read = seen
            .filter(|seen| seen.attempt == attempt)
            .map_or(0, |seen| seen.happenings as usize);
        let happenings = told.happenings.get(read..).unwrap_or_default().to_vec();
        let mark = |happenings: usize| LiveMark {
            attempt,
            happenings: u32::try_from(happenings).unwrap_or(u32::MAX),
        };
        LiveNews {
            stands: told.stands.clone(),
            after: mark(told.happenings.len() - happenings.len()),
            mark: mark(told.happenings.len()),
            happenings,
        }
    }

    /// Waits until something was told since the last [`news`](Self::news). False: nothing will be, the game is
    /// forgotten. After the end of an attempt another one may begin.
    #[boxed]
    pub async fn changed(&mut self) -> bool {
        self.told.changed().await.is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::Side;

    fn at(step: u32) -> Option<LivePosition> {
        Some(LivePosition {
            step,
            puck: [0.1, 0.2, 0.3],
            mallets: [[-0.8, 0.0], [0.8, 0.0]],
        })
    }

    fn happening(step: u32, what: GameHappening) -> LiveHappening {
        LiveHappening { step, what }
    }

    const fn goal(score: [u32; 2]) -> GameHappening {
        let by = Side::First;
        GameHappening::Goal { by, score }
    }

    const fn mark(attempt: u32, happenings: u32) -> LiveMark {
        LiveMark {
            attempt,
            happenings,
        }
    }

    #[tokio::test]
    async fn who_watches_misses_no_happening_and_sees_the_newest_position() {
        let live = LiveGames::default();
        let game = GameId::new();
        assert!(live.watch(game).is_none());
        live.begin(game, 1, 500);
        let mut watch = live.watch(game).unwrap();
        let first = watch.news(None);
        assert_eq!((first.mark, first.happenings.len()), (mark(1, 0), 0));
        assert_eq!((first.stands.steps, first.stands.position), (500, None));

        live.advance(game, 1, vec![happening(90, goal([1, 0]))], at(90));
        live.advance(game, 1, Vec::new(), at(100));
        live.advance(
            game,
            1,
            vec![happening(
                120,
                GameHappening::Foul {
                    by: Side::Second,
                    score: [2, 0],
                },
            )],
            None,
        );
        assert!(watch.changed().await);
        let second = watch.news(Some(first.mark));
        assert_eq!(second.happenings.len(), 2);
        assert_eq!((second.after, second.mark), (mark(1, 0), mark(1, 2)));
        assert_eq!(second.stands.position, at(100), "the newest stays");
        assert_eq!((second.stands.score, second.stands.fouls), ([2, 0], [0, 1]));
        // who falls behind, or comes back, goes on where it was
        assert_eq!(watch.news(Some(mark(1, 1))).happenings.len(), 1);
        assert_eq!(watch.news(Some(second.mark)).happenings, []);
        assert_eq!(watch.news(Some(mark(1, 9))).happenings, [], "no such mark");
        assert_eq!(watch.news(Some(mark(7, 1))).happenings.len(), 2);
    }

    #[tokio::test]
    async fn a_new_attempt_begins_anew_and_nothing_is_heard_of_an_earlier_one() {
        let live = LiveGames::default();
        let game = GameId::new();
        live.begin(game, 1, 500);
        live.advance(game, 1, vec![happening(90, goal([1, 0]))], at(90));
        let mut watch = live.watch(game).unwrap();
        let seen = watch.news(None);
        live.over(game, 1);
        assert!(watch.changed().await);
        let broken = watch.news(Some(seen.mark));
        assert_eq!(broken.happenings, [happening(90, GameHappening::BrokenOff)]);
        assert!(broken.stands.is_over);

        live.begin(game, 2, 500);
        live.advance(game, 1, vec![happening(95, goal([2, 0]))], at(95));
        live.over(game, 1);
        assert!(watch.changed().await);
        let anew = watch.news(Some(broken.mark));
        assert_eq!((anew.mark, anew.happenings.len()), (mark(2, 0), 0));
        assert_eq!((anew.stands.score, anew.stands.is_over), ([0; 2], false));
        assert!(anew.mark > broken.mark);

        let end = GameHappening::Ended {
            score: [3, 1],
            winner: Some(Side::First),
            forfeits: [None; 2],
        };
        live.advance(game, 2, vec![happening(500, end.clone())], at(500));
        // its end was told: it was not broken off
        live.over(game, 2);
        let last = watch.news(Some(anew.mark));
        assert_eq!(last.happenings, [happening(500, end)]);
        assert_eq!((last.stands.score, last.stands.is_over), ([3, 1], true));
    }

    #[tokio::test]
    async fn games_that_are_over_are_forgotten_one_day_and_those_under_way_never() {
        let live = LiveGames::default();
        let games: Vec<GameId> = (0..LIVE_GAMES_KEPT + 3).map(|_| GameId::new()).collect();
        live.begin(games[0], 1, 10);
        let mut early = live.watch(games[0]).unwrap();
        live.over(games[0], 1);
        early.news(None);
        live.begin(games[1], 1, 10);
        for game in &games[2..] {
            live.begin(*game, 1, 10);
            live.over(*game, 1);
        }
        live.begin(GameId::new(), 1, 10);
        assert!(live.watch(games[0]).is_none());
        assert!(!early.changed().await, "who still watches is told");
        assert!(live.watch(games[1]).is_some(), "it is under way");
        assert!(live.watch(games[2]).is_none());
        assert!(live.watch(games[3]).is_some());
    }
}
