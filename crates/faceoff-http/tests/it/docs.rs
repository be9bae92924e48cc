//! Tests of the documentation on the site: its pages, their links, and the search.

use crate::site::{Answer, Site};
use reqwest::Method;
use scraper::{Html, Selector};
use std::collections::{BTreeMap, BTreeSet};

/// Longest page before compression. Compressed, a page has about a quarter of its bytes.
const MAX_PAGE_BYTES: usize = 150_000;

/// All elements that the selector finds.
fn select_all<'a>(page: &'a Html, selector: &str) -> Vec<scraper::ElementRef<'a>> {
    page.select(&Selector::parse(selector).unwrap()).collect()
}

/// The attribute `name` of each element that the selector finds and that has it.
fn attributes(page: &Html, selector: &str, name: &str) -> Vec<String> {
    let elements = select_all(page, selector);
    let values = elements.iter().filter_map(|element| element.attr(name));
    values.map(str::to_owned).collect()
}

/// The text of an element, with single spaces between words.
fn text_of(element: scraper::ElementRef<'_>) -> String {
    let texts = element.text().flat_map(str::split_whitespace);
    texts.collect::<Vec<_>>().join(" ")
}

async fn fetch_page(site: &Site, path: &str) -> Html {
    let answer = site.get(path, None).await;
    assert_eq!(answer.status, 200, "{path}: {}", answer.body);
    assert_eq!(answer.header("content-type"), "text/html; charset=utf-8");
    Html::parse_document(&answer.body)
}

async fn search(site: &Site, query: &str) -> Html {
    let parameters = [("q", query)];
    let request = site.request(Method::GET, "/docs/search", None);
    let answer = Answer::read(request.query(&parameters).send().await.unwrap()).await;
    assert_eq!(answer.status, 200, "{}", answer.body);
    Html::parse_document(&answer.body)
}

#[tokio::test]
async fn documentation_has_no_broken_links() {
    let site = Site::start().await;
    let mut unvisited = vec!["/docs".to_owned()];
    // The ids of elements on each visited page.
    let mut ids: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    // Links with an anchor: the linking page, and the link.
    let mut links: Vec<(String, String)> = Vec::new();
    while let Some(path) = unvisited.pop() {
        if ids.contains_key(&path) {
            continue;
        }
        let answer = site.get(&path, None).await;
        assert_eq!(answer.status, 200, "{path}, linked from {links:?}");
        if !path.starts_with("/docs") || path.starts_with("/docs/images/") {
            ids.insert(path, BTreeSet::new());
            continue;
        }
        assert!(
            answer.body.len() < MAX_PAGE_BYTES,
            "{path}: {} bytes",
            answer.body.len()
        );
        let page = Html::parse_document(&answer.body);
        assert_eq!(select_all(&page, "h1").len(), 1, "{path}");
        // Elements that the content security policy blocks, or that load content of other sites.
        for forbidden in [
            "script:not([src^='/static/live.js?']):not([src^='/static/docs.js?'])",
            "style",
            "[style]",
            "[onclick]",
            "iframe",
        ] {
            assert_eq!(select_all(&page, forbidden).len(), 0, "{path}: {forbidden}");
        }
        for picture in attributes(&page, "img", "src") {
            assert!(picture.starts_with('/'), "{path}: {picture}");
            unvisited.push(picture);
        }
        let page_ids = attributes(&page, "[id]", "id");
        let unique: BTreeSet<String> = page_ids.iter().cloned().collect();
        assert_eq!(
            unique.len(),
            page_ids.len(),
            "{path}: an id twice in {page_ids:?}"
        );
        for labelled in attributes(&page, "[aria-labelledby]", "aria-labelledby") {
            assert!(unique.contains(&labelled), "{path}: {labelled}");
        }
        // A wide table scrolls in its own region, which can be focused by keyboard.
        let tables = select_all(&page, "table").len();
        let regions = select_all(&page, r#".wide[role="region"][tabindex="0"] > table"#);
        assert_eq!(regions.len(), tables, "{path}");
        let mut names = attributes(&page, r#"[role="region"]"#, "aria-label");
        names.extend(attributes(&page, r#"[role="region"]"#, "aria-labelledby"));
        let distinct: BTreeSet<&String> = names.iter().collect();
        assert_eq!(distinct.len(), tables, "{path}: {names:?}");
        ids.insert(path.clone(), unique);
        for link in attributes(&page, "a", "href") {
            if link.starts_with("http://") || link.starts_with("https://") {
                continue;
            }
            let (target, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = if target.is_empty() { &path } else { target };
            assert!(target.starts_with('/'), "{path}: {link}");
            // The account page requires a signed-in user.
            if target != "/account" {
                unvisited.push(target.to_owned());
            }
            if !anchor.is_empty() {
                links.push((path.clone(), format!("{target}#{anchor}")));
            }
        }
    }
    for (page, link) in links {
        let (target, anchor) = link.split_once('#').unwrap();
        assert!(ids[target].contains(anchor), "{page}: nothing is at {link}");
    }
    // Each file of the documentation folder is on the site.
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs");
    let mut documents = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if let Some(name) = name.strip_suffix(".md") {
            assert!(ids.contains_key(&format!("/docs/{name}")), "{name}");
            documents += 1;
        }
    }
    assert!(documents >= 16, "{documents} documents");
    for path in ["/docs/api-reference/public", "/docs/api-reference/schemas"] {
        assert!(ids.contains_key(path), "{path}");
    }
    assert!(ids.contains_key("/docs/images/robot.svg"));
}

#[tokio::test]
async fn api_reference_lists_all_operations_and_schemas() {
    let site = Site::start().await;
    let document = site.get("/api/v1/openapi.json", None).await.json(200);
    let mut operations = BTreeSet::new();
    for tag in document["tags"].as_array().unwrap() {
        let tag = tag["name"].as_str().unwrap();
        let page = fetch_page(&site, &format!("/docs/api-reference/{tag}")).await;
        operations.extend(select_all(&page, "h2").into_iter().map(text_of));
    }
    let mut documented = BTreeSet::new();
    for (path, methods) in document["paths"].as_object().unwrap() {
        for method in methods.as_object().unwrap().keys() {
            documented.insert(format!("{} {path}", method.to_uppercase()));
        }
    }
    assert_eq!(operations, documented);
    let page = fetch_page(&site, "/docs/api-reference/schemas").await;
    let listed: BTreeSet<String> = select_all(&page, "dt").into_iter().map(text_of).collect();
    let schemas = document["components"]["schemas"].as_object().unwrap();
    let schemas: BTreeSet<String> = schemas.keys().cloned().collect();
    assert_eq!(listed, schemas);
    // The section of one operation.
    let page = fetch_page(&site, "/docs/api-reference/public").await;
    let sections = select_all(&page, ".operation");
    let board = sections.into_iter().map(text_of);
    let board = board
        .into_iter()
        .find(|section| section.starts_with("GET /api/v1/board #"))
        .unwrap();
    for expected in [
        "Returns the overall board of a stage.",
        "Token optional: team or organiser.",
        "stage query StageId The board's stage.",
        "200 success BoardView text/csv: string",
        "404 no such stage, revision or division, or the day has no results Problem",
    ] {
        assert!(board.contains(expected), "{expected}: {board}");
    }
}

#[tokio::test]
async fn side_list_has_all_pages_and_marks_the_current() {
    let site = Site::start().await;
    let contents = fetch_page(&site, "/docs").await;
    assert_eq!(select_all(&contents, ".side").len(), 0);
    let all = attributes(&contents, "main .card dl a", "href");
    for (path, current, state, headings) in [
        ("/docs/rules", "/docs/rules", "page", ".prose h2"),
        (
            "/docs/api-reference",
            "/docs/api-reference",
            "page",
            "#tokens, #responses",
        ),
        (
            "/docs/api-reference/public",
            "/docs/api-reference/public",
            "page",
            ".operation h2",
        ),
        (
            "/docs/api-reference/schemas/BoardView",
            "/docs/api-reference/schemas",
            "true",
            "#none",
        ),
    ] {
        let page = fetch_page(&site, path).await;
        let listed = attributes(&page, ".side-list > ul > li > a", "href");
        assert_eq!(listed, all, "{path}");
        let marked = ".side a[aria-current]";
        assert_eq!(attributes(&page, marked, "href"), [current], "{path}");
        let states = attributes(&page, marked, "aria-current");
        assert_eq!(states, [state], "{path}");
        let below = ".side a[aria-current] + ul[aria-label='On this page'] a";
        let ids = attributes(&page, headings, "id").into_iter();
        let anchors: Vec<String> = ids.map(|id| format!("#{id}")).collect();
        assert_eq!(attributes(&page, below, "href"), anchors, "{path}");
        assert_eq!(anchors.is_empty(), headings == "#none", "{path}");
    }
    // Each group of the list has a name.
    let names = attributes(
        &fetch_page(&site, "/docs/rules").await,
        ".side-list > p",
        "id",
    );
    assert_eq!(names.len(), 5);
}

#[tokio::test]
async fn documents_link_to_their_neighbours() {
    let site = Site::start().await;
    let contents = fetch_page(&site, "/docs").await;
    let documents = attributes(&contents, "main .card dl a", "href");
    let is_document = |path: &&String| !path.starts_with("/docs/api-reference");
    let documents: Vec<&String> = documents.iter().filter(is_document).collect();
    // Read in the order of the links, the documents are all there.
    let mut read = Vec::new();
    let mut next = vec!["/docs/start".to_owned()];
    while let Some(path) = next.pop() {
        let page = fetch_page(&site, &path).await;
        let previous = attributes(&page, ".neighbours a[rel=prev]", "href");
        assert_eq!(previous, Vec::from_iter(read.last().cloned()), "{path}");
        next = attributes(&page, ".neighbours a[rel=next]", "href");
        read.push(path);
        assert!(read.len() <= documents.len(), "{read:?}");
    }
    assert_eq!(read.iter().collect::<Vec<_>>(), documents);
}

#[tokio::test]
async fn search_finds_sections_and_marks_words() {
    let site = Site::start().await;
    let page = search(&site, "Frozen BOARDS").await;
    let first_result = select_all(&page, ".search-results li a")[0];
    assert_eq!(first_result.attr("href"), Some("/docs/api#frozen-boards"));
    assert_eq!(text_of(first_result), "Frozen boards");
    let marked: Vec<String> = first_result
        .select(&Selector::parse("mark").unwrap())
        .map(text_of)
        .collect();
    assert_eq!(marked, ["Frozen", "boards"]);
    // Operations and schemas are found, too.
    let page = search(&site, "BoardView").await;
    let links = attributes(&page, ".search-results li a", "href");
    assert_eq!(links[0], "/docs/api-reference/schemas/BoardView");
    // The kinds of results are apart: first prose, then operations, then types.
    let page = search(&site, "board").await;
    let kinds = select_all(&page, "main h2").into_iter().map(text_of);
    let kinds: Vec<String> = kinds
        .map(|kind| {
            kind.trim_end_matches(|c: char| c == ' ' || c.is_ascii_digit())
                .into()
        })
        .collect();
    assert_eq!(kinds, ["Documents", "API operations", "API schemas"]);
    let lead = text_of(select_all(&page, ".lead")[0]);
    assert!(lead.contains("Add words to narrow the search."), "{lead}");

    let page = search(&site, "quidditch").await;
    let message = text_of(select_all(&page, "main")[0]);
    for text in [
        "No section contains all words of “quidditch”",
        "Try fewer words",
    ] {
        assert!(message.contains(text), "{message}");
    }
    let page = search(&site, "").await;
    let message = text_of(select_all(&page, "main")[0]);
    assert!(message.contains("Enter one or more words"), "{message}");
}

#[tokio::test]
async fn search_handles_questions_word_forms_typos_synonyms() {
    let site = Site::start().await;
    for (query, expected) in [
        ("how do I submit", "/docs/start"),
        ("submitted", "/docs/start"),
        ("What GPU do agents get?", "/docs/sandbox"),
        ("hardware", "/docs/sandbox"),
        ("leaderboard", "/docs/rules#score-and-boards"),
        ("disqualify", "/docs/rules#teams-that-leave"),
        ("ban", "/docs/workers#trust"),
        ("quotas", "/docs/api#for-a-team"),
        ("tournamant", "/docs/tournament"),
        ("Stable Baselines", "/docs/from-sb3"),
    ] {
        let page = search(&site, query).await;
        let links = attributes(&page, ".search-results li a", "href");
        let best = &links[..links.len().min(8)];
        assert!(
            best.iter().any(|link| link == expected),
            "{query}: {best:?}"
        );
    }
    let page = search(&site, "the tournamant").await;
    let lead = text_of(select_all(&page, ".lead")[0]);
    for text in [
        "Showing results for “the tournament”.",
        "Nothing contains “tournamant”.",
    ] {
        assert!(lead.contains(text), "{lead}");
    }
    let page = search(&site, "tournament").await;
    let lead = text_of(select_all(&page, ".lead")[0]);
    assert!(!lead.contains("Showing results for"), "{lead}");
}

#[tokio::test]
async fn code_is_highlighted_and_prompts_are_marked() {
    let site = Site::start().await;
    let page = fetch_page(&site, "/docs/start").await;
    let listings = select_all(&page, ".prose pre");
    assert_eq!(select_all(&page, ".listing > pre").len(), listings.len());
    let commands: Vec<String> = select_all(&page, "pre .command")
        .into_iter()
        .map(text_of)
        .collect();
    assert!(
        commands.iter().any(|command| command == "faceoff submit ."),
        "{commands:?}"
    );
    let prompts = select_all(&page, "pre .prompt");
    assert_eq!(prompts.len(), commands.len());
    assert!(!commands.iter().any(|command| command.starts_with('$')));
    let page = fetch_page(&site, "/docs/configuration").await;
    let keys: Vec<String> = select_all(&page, "pre .code-key")
        .into_iter()
        .map(text_of)
        .collect();
    assert!(keys.iter().any(|key| key == "listen"), "{keys:?}");
}

#[tokio::test]
async fn search_query_is_escaped_and_limited() {
    let site = Site::start().await;
    let query = "<script>alert(\"1\")</script>";
    let page = search(&site, query).await;
    assert_eq!(select_all(&page, "script:not([src])").len(), 0);
    assert_eq!(attributes(&page, "#q", "value"), [query]);
    assert!(text_of(select_all(&page, "main")[0]).contains(query));

    let longest = "ä".repeat(200);
    search(&site, &longest).await;
    let longer = format!("/docs/search?q={}", "a".repeat(201));
    let answer = site.get(&longer, None).await;
    assert_eq!(answer.status, 400);
    assert_eq!(answer.header("content-type"), "text/html; charset=utf-8");
    let message = "q: expected at most 200 characters, got 201";
    assert!(answer.body.contains(message), "{}", answer.body);
}

#[tokio::test]
async fn missing_documentation_page_is_not_found() {
    let site = Site::start().await;
    for (path, message) in [
        ("/docs/nothing", "The documentation has no page nothing"),
        ("/docs/start.md", "The documentation has no page start.md"),
        ("/docs/api-reference/unknown", "no operations named unknown"),
        ("/docs/api-reference/schemas/Nothing", "no schema Nothing"),
        ("/docs/images/nothing.svg", "no picture nothing.svg"),
    ] {
        let answer = site.get(path, None).await;
        assert_eq!(answer.status, 404, "{path}");
        assert!(answer.body.contains(message), "{path}: {}", answer.body);
    }
}

#[tokio::test]
async fn unchanged_documentation_answers_not_modified() {
    let site = Site::start().await;
    for path in [
        "/docs",
        "/docs/rules",
        "/docs/api-reference",
        "/docs/search?q=puck",
        "/docs/images/board.png",
    ] {
        let answer = site.get(path, None).await;
        let request = site.request(Method::GET, path, None);
        let request = request.header("if-none-match", answer.header("etag"));
        let again = Answer::read(request.send().await.unwrap()).await;
        assert_eq!((again.status.as_u16(), &*again.body), (304, ""), "{path}");
        for header in ["etag", "cache-control"] {
            assert_eq!(again.header(header), answer.header(header), "{path}");
        }
        // Pages name the signed-in user; pictures do not.
        let scope = match path.contains("/images/") {
            true => "public",
            false => "private",
        };
        assert!(answer.header("cache-control").starts_with(scope), "{path}");
    }
}

#[tokio::test]
async fn pages_have_metadata_for_link_previews() {
    let site = Site::start().await;
    let metadata = |page: &Html, property: &str| {
        attributes(page, &format!(r#"meta[property="{property}"]"#), "content")
    };
    let page = fetch_page(&site, "/docs/robot").await;
    assert_eq!(
        metadata(&page, "og:title"),
        ["The robot and the table · Faceoff"]
    );
    assert_eq!(metadata(&page, "og:type"), ["website"]);
    assert_eq!(
        metadata(&page, "og:description"),
        attributes(&page, r#"meta[name="description"]"#, "content")
    );
    // Without a public URL the server cannot give the address of a picture.
    assert_eq!(metadata(&page, "og:image"), [""; 0]);

    let site = site.with_public_url("https://faceoff.example.org").await;
    for path in ["/", "/docs", "/season"] {
        let page = fetch_page(&site, path).await;
        let [picture] = &metadata(&page, "og:image")[..] else {
            panic!("{path} has one picture");
        };
        let path = picture.strip_prefix("https://faceoff.example.org").unwrap();
        let answer = site.get(path, None).await;
        assert_eq!(answer.status, 200);
        assert_eq!(answer.header("content-type"), "image/png");
    }
    let team = site.team("Alpha").await;
    for path in ["/".to_owned(), format!("/teams/{}", team.id)] {
        let page = fetch_page(&site, &path).await;
        let address = format!("https://faceoff.example.org{path}");
        assert_eq!(metadata(&page, "og:url"), [&*address]);
        assert_eq!(attributes(&page, "link[rel=canonical]", "href"), [address]);
    }
    let team_page = fetch_page(&site, &format!("/teams/{}", team.id)).await;
    assert!(metadata(&team_page, "og:description")[0].contains("Alpha"));
    // A board of another day or order has several addresses.
    let sorted = fetch_page(&site, "/?sort=team").await;
    assert_eq!(metadata(&sorted, "og:url"), [""; 0]);
}

#[tokio::test]
async fn robots_may_read_pages_and_documentation_only() {
    let site = Site::start().await;
    let answer = site.get("/robots.txt", None).await;
    assert_eq!(answer.status, 200);
    assert_eq!(answer.header("content-type"), "text/plain; charset=utf-8");
    let refused: BTreeSet<&str> = answer
        .body
        .lines()
        .filter_map(|line| line.strip_prefix("Disallow: "))
        .collect();
    for path in [
        "/api/",
        "/account",
        "/sign-in",
        "/join",
        "/organiser",
        "/dashboard",
    ] {
        assert!(refused.contains(path), "{path}: {}", answer.body);
    }
    for path in [
        "/",
        "/docs/rules",
        "/season",
        "/tasks/hit",
        "/evaluations/1",
    ] {
        let is_refused = refused.iter().any(|prefix| path.starts_with(prefix));
        assert!(!is_refused, "{path}: {}", answer.body);
    }
}
