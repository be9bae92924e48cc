//! Drawing the next round of a tournament from what was played.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
    views::tournament_sheet::TournamentSheet,
};
use faceoff_scoring::tournament::schedule::{Matchday, Round};
use faceoff_store::{Actor, DrawnMatchday, DrawnRound, TournamentRound};
use faceoff_types::{TeamId, TeamName, TournamentId};

/// Draws the next round and starts it, as one: what was drawn meanwhile by somebody else is refused by the store.
#[boxed]
pub async fn start_round(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
) -> Result<TournamentRound, Problem> {
    let sheet = TournamentSheet::find(app, id).await?;
    let conflict = |detail: String| Problem::new(ProblemKind::Conflict, detail);
    if sheet.tournament.closed_at.is_some() {
        return Err(conflict(
            "the tournament is closed; nothing of it is played any more".to_owned(),
        ));
    }
    // Of a mirrored pair the scoring takes one half for the meeting.
    let awaited = sheet.games.iter().filter(|game| sheet.is_awaited(game));
    let open = awaited.count();
    if open > 0 {
        let round = sheet.rounds.len();
        return Err(conflict(format!(
            "round {round} is under way: {open} of its games have no result; the next one is drawn from all of them. Wait, \
             have void and broken ones played again (POST /api/v1/games/ID/rerun), or withdraw a team"
        )));
    }
    let secret = app.store.season().await?.secret;
    let drawn = sheet
        .next_round(&secret)
        .map_err(|error| conflict(error.to_string()))?;
    let Some(drawn) = drawn else {
        return Err(conflict(format!(
            "all {} rounds of the tournament are over; close it, or open another one",
            sheet.rounds.len()
        )));
    };
    let round = by_id(&sheet, &drawn)?;
    let now = app.config.clock.now();
    Ok(app.store.start_round(actor, id, &round, now).await?)
}

/// A round with ids in place of names.
fn by_id(sheet: &TournamentSheet, round: &Round) -> Result<DrawnRound, Problem> {
    let ids = |names: &Vec<TeamName>| -> Result<Vec<TeamId>, Problem> {
        names.iter().map(|name| sheet.team(name)).collect()
    };
    let matchday = |day: &Matchday| {
        let games = day
            .pairings
            .iter()
            .map(|pairing| Ok([sheet.team(&pairing.home)?, sheet.team(&pairing.away)?]));
        Ok::<_, Problem>(DrawnMatchday {
            games: games.collect::<Result<_, Problem>>()?,
            byes: ids(&day.byes)?,
        })
    };
    Ok(DrawnRound {
        number: round.number,
        groups: round.groups.iter().map(ids).collect::<Result<_, _>>()?,
        matchdays: round
            .matchdays
            .iter()
            .map(matchday)
            .collect::<Result<_, _>>()?,
    })
}
