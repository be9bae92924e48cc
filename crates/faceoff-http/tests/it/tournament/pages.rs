//! The pages of tournaments: what they show, and what they do not show who has not watched yet.

use super::{
    cup::{Cup, first_by_name_wins},
    slot::Went,
};
use crate::{
    browser::Browser,
    html::{page, rows, texts},
    site::{ADMIN, Answer, Site, text},
};
use faceoff_store::Game;
use faceoff_types::{GameHappening, LiveHappening, LivePosition, Side};
use scraper::{Html, Selector};
use serde_json::{Value, json};

/// Once everybody against everybody.
fn one_round() -> Value {
    json!({ "rules": { "format": { "kind": "round_robin", "rounds": 1 } } })
}

/// The path of the tournament's page.
fn path(cup: &Cup) -> String {
    cup.path.replace("/api/v1", "")
}

fn links(html: &Html, selector: &str) -> Vec<String> {
    html.select(&Selector::parse(selector).unwrap())
        .map(|link| link.attr("href").unwrap().to_owned())
        .collect()
}

/// The page as somebody gets it who has chosen to see no results.
async fn hidden(site: &Site, path: &str) -> Answer {
    let mut browser = Browser::new(site);
    browser.cookie = Some("spoilers=hidden".to_owned());
    let answer = browser.open(path).await;
    assert_eq!(answer.status, 200, "{}", answer.body);
    let html = Html::parse_document(&answer.body);
    assert!(html.errors.is_empty(), "{:?}\n{}", html.errors, answer.body);
    answer
}

/// A page's bytes without its ids and assets, in whose digits anything may be found.
fn without_ids(body: &str) -> String {
    body.split(|letter: char| !letter.is_ascii_hexdigit() && letter != '-')
        .filter(|word| word.len() >= 32)
        .fold(body.to_owned(), |text, id| text.replace(id, "ID"))
}

/// Two goals that nothing else on a page has.
const SCORED: [u32; 2] = [7913, 4421];

fn strikingly(_: &Game, [home, away]: [&str; 2]) -> Went {
    let went = Went {
        penalty_points: [1.25, 2.5],
        ..Went::goals(SCORED[0], SCORED[1])
    };
    if home > away { went } else { went.turned() }
}

/// Nothing of how the games of [`strikingly`] ended is anywhere in a page.
#[track_caller]
fn check_tells_nothing(body: &str) {
    let body = without_ids(body);
    for telling in [
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
        let found = body.find(telling);
        let around = found.map(|at| {
            let from = body[..at]
                .char_indices()
                .rev()
                .nth(80)
                .map_or(0, |(at, _)| at);
            body[from..].chars().take(200).collect::<String>()
        });
        assert_eq!(around, None, "{telling:?} is told");
    }
}

#[tokio::test]
async fn without_a_tournament_the_list_says_so_and_nothing_leads_there() {
    let site = Site::start().await;
    let list = page(&site, "/tournaments").await;
    assert_eq!(texts(&list, "h2"), ["There is no tournament yet"]);
    assert!(!links(&list, "header a").contains(&"/tournaments".to_owned()));
    let none = site
        .get(&format!("/tournaments/{}", uuid::Uuid::now_v7()), None)
        .await;
    assert_eq!(none.status, 404);
}

#[tokio::test]
async fn a_tournaments_page_has_standings_cross_table_schedule_ratings_and_submissions() {
    let cup = Cup::open(&["A", "B", "C"], one_round()).await;
    let path = path(&cup);
    let open = page(&cup.site, &path).await;
    assert!(texts(&open, "h2").contains(&"No round was started yet".to_owned()));
    cup.start_round().await;
    cup.play_next(first_by_name_wins).await.unwrap();
    let between = page(&cup.site, &path).await;
    assert!(texts(&between, ".standings caption")[0].starts_with("Provisional"));
    assert!(texts(&between, ".games td").contains(&"waits for a slot".to_owned()));
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
        .map(|row| rewritten(&row, &found)),
    );
    // Each game once in its row and once in the other's, from both sides, and linked.
    let mut games: Vec<String> = Vec::new();
    for game in cup.games().await {
        games.push(format!("/games/{}", text(&game["id"])));
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
    let told = texts(&html, ".games td:last-child");
    assert!(
        told.contains(&"A wins: higher score".to_owned()),
        "{told:?}"
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
            entrant.contains(&text(&submission["submission"])),
            "{entrant}"
        );
    }

    for from in [
        "/season",
        "/tournaments",
        &format!("/teams/{}", cup.teams["A"].id),
    ] {
        let html = page(&cup.site, from).await;
        assert!(links(&html, "main a").contains(&path), "{from}");
        assert!(
            links(&html, "header a").contains(&"/tournaments".to_owned()),
            "{from}"
        );
    }
}

/// Penalty points follow from who was at home; the rest of a row is what counts here.
fn rewritten(row: &str, rows: &[String]) -> String {
    let head = row.rsplit_once(' ').unwrap().0;
    let found = rows.iter().find(|found| found.starts_with(head));
    found.map_or_else(|| row.to_owned(), Clone::clone)
}

#[tokio::test]
async fn what_was_voided_and_who_left_stand_in_the_schedule_with_the_reason() {
    let cup = Cup::open(&["A", "B", "C"], one_round()).await;
    cup.start_round().await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    let [home, away] = cup.names(&game).await;
    let voided = json!({ "reason": "a <b>lamp</b> fell", "confirm": format!("{home} - {away}") });
    let path_of = format!("/api/v1/games/{}/void", game.id);
    let answer = cup.site.post(&path_of, Some(ADMIN), &voided).await;
    assert_eq!(answer.status, 200, "{}", answer.body);
    let html = page(&cup.site, &path(&cup)).await;
    let told = texts(&html, ".games td:last-child");
    assert!(
        told.contains(&"voided, to be played again: a <b>lamp</b> fell".to_owned()),
        "{told:?}"
    );
    let hidden = hidden(&cup.site, &path(&cup)).await;
    assert!(!hidden.body.contains("lamp"), "a reason may tell");
}

#[tokio::test]
async fn a_game_that_was_taken_out_says_by_whose_leaving() {
    let cup = Cup::open(&["A", "B", "C"], one_round()).await;
    cup.start_round().await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    let [home, _] = cup.names(&game).await;
    let out =
        json!({ "team": home, "as": "withdrawn", "reason": "the arm is sold", "confirm": home });
    cup.post("departures", out).await.json(200);
    let words = format!("since {home} left");
    let of_game = page(&cup.site, &format!("/games/{}", game.id)).await;
    assert!(texts(&of_game, ".lead")[0].contains(&words));
    let html = page(&cup.site, &path(&cup)).await;
    assert_eq!(
        links(&html, ".cross a.out").len(),
        4,
        "its two games are struck through, from both sides"
    );
    let told = texts(&html, ".games td:last-child");
    assert!(told.iter().any(|told| told.ends_with(&words)), "{told:?}");
    let teams = texts(&html, "[data-live-region=entrants] th");
    let left = format!("{home} withdrawn from round 1 on: the arm is sold");
    assert!(teams.contains(&left), "{teams:?}");
}

#[tokio::test]
async fn who_wants_no_spoilers_finds_no_result_anywhere_and_can_ask_for_one() {
    let cup = Cup::open(&["Ant", "Bee", "Cat"], one_round()).await;
    cup.start_round().await;
    cup.play(strikingly).await;
    let games = cup.games().await;
    let game = format!("/games/{}", text(&games[0]["id"]));
    let [ant, bee] = ["Ant", "Bee"].map(|name| cup.teams[name].id.clone());
    let pages = [
        path(&cup),
        "/tournaments".to_owned(),
        game.clone(),
        format!("{}/teams/{ant}/{bee}", path(&cup)),
    ];
    for path in &pages {
        let open = cup.site.get(path, None).await;
        assert_eq!(open.status, 200, "{}", open.body);
        check_tells_nothing(&hidden(&cup.site, path).await.body);
    }
    let shown = without_ids(&cup.site.get(&pages[0], None).await.body);
    assert!(
        shown.contains("7913") && shown.contains("Champion"),
        "else nothing was hidden"
    );
    let teams = Html::parse_document(&hidden(&cup.site, &pages[0]).await.body);
    let order = texts(&teams, ".cross th[scope=row]");
    assert_eq!(
        order,
        ["1 Ant", "2 Bee", "3 Cat"],
        "by name, the champion last"
    );

    let html = Html::parse_document(&hidden(&cup.site, &game).await.body);
    let asked = format!("{game}?show=result");
    assert!(links(&html, "#result ~ p a").contains(&asked));
    let told = hidden(&cup.site, &asked).await.body;
    assert!(told.contains("7913"), "{told}");
}

#[tokio::test]
async fn the_choice_is_a_form_of_our_own_pages_and_leads_back() {
    let cup = Cup::open(&["A", "B"], one_round()).await;
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
    let away = browser
        .submit(
            "/spoilers",
            &[("results", "shown"), ("next", "https://evil.example/games")],
        )
        .await;
    assert_eq!(away.header("location"), "/tournaments");
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
async fn who_reached_the_final_is_a_result_too() {
    let rules = json!({ "format": { "kind": "groups", "groups": 2, "advance": 1 } });
    let cup = Cup::open(&["A", "B", "C", "D"], json!({ "rules": rules })).await;
    cup.start_round().await;
    cup.play(strikingly).await;
    cup.start_round().await;
    cup.play(strikingly).await;
    let games = cup.games().await;
    let last = games.iter().find(|game| game["round"] == 2).unwrap();
    let last = format!("/games/{}", text(&last["id"]));
    let open = page(&cup.site, &path(&cup)).await;
    assert!(links(&open, "main a").contains(&last));
    let own = hidden(&cup.site, &path(&cup)).await;
    check_tells_nothing(&own.body);
    let own = Html::parse_document(&own.body);
    assert!(!links(&own, "main a").contains(&last));
    let rounds = texts(&own, "[data-live-region=entrants] tbody td");
    assert!(
        rounds.iter().all(|plays| !plays.contains("rounds 1, 2")),
        "{rounds:?}"
    );
    let asked = format!("{}?show=round-2", path(&cup));
    let asked = hidden(&cup.site, &asked).await;
    check_tells_nothing(&asked.body);
    assert!(links(&Html::parse_document(&asked.body), "main a").contains(&last));
}

#[tokio::test]
async fn two_teams_stand_side_by_side_whoever_was_at_home() {
    let cup = Cup::open(&["A", "B", "C"], json!({})).await;
    for _ in 0..2 {
        cup.start_round().await;
        cup.play(|_, [home, _]| Went {
            fouls: if home == "A" { [1, 4] } else { [4, 1] },
            ..if home == "A" {
                Went::goals(5, 2)
            } else {
                Went::goals(2, 5)
            }
        })
        .await;
    }
    let [a, b] = ["A", "B"].map(|name| cup.teams[name].id.clone());
    let two = format!("{}/teams/{a}/{b}", path(&cup));
    let html = page(&cup.site, &two).await;
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
    let turned = page(&cup.site, &format!("{}/teams/{b}/{a}", path(&cup))).await;
    let games = texts(&turned, "[aria-labelledby=numbers] tbody td:nth-of-type(1)");
    assert_eq!(games, ["2 : 5", "2 : 5"]);
    let tournament = page(&cup.site, &path(&cup)).await;
    assert!(links(&tournament, "main a").contains(&two));
    for wrong in [
        format!("{}/teams/{a}/{a}", path(&cup)),
        format!("{}/teams/{a}/x", path(&cup)),
    ] {
        assert_eq!(cup.site.get(&wrong, None).await.status, 404, "{wrong}");
    }
}

#[tokio::test]
async fn a_game_under_way_tells_its_score_without_a_script_and_names_its_stream() {
    let cup = Cup::open(&["A", "B"], one_round()).await;
    cup.start_round().await;
    let (claim, game, seed) = cup.claim().await.unwrap();
    let [home, _] = cup.names(&game).await;
    let live = cup.site.store.live_games();
    live.begin(game.id, 1, 45_000);
    let goal = LiveHappening {
        step: 3000,
        what: GameHappening::Goal {
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
    let path_of = format!("/games/{}", game.id);
    let html = page(&cup.site, &path_of).await;
    let verdict = texts(&html, ".verdict").remove(0);
    assert!(
        verdict.starts_with("1 : 0 after 1.0 of 15.0 minutes"),
        "{verdict}"
    );
    let happened = rows(&html, "[data-live-region=live] tbody tr");
    assert_eq!(happened, [format!("1:00.0 Goal by {home}: 1 : 0")]);
    let main = Selector::parse("main").unwrap();
    let stream = |html: &Html| {
        let main = html.select(&main).next().unwrap();
        main.attr("data-live-stream").map(str::to_owned)
    };
    assert_eq!(
        stream(&html),
        Some(format!("/api/v1/games/{}/live", game.id))
    );
    let puck = Selector::parse("[data-live-place=puck]").unwrap();
    let puck = html.select(&puck).next().unwrap();
    assert_eq!(
        (puck.attr("cx"), puck.attr("cy")),
        (Some("250"), Some("-100"))
    );
    let running = page(&cup.site, &path(&cup)).await;
    assert!(
        links(&running, ".lead a").contains(&path_of),
        "what is being played"
    );

    let own = hidden(&cup.site, &path_of).await;
    let own = Html::parse_document(&own.body);
    assert_eq!(stream(&own), None, "its stream tells the score");
    assert!(texts(&own, ".verdict").is_empty());
    cup.commit(&claim, &game, seed, Went::goals(3, 0)).await;
    let over = page(&cup.site, &path_of).await;
    assert_eq!(stream(&over), None);
    assert!(texts(&over, ".verdict")[0].starts_with("3 : 0"));
}
