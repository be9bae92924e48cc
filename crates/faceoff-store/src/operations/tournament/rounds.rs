//! Rounds of a tournament: the start of a round, with its draw, its submissions and its games.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        job_purpose,
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

/// Does a tournament accept the runtime of a submission?
pub(super) fn accepts_runtime(tournament: &Tournament, submission: &Submission) -> bool {
    match (&tournament.rules.runtimes, &submission.runtime) {
        (None, _) => true,
        (Some(accepted), Some(runtime)) => accepted.contains(runtime),
        (Some(_), None) => false,
    }
}

/// Refuses a round that is not the next one, or whose predecessor is not over.
async fn check_is_next_round(
    tx: &mut Tx,
    tournament: &Tournament,
    drawn: &DrawnRound,
) -> Result<()> {
    let number = drawn.number;
    let started = rounds::count(tx, tournament.id).await?;
    if number.get() <= started {
        return StoreError::conflict(format!(
            "round {number} has started already: look at its progress"
        ));
    }
    if number.get() > started + 1 || number > tournament.rules.format.last_round() {
        return StoreError::conflict(format!(
            "round {number} is not the next one: {started} of {} have started",
            tournament.rules.format.last_round()
        ));
    }
    let pending = games::pending_of_rounds(tx, tournament.id).await?;
    if let Some(first) = pending.first() {
        return StoreError::conflict(format!(
            "{} games of earlier rounds have no result, the first is game {}: wait for them, rerun them, or let a team \
             leave",
            pending.len(),
            first.game
        ));
    }
    Ok(())
}

/// Refuses a draw whose teams differ from the entrants, because a team was added or left meanwhile. Returns the teams that
/// play; in a round with an odd number of teams one has a bye (no game) on each matchday. In the round after the
/// groups, only their best teams take part.
fn check_teams(
    tournament: &Tournament,
    drawn: &DrawnRound,
    entrants: &[Entrant],
) -> Result<BTreeSet<TeamId>> {
    let matchdays = &drawn.matchdays;
    let teams_with_games: BTreeSet<TeamId> = matchdays
        .iter()
        .flat_map(|day| day.games.iter().flatten().copied())
        .collect();
    let teams_with_bye = matchdays.iter().flat_map(|day| day.byes.iter().copied());
    let drawn_teams: BTreeSet<TeamId> = teams_with_games
        .iter()
        .copied()
        .chain(teams_with_bye)
        .collect();
    let is_final = matches!(tournament.rules.format, TournamentFormat::Groups { .. })
        && drawn.number.get() > 1;
    let entrant_teams: BTreeSet<TeamId> = entrants.iter().map(|entrant| entrant.team).collect();
    let matches_entrants = if is_final {
        drawn_teams.is_subset(&entrant_teams)
    } else {
        drawn_teams == entrant_teams
    };
    if !matches_entrants {
        return StoreError::conflict("the entrants have changed meanwhile: start the round again");
    }
    if teams_with_games.is_empty() {
        return StoreError::conflict("a round needs at least two teams: add more");
    }
    Ok(teams_with_games)
}

/// The active submission of each of these teams. An error names the teams without one that the tournament accepts.
async fn select_submissions(
    tx: &mut Tx,
    tournament: &Tournament,
    teams: &BTreeSet<TeamId>,
    entrants: &[Entrant],
) -> Result<BTreeMap<TeamId, SubmissionId>> {
    let active: BTreeMap<TeamId, SubmissionId> = submissions::active(tx)
        .await?
        .into_iter()
        .filter(|submission| accepts_runtime(tournament, submission))
        .map(|submission| (submission.team, submission.id))
        .collect();
    let names_without: Vec<&str> = entrants
        .iter()
        .filter(|entrant| teams.contains(&entrant.team) && !active.contains_key(&entrant.team))
        .map(|entrant| entrant.name.as_str())
        .collect();
    if !names_without.is_empty() {
        return StoreError::conflict(format!(
            "these teams have no active, valid submission that the tournament accepts: {}. Wait for them, or let them \
             leave the tournament",
            names_without.join(", ")
        ));
    }
    Ok(active
        .into_iter()
        .filter(|(team, _)| teams.contains(team))
        .collect())
}

/// Queues the games of a round: one per pair of teams, or two with exchanged sides if the rules are mirrored.
async fn queue_games(
    tx: &mut Tx,
    tournament: &Tournament,
    drawn: &DrawnRound,
    selected: &BTreeMap<TeamId, SubmissionId>,
) -> Result<u32> {
    let half_is_second: &[bool] = if tournament.rules.mirrored {
        &[false, true]
    } else {
        &[false]
    };
    let (mut pairing_number, mut count, mut account) = (0, 0, None);
    for (matchday, day) in (1..).zip(&drawn.matchdays) {
        for pair in &day.games {
            pairing_number += 1;
            for second_half in half_is_second.iter().copied() {
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
                        pairing: pairing_number,
                        second_half,
                    }),
                    teams,
                    submissions: teams.map(|team| selected[&team]),
                    seed: GameSeedLabel::Fixture {
                        tournament: tournament.number,
                        round: drawn.number,
                        meeting: pairing_number,
                    },
                    created_at: tx.now,
                    state: GameState::Queued,
                };
                let account = match account {
                    Some(account) => account,
                    None => *account.insert(
                        game_lifecycle::open_account(tx, &game, job_purpose::ROUND_GAME).await?,
                    ),
                };
                game_lifecycle::enqueue_for(tx, &game, job_purpose::ROUND_GAME, account).await?;
                count += 1;
            }
        }
    }
    Ok(count)
}

impl Store {
    /// Starts a round: fixes each team's active submission for it and queues its games. Of two concurrent calls one
    /// succeeds. [`StoreError::Conflict`] in these cases, without any change:
    /// - The round is not the next one, or a game of an earlier round has no result.
    /// - A team has no valid submission that the tournament accepts; the error names the teams.
    /// - The draw does not match the entrants, or the tournament is closed.
    #[boxed_future]
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
            let entrants = current_entrants(tx, id).await?;
            check_is_next_round(tx, &tournament, drawn).await?;
            let teams = check_teams(&tournament, drawn, &entrants)?;
            let selected = select_submissions(tx, &tournament, &teams, &entrants).await?;
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
                submissions: selected.iter().map(|(team, id)| (*team, *id)).collect(),
            };
            rounds::insert(tx, id, &round).await?;
            let games = queue_games(tx, &tournament, drawn, &selected).await?;
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
