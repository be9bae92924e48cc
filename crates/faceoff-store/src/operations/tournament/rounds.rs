use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        purpose,
        tournament::{current_entrants::current_entrants, game_lifecycle},
    },
    store::Store,
    tables::{
        entrants::Entrant,
        games::{self, Game, GamePurpose, GameState, ScheduleEntry},
        rounds::{self, DrawnRound, RoundBye, TournamentRound},
        season,
        submissions::{self, Submission},
        tournaments::{self, Tournament},
    },
    write::Tx,
};
use faceoff_types::{GameId, GameSeedLabel, SubmissionId, TeamId, TournamentFormat, TournamentId};
use jiff::Timestamp;
use std::collections::{BTreeMap, BTreeSet};

fn conflict<T>(why: impl Into<String>) -> Result<T> {
    Err(StoreError::Conflict(why.into()))
}

/// Whether a tournament accepts the runtime of a submission.
pub(super) fn takes(tournament: &Tournament, submission: &Submission) -> bool {
    match (&tournament.rules.runtimes, &submission.runtime) {
        (None, _) => true,
        (Some(accepted), Some(runtime)) => accepted.contains(runtime),
        (Some(_), None) => false,
    }
}

/// Refuses a round that is not the next one, or whose predecessor is not over.
async fn check_next(tx: &mut Tx, tournament: &Tournament, drawn: &DrawnRound) -> Result<()> {
    let number = drawn.number;
    let started = rounds::count(tx, tournament.id).await?;
    if number.get() <= started {
        return conflict(format!(
            "round {number} has started already: look at its progress"
        ));
    }
    if number.get() > started + 1 || number > tournament.rules.format.last_round() {
        return conflict(format!(
            "round {number} is not the next one: {started} of {} have started",
            tournament.rules.format.last_round()
        ));
    }
    let pending = games::pending(tx, tournament.id).await?;
    if let Some(first) = pending.first() {
        return conflict(format!(
            "{} games of earlier rounds have no result, the first is game {}: wait for them, rerun them, or let a team \
             leave",
            pending.len(),
            first.game
        ));
    }
    Ok(())
}

/// Refuses a draw whose teams differ from the entrants, because a team was added or left meanwhile.
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
        return conflict("the entrants have changed meanwhile: start the round again");
    }
    if with_games.is_empty() {
        return conflict("a round needs at least two teams: add more");
    }
    Ok(with_games)
}

/// The active submission of each of these teams. An error names the teams without one that the tournament accepts.
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
            "these teams have no active, valid submission that the tournament accepts: {}. Wait for them, or let them \
             leave the tournament",
            unready.join(", ")
        ));
    }
    Ok(active
        .into_iter()
        .filter(|(team, _)| teams.contains(team))
        .collect())
}

/// Queues the games of a round: one per fixture, or two if the rules are mirrored.
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
    let (mut pairing, mut count, mut account) = (0, 0, None);
    for (matchday, day) in (1..).zip(&drawn.matchdays) {
        for pair in &day.games {
            pairing += 1;
            for second_half in halves.iter().copied() {
                let mut teams = *pair;
                if second_half {
                    teams.reverse();
                }
                let game = Game {
                    id: GameId::new(),
                    tournament: tournament.id,
                    purpose: GamePurpose::Round(ScheduleEntry {
                        round: drawn.number,
                        matchday,
                        pairing,
                        second_half,
                    }),
                    teams,
                    submissions: teams.map(|team| frozen[&team]),
                    seed: GameSeedLabel::Fixture {
                        tournament: tournament.number,
                        round: drawn.number,
                        meeting: pairing,
                    },
                    created_at: tx.now,
                    state: GameState::Queued,
                };
                let account = match account {
                    Some(known) => known,
                    None => *account
                        .insert(game_lifecycle::account(tx, &game, purpose::ROUND_GAME).await?),
                };
                game_lifecycle::enqueue_for(tx, &game, purpose::ROUND_GAME, account).await?;
                count += 1;
            }
        }
    }
    Ok(count)
}

impl Store {
    /// Starts a round: freezes each team's active submission for it and queues its games. Of two concurrent calls one
    /// succeeds. [`StoreError::Conflict`] in these cases, without any change:
    /// - The round is not the next one, or a game of an earlier round has no result.
    /// - A team has no valid submission that the tournament accepts; the error names the teams.
    /// - The draw does not match the entrants, or the tournament is closed.
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
            let playing = current_entrants(tx, id).await?;
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
