//! Tests of the pages of tournaments. Visitors can choose to hide results (the cookie `spoilers=hidden`); pages must then
//! reveal none.

use super::{
    cup::{TestTournament, first_by_name_wins},
    fake_worker::GameOutcome,
};
use crate::{
    browser::Browser,
    html::{links, page, rows, texts},
    site::{ADMIN, Answer, Site, string},
};
use faceoff_store::Game;
use faceoff_types::{GameEvent, LiveEvent, LivePosition, Side};
use scraper::{Html, Selector};
use serde_json::{Value, json};

/// The request for a tournament with one round, a round robin.
fn one_round() -> Value {
    json!({ "rules": { "format": { "kind": "round_robin", "rounds": 1 } } })
}

/// The path of the tournament's page.
fn path(cup: &TestTournament) -> String {
    cup.path.replace("/api/v1", "")
}

/// Opens a page as a visitor who has chosen to hide results.
async fn open_without_results(site: &Site, path: &str) -> Answer {
    let mut browser = Browser::new(site);
    browser.cookie = Some("spoilers=hidden".to_owned());
    let answer = browser.open(path).await;
    answer.html(200);
    answer
}

/// The page without ids and hashes, whose digits may contain any number.
fn without_ids(body: &str) -> String {
    body.split(|letter: char| !letter.is_ascii_hexdigit() && letter != '-')
        .filter(|word| word.len() >= 32)
        .fold(body.to_owned(), |text, id| text.replace(id, "ID"))
}

/// Numbers of goals that appear nowhere else on a page.
const UNUSUAL_SCORE: [u32; 2] = [7913, 4421];

/// The team whose name comes last wins by [`UNUSUAL_SCORE`].
fn unusual_outcome(_: &Game, [home, away]: [&str; 2]) -> GameOutcome {
    let outcome = GameOutcome {
        penalty_points: [1.25, 2.5],
        ..GameOutcome::goals(UNUSUAL_SCORE[0], UNUSUAL_SCORE[1])
    };
    if home > away {
        outcome
    } else {
        outcome.swapped()
    }
}

/// Asserts that a page reveals no result of games that end by [`unusual_outcome`].
#[track_caller]
fn check_reveals_nothing(body: &str) {
    let body = without_ids(body);
    // Goals, their difference, penalty points, and words for results.
    for revealing in [
        "7913",
        "4421",
        "3492",
        "wins",
        "✓",
        "✕",
        "won",
        "lost",
        "Champion",
        "higher score",
        "1.3",
        "2.5",
        "a draw",
        "winner",
        "95&nbsp;%",
        "the-end-was-odd",
    ] {
        let found = body.find(revealing);
        let context = found.map(|position| {
            let start = body[..position]
                .char_indices()
                .rev()
                .nth(80)
                .map_or(0, |(index, _)| index);
            body[start..].chars().take(200).collect::<String>()
        });
        assert_eq!(context, None, "{revealing:?} is on the page");
    }
}

#[tokio::test]
async fn empty_tournament_list_is_not_linked() {
    let site = Site::start().await;
    let list = page(&site, "/tournaments").await;
    assert_eq!(texts(&list, "h2"), ["No tournament yet"]);
    assert!(!links(&list, "header a").contains(&"/tournaments".to_owned()));
    let unknown = site
        .get(&format!("/tournaments/{}", uuid::Uuid::now_v7()), None)
        .await;
    assert_eq!(unknown.status, 404);
}

#[tokio::test]
async fn tournament_page_shows_tables_schedule_and_ratings() {
    let cup = TestTournament::open(&["A", "B", "C"], one_round()).await;
    let path = path(&cup);
    let open = page(&cup.site, &path).await;
    assert!(texts(&open, "h2").contains(&"No round has started yet".to_owned()));
    cup.start_round().await;
    cup.play_next(first_by_name_wins).await.unwrap();
    let running = page(&cup.site, &path).await;
    assert!(texts(&running, ".standings caption")[0].starts_with("Provisional"));
    assert!(texts(&running, ".games td").contains(&"waiting for a free slot".to_owned()));
    cup.play(first_by_name_wins).await;

    let html = page(&cup.site, &path).await;
    assert_eq!(texts(&html, ".champion"), ["Champion: A"]);
    assert!(texts(&html, ".standings caption")[0].starts_with("Final."));
    let found = rows(&html, ".standings tbody tr");
    assert_eq!(
        found,
        [
            "1 A 6 2 0 0 4 : 2 +2 20.0".to_owned(),
            "2 B 3 1 0 1 3 : 3 0 30.0".to_owned(),
            "3 C 0 0 0 2 2 : 4 −2 40.0".to_owned(),
        ]
        .map(|row| matching_row(&row, &found)),
    );
    // The cross table links each game twice: in the rows of both teams.
    let mut games: Vec<String> = Vec::new();
    for game in cup.games().await {
        games.push(format!("/games/{}", string(&game["id"])));
    }
    games.sort();
    let mut linked = links(&html, ".cross td a");
    linked.sort();
    let mut twice = [games.clone(), games.clone()].concat();
    twice.sort();
    assert_eq!(linked, twice);
    let cells = texts(&html, ".cross tbody tr:first-child td");
    assert_eq!(
        cells,
        [
            "itself",
            "2:1 ✓ won against B, round 1",
            "2:1 ✓ won against C, round 1"
        ]
    );
    let mut listed = links(&html, ".games th a");
    listed.sort();
    assert_eq!(listed, games);
    let results = texts(&html, ".games td:last-child");
    assert!(
        results.contains(&"A wins: higher score".to_owned()),
        "{results:?}"
    );
    let ratings = rows(&html, "[data-live-region=ratings] tbody tr");
    assert_eq!(ratings.len(), 6, "by results and by goals: {ratings:?}");
    assert!(ratings[0].starts_with("A round 1"), "{ratings:?}");
    let entrants = rows(&html, "[data-live-region=entrants] tbody tr");
    for (entrant, submission) in entrants.iter().zip(
        cup.view().await["rounds"][0]["submissions"]
            .as_array()
            .unwrap(),
    ) {
        assert!(
            entrant.contains(&string(&submission["submission"])),
            "{entrant}"
        );
    }

    for linking_page in [
        "/season",
        "/tournaments",
        &format!("/teams/{}", cup.teams["A"].id),
    ] {
        let html = page(&cup.site, linking_page).await;
        assert!(links(&html, "main a").contains(&path), "{linking_page}");
        assert!(
            links(&html, "header a").contains(&"/tournaments".to_owned()),
            "{linking_page}"
        );
    }
}

/// The row among `rows` that has the cells of `row` except for the last one, whose penalty points depend on who plays at home.
fn matching_row(row: &str, rows: &[String]) -> String {
    let head = row.rsplit_once(' ').unwrap().0;
    let found = rows.iter().find(|found| found.starts_with(head));
    found.map_or_else(|| row.to_owned(), Clone::clone)
}

#[tokio::test]
async fn schedule_shows_voided_games_with_their_reason() {
    let cup = TestTournament::open(&["A", "B", "C"], one_round()).await;
    cup.start_round().await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    let [home, away] = cup.names(&game).await;
    let voided = json!({ "reason": "a <b>lamp</b> fell", "confirm": format!("{home} - {away}") });
    let void_path = format!("/api/v1/games/{}/void", game.id);
    let answer = cup.site.post(&void_path, Some(ADMIN), &voided).await;
    assert_eq!(answer.status, 200, "{}", answer.body);
    let html = page(&cup.site, &path(&cup)).await;
    let results = texts(&html, ".games td:last-child");
    assert!(
        results.contains(&"voided, to be played again: a <b>lamp</b> fell".to_owned()),
        "{results:?}"
    );
    let hidden = open_without_results(&cup.site, &path(&cup)).await;
    assert!(
        !hidden.body.contains("lamp"),
        "a reason may reveal the result"
    );
}

#[tokio::test]
async fn excluded_game_names_the_team_that_left() {
    let cup = TestTournament::open(&["A", "B", "C"], one_round()).await;
    cup.start_round().await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    let [home, _] = cup.names(&game).await;
    let departure =
        json!({ "team": home, "as": "disqualified", "reason": "the arm is sold", "confirm": home });
    cup.post("departures", departure).await.json(200);
    let words = format!("because {home} left");
    let game_page = page(&cup.site, &format!("/games/{}", game.id)).await;
    assert!(texts(&game_page, ".lead")[0].contains(&words));
    let html = page(&cup.site, &path(&cup)).await;
    assert_eq!(
        links(&html, ".cross a.excluded").len(),
        4,
        "the team's two games are struck through, each in two rows"
    );
    let results = texts(&html, ".games td:last-child");
    assert!(
        results.iter().any(|result| result.ends_with(&words)),
        "{results:?}"
    );
    let teams = texts(&html, "[data-live-region=entrants] th");
    let expected = format!("{home} disqualified from round 1: the arm is sold");
    assert!(teams.contains(&expected), "{teams:?}");
}

#[tokio::test]
async fn hidden_results_are_on_no_page_until_requested() {
    let cup = TestTournament::open(&["Ant", "Bee", "Cat"], one_round()).await;
    cup.start_round().await;
    cup.play(unusual_outcome).await;
    let games = cup.games().await;
    let game = format!("/games/{}", string(&games[0]["id"]));
    let [ant, bee] = ["Ant", "Bee"].map(|name| cup.teams[name].id.clone());
    let pages = [
        path(&cup),
        "/tournaments".to_owned(),
        game.clone(),
        format!("{}/teams/{ant}/{bee}", path(&cup)),
    ];
    for path in &pages {
        let with_results = cup.site.get(path, None).await;
        assert_eq!(with_results.status, 200, "{}", with_results.body);
        check_reveals_nothing(&open_without_results(&cup.site, path).await.body);
    }
    let with_results = without_ids(&cup.site.get(&pages[0], None).await.body);
    assert!(
        with_results.contains("7913") && with_results.contains("Champion"),
        "the page shows results without the setting"
    );
    let teams = open_without_results(&cup.site, &pages[0]).await.html(200);
    let team_names = texts(&teams, ".cross th[scope=row]");
    assert_eq!(
        team_names,
        ["1 Ant", "2 Bee", "3 Cat"],
        "sorted by name, not by rank"
    );

    let html = open_without_results(&cup.site, &game).await.html(200);
    let with_result = format!("{game}?show=result");
    assert!(links(&html, ".lead p a").contains(&with_result));
    let body = open_without_results(&cup.site, &with_result).await.body;
    assert!(body.contains("7913"), "{body}");
}

#[tokio::test]
async fn spoiler_setting_is_a_form_that_redirects_back() {
    let cup = TestTournament::open(&["A", "B"], one_round()).await;
    let path = path(&cup);
    let mut browser = Browser::new(&cup.site);
    let answer = browser
        .submit("/spoilers", &[("results", "hidden"), ("next", &path)])
        .await;
    assert_eq!(
        (answer.status.as_u16(), answer.header("location")),
        (303, path.as_str())
    );
    let cookie = answer.header("set-cookie");
    assert!(
        cookie.starts_with("spoilers=hidden; ") && cookie.contains("SameSite=Lax"),
        "{cookie}"
    );
    let page = browser.open(&path).await;
    assert!(page.body.contains("Results are hidden"), "{}", page.body);
    let redirected = browser
        .submit(
            "/spoilers",
            &[("results", "shown"), ("next", "https://evil.example/games")],
        )
        .await;
    assert_eq!(redirected.header("location"), "/tournaments");
    assert_eq!(browser.cookie, None);

    let request = browser.http.post(format!("{}/spoilers", cup.site.url));
    let foreign = request
        .header("origin", "https://evil.example")
        .header("content-type", "application/x-www-form-urlencoded")
        .body("results=hidden&next=/tournaments");
    let foreign = browser.send(foreign).await;
    assert_eq!(foreign.status, 403);
    assert!(foreign.headers.get("set-cookie").is_none());
}

#[tokio::test]
async fn finalists_are_hidden_like_results() {
    let rules = json!({ "format": { "kind": "groups", "groups": 2, "advance": 1 } });
    let cup = TestTournament::open(&["A", "B", "C", "D"], json!({ "rules": rules })).await;
    cup.start_round().await;
    cup.play(unusual_outcome).await;
    cup.start_round().await;
    cup.play(unusual_outcome).await;
    let games = cup.games().await;
    let final_game = games.iter().find(|game| game["round"] == 2).unwrap();
    let final_game = format!("/games/{}", string(&final_game["id"]));
    let with_results = page(&cup.site, &path(&cup)).await;
    assert!(links(&with_results, "main a").contains(&final_game));
    let hidden_page = open_without_results(&cup.site, &path(&cup)).await;
    check_reveals_nothing(&hidden_page.body);
    let hidden_page = hidden_page.html(200);
    assert!(!links(&hidden_page, "main a").contains(&final_game));
    let rounds = texts(&hidden_page, "[data-live-region=entrants] tbody td");
    assert!(
        rounds.iter().all(|cell| !cell.contains("rounds 1, 2")),
        "{rounds:?}"
    );
    let with_pairing = format!("{}?show=round-2", path(&cup));
    let with_pairing = open_without_results(&cup.site, &with_pairing).await;
    check_reveals_nothing(&with_pairing.body);
    assert!(links(&with_pairing.html(200), "main a").contains(&final_game));
}

#[tokio::test]
async fn pair_page_compares_two_teams_independent_of_sides() {
    let cup = TestTournament::open(&["A", "B", "C"], json!({})).await;
    for _ in 0..2 {
        cup.start_round().await;
        cup.play(|_, [home, _]| GameOutcome {
            fouls: if home == "A" { [1, 4] } else { [4, 1] },
            ..if home == "A" {
                GameOutcome::goals(5, 2)
            } else {
                GameOutcome::goals(2, 5)
            }
        })
        .await;
    }
    let [a, b] = ["A", "B"].map(|name| cup.teams[name].id.clone());
    let pair_path = format!("{}/teams/{a}/{b}", path(&cup));
    let html = page(&cup.site, &pair_path).await;
    let found = rows(&html, "[aria-labelledby=side-by-side] tbody tr");
    for row in [
        "Games won 2 0",
        "Games drawn 0 0",
        "Goals on the table 10 4",
        "Fouls 2 8",
    ] {
        assert!(found.contains(&row.to_owned()), "{row}: {found:?}");
    }
    let games = texts(&html, "[aria-labelledby=numbers] tbody td:nth-of-type(1)");
    assert_eq!(games, ["5 : 2", "5 : 2"], "the page's first team first");
    let swapped = page(&cup.site, &format!("{}/teams/{b}/{a}", path(&cup))).await;
    let games = texts(
        &swapped,
        "[aria-labelledby=numbers] tbody td:nth-of-type(1)",
    );
    assert_eq!(games, ["2 : 5", "2 : 5"]);
    let tournament = page(&cup.site, &path(&cup)).await;
    assert!(links(&tournament, "main a").contains(&pair_path));
    for wrong in [
        format!("{}/teams/{a}/{a}", path(&cup)),
        format!("{}/teams/{a}/x", path(&cup)),
    ] {
        assert_eq!(cup.site.get(&wrong, None).await.status, 404, "{wrong}");
    }
}

#[tokio::test]
async fn running_game_page_shows_score_and_live_stream() {
    let cup = TestTournament::open(&["A", "B"], one_round()).await;
    cup.start_round().await;
    let (claim, game, seed) = cup.claim().await.unwrap();
    let [home, away] = cup.names(&game).await;
    let live = &cup.site.live.games;
    // A game has 45,000 control steps: 15 minutes.
    live.begin(game.id, 1, 45_000);
    let goal = LiveEvent {
        step: 3000,
        event: GameEvent::Goal {
            by: Side::First,
            score: [1, 0],
        },
    };
    let position = LivePosition {
        step: 3050,
        puck: [0.25, 0.1, 0.0],
        mallets: [[-0.8, 0.0], [0.8, 0.0]],
    };
    live.advance(game.id, 1, vec![goal], Some(position));
    let game_path = format!("/games/{}", game.id);
    let html = page(&cup.site, &game_path).await;
    let verdict = texts(&html, ".verdict").remove(0);
    assert!(
        verdict.starts_with(&format!("{home} 1 : 0 {away} after 1.0 of 15.0 minutes")),
        "{verdict}"
    );
    let events = rows(&html, "[data-live-region=live] tbody tr");
    assert_eq!(events, [format!("1:00.0 Goal by {home}: 1 : 0")]);
    let main = Selector::parse("main").unwrap();
    let stream = |html: &Html| {
        let main = html.select(&main).next().unwrap();
        main.attr("data-live-stream").map(str::to_owned)
    };
    assert_eq!(
        stream(&html),
        Some(format!("/api/v1/games/{}/live", game.id))
    );
    let puck = Selector::parse("[data-live-piece=puck]").unwrap();
    let puck = html.select(&puck).next().unwrap();
    assert_eq!(
        (puck.attr("cx"), puck.attr("cy")),
        (Some("250"), Some("-100"))
    );
    let running = page(&cup.site, &path(&cup)).await;
    assert!(
        links(&running, ".lead a").contains(&game_path),
        "the running game is linked"
    );

    let hidden_page = open_without_results(&cup.site, &game_path).await;
    let hidden_page = hidden_page.html(200);
    assert_eq!(
        stream(&hidden_page),
        None,
        "the stream would reveal the score"
    );
    assert!(texts(&hidden_page, ".verdict").is_empty());
    cup.commit(&claim, &game, seed, GameOutcome::goals(3, 0))
        .await;
    let finished = page(&cup.site, &game_path).await;
    assert_eq!(stream(&finished), None);
    assert!(texts(&finished, ".verdict")[0].starts_with(&format!("{home} 3 : 0 {away}")));
}
