//! `faceoff admin tournament`: opens, plays and closes tournaments.

mod wanted;

use crate::{
    client::Client,
    commands::{
        output::print,
        tournament::{
            find::{find, find_or_newest},
            games, round, text,
        },
    },
};
use anyhow::bail;
use clap::Subcommand;
use faceoff_api::requests::{Decision, NewDeparture, NewTournament, TournamentChange};
use faceoff_types::{GameId, LeftAs, RoundNumber, SubmissionId, TeamName};
use wanted::Wanted;

#[derive(Debug, Subcommand)]
pub(super) enum TournamentAction {
    /// Open one. Until its first round starts, teams and rules may change, and games that do not count be played
    Open {
        /// 1 to 40 letters, digits, spaces and . _ -
        name: String,
        /// The stage on whose board its teams stand [default: the one that is open, or the nearest]
        #[arg(long, value_name = "STAGE")]
        stage: Option<String>,
        /// Its teams, e.g. AJoy,Zed [default: those that the stage's board has as deployable or improvable]
        #[arg(long, value_delimiter = ',', value_name = "TEAMS")]
        teams: Option<Vec<TeamName>>,
        #[command(flatten)]
        wanted: Box<Wanted>,
    },
    /// List them, the first one first
    List,
    /// Show one: rules, teams, rounds, tables, and what comes next
    Show {
        /// Its name or id [default: the newest]
        tournament: Option<String>,
    },
    /// Change one: its rules until its first round starts, the rest until it is closed
    Change {
        /// Its name or id
        tournament: String,
        /// Another name
        #[arg(long, value_name = "NAME")]
        rename: Option<String>,
        /// The agent against which teams may test theirs: a valid submission of any team
        #[arg(long, value_name = "SUBMISSION", conflicts_with = "no_baseline")]
        baseline: Option<SubmissionId>,
        /// No test games any more
        #[arg(long)]
        no_baseline: bool,
        #[command(flatten)]
        wanted: Box<Wanted>,
    },
    /// Enter teams
    Enter {
        /// Its name or id
        tournament: String,
        /// The teams' names
        #[arg(required = true)]
        teams: Vec<TeamName>,
    },
    /// Take a team out for good; without --confirm, say what that would do
    Leave {
        /// Its name or id
        tournament: String,
        /// The team's name
        team: TeamName,
        /// Everybody may read it
        reason: String,
        /// By the organiser's decision: it stands below all others
        #[arg(long)]
        disqualified: bool,
        /// The first round whose games with a disqualified team do not count [default: the one under way, or the next]
        #[arg(long, value_name = "ROUND", value_parser = round, requires = "disqualified")]
        from_round: Option<RoundNumber>,
        /// The team's name again
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Draw the next round and start it: what each team has active now plays all of it
    StartRound {
        /// Its name or id
        tournament: String,
    },
    /// Let no game of it begin; what is played goes on to its end
    Pause {
        /// Its name or id
        tournament: String,
        /// Shown to everybody
        reason: String,
    },
    /// Let its games begin again
    Resume {
        /// Its name or id
        tournament: String,
    },
    /// Close it: nothing of it changes any more; without --confirm, say what that would do
    Close {
        /// Its name or id
        tournament: String,
        /// Its name
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
    /// Have teams play the baseline, before or between rounds; it does not count
    Test {
        /// Its name or id
        tournament: String,
        /// The teams' names [default: all that are in it]
        #[arg(long, value_delimiter = ',', value_name = "TEAMS")]
        teams: Option<Vec<TeamName>>,
    },
    /// List its games that do not count, all teams', the newest first
    FreeGames {
        /// Its name or id [default: the newest]
        tournament: Option<String>,
    },
    /// Have the schedule played again with fresh seeds, to see how sure its champion is; it never counts
    Replay {
        /// Its name or id
        tournament: String,
        /// How many times more
        #[arg(required_unless_present = "cancel")]
        times: Option<u32>,
        /// Call off those that are not over instead
        #[arg(long, conflicts_with = "times")]
        cancel: bool,
    },
    /// Let the result of a game count no more; without --confirm, say what that would do
    Void {
        /// The game's id
        game: GameId,
        /// Shown to everybody
        reason: String,
        /// The teams' names, as in "AJoy - Zed"
        #[arg(long, value_name = "HOME - AWAY")]
        confirm: Option<String>,
    },
    /// Play a game again that is void, or that we broke: the same submissions on the same seed
    Rerun {
        /// The game's id
        game: GameId,
    },
    /// List each time that a slot began a game, whatever came of it
    Attempts {
        /// The game's id
        game: GameId,
    },
    /// Call off a game that does not count and is not over
    CallOff {
        /// The game's id
        game: GameId,
    },
}

pub(super) async fn act(
    client: &Client,
    json: bool,
    action: TournamentAction,
) -> anyhow::Result<()> {
    let shown = match action {
        TournamentAction::List => {
            let tournaments = client.tournaments().await?;
            return print(json, &tournaments, || text::list(&tournaments));
        }
        TournamentAction::Test { tournament, teams } => {
            let id = find(client, &tournament).await?;
            let ordered = client.order_test_games(id, teams).await?;
            return print(json, &ordered, || games::ordered(&ordered));
        }
        TournamentAction::FreeGames { tournament } => {
            let id = find_or_newest(client, tournament.as_deref()).await?;
            let free = client.free_games(id).await?;
            return print(json, &free, || games::table(&free));
        }
        TournamentAction::Replay {
            tournament,
            times,
            cancel: _,
        } => {
            let id = find(client, &tournament).await?;
            let certainty = match times {
                Some(times) => client.order_replays(id, times).await?,
                None => client.cancel_replays(id).await?,
            };
            return print(json, &certainty, || text::certainty(&certainty));
        }
        TournamentAction::StartRound { tournament } => {
            let id = find(client, &tournament).await?;
            let started = client.start_round(id).await?;
            return print(json, &started, || text::round(&started));
        }
        TournamentAction::Void {
            game,
            reason,
            confirm,
        } => {
            let decision = Decision { reason, confirm };
            let voided = client.void_game(game, &decision).await?;
            return print(json, &voided, || games::whole(&voided));
        }
        TournamentAction::Rerun { game } => {
            let queued = client.rerun_game(game).await?;
            return print(json, &queued, || games::whole(&queued));
        }
        TournamentAction::Attempts { game } => {
            let attempts = client.attempts(game).await?;
            return print(json, &attempts, || games::attempts(&attempts));
        }
        TournamentAction::CallOff { game } => {
            let cancelled = client.cancel_game(game).await?;
            return print(json, &cancelled, || games::whole(&cancelled));
        }
        TournamentAction::Show { tournament } => {
            let id = find_or_newest(client, tournament.as_deref()).await?;
            client.tournament(id).await?
        }
        TournamentAction::Open {
            name,
            stage,
            teams,
            wanted,
        } => {
            let new = NewTournament {
                name,
                stage,
                rules: wanted.rules()?,
                settings: wanted.settings(),
                teams,
            };
            client.open_tournament(&new).await?
        }
        TournamentAction::Change {
            tournament,
            rename,
            baseline,
            no_baseline,
            wanted,
        } => {
            let change = TournamentChange {
                name: rename,
                rules: wanted.rules()?,
                settings: wanted.settings(),
                baseline: if no_baseline {
                    Some(None)
                } else {
                    baseline.map(Some)
                },
            };
            if change.name.is_none()
                && change.rules.is_none()
                && change.settings.is_none()
                && change.baseline.is_none()
            {
                bail!(
                    "nothing is to be changed: faceoff admin tournament change --help names what can be"
                );
            }
            let id = find(client, &tournament).await?;
            client.change_tournament(id, &change).await?
        }
        TournamentAction::Enter { tournament, teams } => {
            let id = find(client, &tournament).await?;
            client.enter_teams(id, teams).await?
        }
        TournamentAction::Leave {
            tournament,
            team,
            reason,
            disqualified,
            from_round,
            confirm,
        } => {
            let departure = NewDeparture {
                team,
                r#as: if disqualified {
                    LeftAs::Disqualified
                } else {
                    LeftAs::Withdrawn
                },
                from_round,
                reason,
                confirm,
            };
            let id = find(client, &tournament).await?;
            client.depart(id, &departure).await?
        }
        TournamentAction::Pause { tournament, reason } => {
            let id = find(client, &tournament).await?;
            client.pause_tournament(id, reason).await?
        }
        TournamentAction::Resume { tournament } => {
            let id = find(client, &tournament).await?;
            client.resume_tournament(id).await?
        }
        TournamentAction::Close {
            tournament,
            confirm,
        } => {
            let id = find(client, &tournament).await?;
            client.close_tournament(id, confirm).await?
        }
    };
    print(json, &shown, || text::whole(&shown))
}
