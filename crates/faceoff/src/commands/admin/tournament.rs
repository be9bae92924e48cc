//! `faceoff admin tournament`: opens, runs and closes tournaments, which are rounds of games between the teams' agents.

mod options;

use crate::{
    client::Client,
    commands::{
        output::print,
        tournament::{
            games,
            lookup::{TournamentOrNewest, find_tournament},
            parse_round, text,
        },
    },
};
use anyhow::bail;
use clap::Subcommand;
use faceoff_api::requests::{Decision, NewDeparture, NewTournament, TournamentChange};
use faceoff_types::{DepartureKind, GameId, RoundNumber, SubmissionId, TeamName};
use options::TournamentOptions;

#[derive(Debug, Subcommand)]
pub(super) enum TournamentAction {
    /// Open a tournament. Until its first round starts, teams and rules may change, and friendly and test games are
    /// possible
    Open {
        /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
        name: String,
        /// The stage whose board ranks the teams [default: the open stage, or the nearest]
        #[arg(long, value_name = "STAGE")]
        stage: Option<String>,
        /// Names of the teams, e.g. AJoy,Zed [default: the teams that the stage's board has as deployable or
        /// improvable]
        #[arg(long, value_delimiter = ',', value_name = "TEAMS")]
        teams: Option<Vec<TeamName>>,
        #[command(flatten)]
        options: Box<TournamentOptions>,
    },
    /// List the tournaments, the oldest first
    List,
    /// Show a tournament: rules, teams, rounds, standings and next step
    Show(TournamentOrNewest),
    /// Change a tournament: its rules until the first round starts, other settings until it is closed
    Change {
        /// The tournament's name or id
        tournament: String,
        /// The new name
        #[arg(long, value_name = "NAME")]
        rename: Option<String>,
        /// The baseline, the opponent of test games: a valid submission of any team
        #[arg(long, value_name = "SUBMISSION", conflicts_with = "no_baseline")]
        baseline: Option<SubmissionId>,
        /// Remove the baseline: no further test games
        #[arg(long)]
        no_baseline: bool,
        #[command(flatten)]
        options: Box<TournamentOptions>,
    },
    /// Enter teams
    Enter {
        /// The tournament's name or id
        tournament: String,
        /// The teams' names
        #[arg(required = true)]
        teams: Vec<TeamName>,
    },
    /// Remove a team permanently; without --confirm, only list the effects
    Leave {
        /// The tournament's name or id
        tournament: String,
        /// The team's name
        team: TeamName,
        /// Shown publicly
        reason: String,
        /// Disqualify the team: it is ranked below all others
        #[arg(long)]
        disqualified: bool,
        /// The first round whose games with the disqualified team do not count [default: the running round, or the
        /// next]
        #[arg(long, value_name = "ROUND", value_parser = parse_round, requires = "disqualified")]
        from_round: Option<RoundNumber>,
        /// The team's name, as confirmation
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Draw and start the next round: each team plays all of it with its active submission of this moment
    StartRound {
        /// The tournament's name or id
        tournament: String,
    },
    /// Pause a tournament: running games finish, no further game starts
    Pause {
        /// The tournament's name or id
        tournament: String,
        /// Shown publicly
        reason: String,
    },
    /// Resume a paused tournament
    Resume {
        /// The tournament's name or id
        tournament: String,
    },
    /// Close a tournament: its result becomes final; without --confirm, only list the effects
    Close {
        /// The tournament's name or id
        tournament: String,
        /// The tournament's name, as confirmation
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
    /// Start test games of teams against the baseline, before or between rounds; they do not count
    Test {
        /// The tournament's name or id
        tournament: String,
        /// The teams' names [default: all teams of the tournament]
        #[arg(long, value_delimiter = ',', value_name = "TEAMS")]
        teams: Option<Vec<TeamName>>,
    },
    /// List the friendly and test games of all teams, the newest first
    FreeGames(TournamentOrNewest),
    /// Replay the whole schedule with new seeds, to estimate how certain the champion is; replays never count
    Replay {
        /// The tournament's name or id
        tournament: String,
        /// Number of replays
        #[arg(required_unless_present = "cancel")]
        times: Option<u32>,
        /// Cancel the unfinished replays instead
        #[arg(long, conflicts_with = "times")]
        cancel: bool,
    },
    /// Void the result of a game; without --confirm, only list the effects
    Void {
        /// The game's id
        game: GameId,
        /// Shown publicly
        reason: String,
        /// The teams' names as confirmation, e.g. "AJoy - Zed"
        #[arg(long, value_name = "HOME - AWAY")]
        confirm: Option<String>,
    },
    /// Repeat a game that is void or failed by a platform fault: same submissions, same seed
    Rerun {
        /// The game's id
        game: GameId,
    },
    /// List all attempts to run a game, with their outcomes
    Attempts {
        /// The game's id
        game: GameId,
    },
    /// Cancel a pending or running friendly or test game (teams: faceoff game cancel)
    CallOff {
        /// The game's id
        game: GameId,
    },
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: TournamentAction,
) -> anyhow::Result<()> {
    let view = match action {
        TournamentAction::List => {
            let tournaments = client.tournaments().await?;
            return print(json, tournaments.as_slice(), text::tournament_list);
        }
        TournamentAction::Test { tournament, teams } => {
            let id = find_tournament(client, &tournament).await?;
            let requested = client.request_test_games(id, teams).await?;
            return print(json, &requested, games::test_games_text);
        }
        TournamentAction::FreeGames(tournament) => {
            let id = tournament.find(client).await?;
            let games = client.uncounted_games(id).await?;
            return print(json, games.as_slice(), games::games_table);
        }
        TournamentAction::Replay {
            tournament,
            times,
            cancel: _,
        } => {
            let id = find_tournament(client, &tournament).await?;
            let champion_shares = match times {
                Some(times) => client.request_schedule_replays(id, times).await?,
                None => client.cancel_schedule_replays(id).await?,
            };
            return print(json, &champion_shares, text::champion_shares_text);
        }
        TournamentAction::StartRound { tournament } => {
            let id = find_tournament(client, &tournament).await?;
            let started = client.start_round(id).await?;
            return print(json, &started, text::round_text);
        }
        TournamentAction::Void {
            game,
            reason,
            confirm,
        } => {
            let decision = Decision { reason, confirm };
            let voided = client.void_game(game, &decision).await?;
            return print(json, &voided, games::game_text);
        }
        TournamentAction::Rerun { game } => {
            let queued = client.rerun_game(game).await?;
            return print(json, &queued, games::game_text);
        }
        TournamentAction::Attempts { game } => {
            let attempts = client.attempts(game).await?;
            return print(json, attempts.as_slice(), games::attempts_text);
        }
        TournamentAction::CallOff { game } => {
            let cancelled = client.cancel_game(game).await?;
            return print(json, &cancelled, games::game_text);
        }
        TournamentAction::Show(tournament) => {
            let id = tournament.find(client).await?;
            client.tournament(id).await?
        }
        TournamentAction::Open {
            name,
            stage,
            teams,
            options,
        } => {
            let new = NewTournament {
                name,
                stage,
                rules: options.rules()?,
                settings: options.settings(),
                teams,
            };
            client.open_tournament(&new).await?
        }
        TournamentAction::Change {
            tournament,
            rename,
            baseline,
            no_baseline,
            options,
        } => {
            let change = TournamentChange {
                name: rename,
                rules: options.rules()?,
                settings: options.settings(),
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
                    "nothing to change: faceoff admin tournament change --help lists the options"
                );
            }
            let id = find_tournament(client, &tournament).await?;
            client.change_tournament(id, &change).await?
        }
        TournamentAction::Enter { tournament, teams } => {
            let id = find_tournament(client, &tournament).await?;
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
                kind: if disqualified {
                    DepartureKind::Disqualified
                } else {
                    DepartureKind::Withdrawn
                },
                from_round,
                reason,
                confirm,
            };
            let id = find_tournament(client, &tournament).await?;
            client.record_departure(id, &departure).await?
        }
        TournamentAction::Pause { tournament, reason } => {
            let id = find_tournament(client, &tournament).await?;
            client.pause_tournament(id, reason).await?
        }
        TournamentAction::Resume { tournament } => {
            let id = find_tournament(client, &tournament).await?;
            client.resume_tournament(id).await?
        }
        TournamentAction::Close {
            tournament,
            confirm,
        } => {
            let id = find_tournament(client, &tournament).await?;
            client.close_tournament(id, confirm).await?
        }
    };
    print(json, &view, text::tournament_text)
}
