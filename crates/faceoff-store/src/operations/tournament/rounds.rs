use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        purpose,
        tournament::{play, playing::playing},
    },
    store::Store,
    tables::{
        entrants::Entrant,
        games::{self, Game, GamePurpose, GameState, Meeting},
        rounds::{self, DrawnRound, RoundBye, TournamentRound},
        season,
        submissions::{self, Submission},
        tournaments::{self, Tournament},
    },
    write::Tx,
};
use faceoff_types::{GameId, GameSeed, SubmissionId, TeamId, TournamentFormat, TournamentId};
use jiff::Timestamp;
use std::collections::{BTreeMap, BTreeSet};

fn conflict<T>(why: impl Into<String>) -> Result<T> {
    Err(StoreError::Conflict(why.into()))
}

/// Does a tournament take the runtime of a submission?
pub(super) fn takes(tournament: &Tournament, submission: &Submission) -> bool {
    match (&tournament.rules.runtimes, &submission.runtime) {
        (None, _) => true,
        (Some(taken), Some(runtime)) => taken.contains(runtime),
        (Some(_), None) => false,
    }
}

/// Refuses a round that is not the next one, or whose predecessor is not over.
async fn check_next(tx: &mut Tx, tournament: &Tournament, drawn: &DrawnRound) -> Result<()> {
    let number = drawn.number;
    let started = rounds::count(tx, tournament.id).await?;
    if number.get() <= started {
        return conflict(format!(
            "round {number} was started already: look how far it is"
        ));
    }
    if number.get() > started + 1 || number > tournament.rules.format.last_round() {
        return conflict(format!(
            "round {number} is not the next one: {started} of {} were started",
            tournament.rules.format.last_round()
        ));
    }
    let owed = games::owed(tx, tournament.id).await?;
    if let Some(first) = owed.first() {
        return conflict(format!(
            "{} games of earlier rounds have no result, the first is game {}: wait for them, play them again, or let a \
             team leave",
            owed.len(),
            first.game
        ));
    }
    Ok(())
}

/// Refuses a draw of other teams than are in the tournament: somebody left meanwhile.
fn check_teams(
    tournament: &Tournament,
    drawn: &DrawnRound,
    playing: &[Entrant],
) -> Result<BTreeSet<TeamId>> {
    let days = &drawn.matchdays;
    let with_games: BTreeSet<TeamId> = days
        .iter()
        .flat_map(|day| day.games.iter().flatten().copied())
        .collect();
    let byes = days.iter().flat_map(|day| day.byes.iter().copied());
    let all: BTreeSet<TeamId> = with_games.iter().copied().chain(byes).collect();
    let is_final = matches!(tournament.rules.format, TournamentFormat::Groups { .. })
        && drawn.number.get() > 1;
    let of_playing: BTreeSet<TeamId> = playing.iter().map(|entrant| entrant.team).collect();
    let fits = if is_final {
        all.is_subset(&of_playing)
    } else {
        all == of_playing
    };
    if !fits {
        return conflict(
            "the teams of the tournament have changed meanwhile: start the round again",
        );
    }
    if with_games.is_empty() {
        return conflict("a round needs two teams at least: enter more");
    }
    Ok(with_games)
}

/// What each of these teams has active, or the names of those that have nothing that can play.
async fn freeze(
    tx: &mut Tx,
    tournament: &Tournament,
    teams: &BTreeSet<TeamId>,
    playing: &[Entrant],
) -> Result<BTreeMap<TeamId, SubmissionId>> {
    let active: BTreeMap<TeamId, SubmissionId> = submissions::active(tx)
        .await?
        .into_iter()
        .filter(|submission| takes(tournament, submission))
        .map(|submission| (submission.team, submission.id))
        .collect();
    let unready: Vec<&str> = playing
        .iter()
        .filter(|entrant| teams.contains(&entrant.team) && !active.contains_key(&entrant.team))
        .map(|entrant| entrant.name.as_str())
        .collect();
    if !unready.is_empty() {
        return conflict(format!(
            "without an active, valid submission that the tournament takes: {}. Wait for them, or let them leave the \
             tournament",
            unready.join(", ")
        ));
    }
    Ok(active
        .into_iter()
        .filter(|(team, _)| teams.contains(team))
        .collect())
}

/// Queues the games of a round, one or, mirrored, two of each meeting.
async fn queue_games(
    tx: &mut Tx,
    tournament: &Tournament,
    drawn: &DrawnRound,
    frozen: &BTreeMap<TeamId, SubmissionId>,
) -> Result<u32> {
    let halves: &[bool] = if tournament.rules.mirrored {
        &[false, true]
    } else {
        &[false]
    };
    let (mut meeting, mut count, mut account) = (0, 0, None);
    for (matchday, day) in (1..).zip(&drawn.matchdays) {
        for pair in &day.games {
            meeting += 1;
            for second_half in halves.iter().copied() {
                let mut teams = *pair;
                if second_half {
                    teams.reverse();
                }
                let game = Game {
                    id: GameId::new(),
                    tournament: tournament.id,
                    purpose: GamePurpose::Round(Meeting {
                        round: drawn.number,
                        matchday,
                        meeting,
                        second_half,
                    }),
                    teams,
                    submissions: teams.map(|team| frozen[&team]),
                    seed: GameSeed::Meeting {
                        tournament: tournament.number,
                        round: drawn.number,
                        meeting,
                    },
                    created_at: tx.now,
                    state: GameState::Queued,
                };
                let account = match account {
                    Some(known) => known,
                    None => *account.insert(play::account(tx, &game, purpose::ROUND_GAME).await?),
                };
                play::enqueue_for(tx, &game, purpose::ROUND_GAME, account).await?;
                count += 1;
            }
        }
    }
    Ok(count)
}

impl Store {
    /// Starts a round: what each team has active is fixed for it, and its games are queued. [`StoreError::Conflict`], and
    /// nothing is changed, if the round is not the next one (two that start one at once: one does), a game of an earlier
    /// one has no result, a team has no valid submission that the tournament takes (it names them), the teams are not
    /// those that are in it, or it is closed.
    #[boxed]
    pub async fn start_round(
        &self,
        actor: Actor,
        id: TournamentId,
        drawn: &DrawnRound,
        now: Timestamp,
    ) -> Result<TournamentRound> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let tournament = tournaments::find_open(tx, id).await?;
            let playing = playing(tx, id).await?;
            check_next(tx, &tournament, drawn).await?;
            let teams = check_teams(&tournament, drawn, &playing)?;
            let frozen = freeze(tx, &tournament, &teams, &playing).await?;
            let byes = (1..).zip(&drawn.matchdays).flat_map(|(matchday, day)| {
                day.byes.iter().map(move |team| RoundBye {
                    matchday,
                    team: *team,
                })
            });
            let round = TournamentRound {
                number: drawn.number,
                started_at: now,
                over_at: None,
                groups: drawn.groups.clone(),
                byes: byes.collect(),
                submissions: frozen.iter().map(|(team, id)| (*team, *id)).collect(),
            };
            rounds::insert(tx, id, &round).await?;
            let games = queue_games(tx, &tournament, drawn, &frozen).await?;
            let round_started = Event::RoundStarted {
                round: drawn.number,
                games,
            };
            tx.record(Subject::Tournament(id), round_started);
            Ok(round)
        })
        .await
    }
}
