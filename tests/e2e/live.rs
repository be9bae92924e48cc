//! Pages that follow what happens, in a real browser.

use crate::{CONFIG, Team, path_of, start_day};
use faceoff_tests::{
    browser::{Browser, Page, View},
    repository,
    server::Server,
};
use std::{
    io::{Read, Write},
    net::TcpStream,
};

/// Readers of the stream of events that a server has room for.
const READERS: usize = 512;

/// Notes each stream that a page opens, and how long it waits before it opens another one.
const NOTES: &str = "
    window.streams = [];
    window.waits = [];
    window.EventSource = class extends window.EventSource {
        constructor(...of) { super(...of); window.streams.push(this); }
    };
    const later = window.setTimeout;
    window.setTimeout = (what, ms, ...of) => {
        if (what.name === 'follow') window.waits.push(ms);
        return later(what, ms, ...of);
    };
";

/// What a page that nobody looks at is told, or one that somebody looks at again.
fn look_away(page: &Page, is_hidden: bool) {
    let _ = page.evaluate(&format!(
        "Object.defineProperty(document, 'hidden', {{ configurable: true, get: () => {is_hidden} }});
        document.dispatchEvent(new Event('visibilitychange'))"
    ));
}

/// Words that nothing but a page that was never loaded again still has.
fn mark(page: &Page) {
    assert_eq!(page.evaluate("window.kept = true"), true);
}

fn was_never_loaded_again(page: &Page) -> bool {
    page.evaluate("window.kept") == true
}

/// Words that lie outside of the window, but in tables that scroll by themselves; their captions do not.
const CUT: &str = "(() => {
    const cut = [];
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const parent = walker.currentNode.parentElement;
        const scrolls = parent.closest('.wide') && !parent.closest('caption, .board');
        if (scrolls || parent.closest('.sr, .skip, pre, svg')) continue;
        const range = document.createRange();
        range.selectNodeContents(walker.currentNode);
        const box = range.getBoundingClientRect();
        if (box.width > 0 && (box.left < 0 || box.right > innerWidth + 0.5)) cut.push(walker.currentNode.data);
    }
    return cut;
})()";

#[test]
fn a_board_and_an_evaluation_follow_a_day_without_being_loaded_again() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    let teams = ["Alpha", "Beta"].map(|name| Team::create(&server, name));
    let submissions = teams
        .each_ref()
        .map(|team| team.submit(&server, &repository().join("agents/hold")));

    let board = browser.open(&format!("{}/", server.url));
    assert_eq!(board.text("#empty"), "No team has a result yet");
    mark(&board);
    let day = start_day(&server);
    let of_team = path_of(&day, &submissions[1]).replace("/api/v1", "");
    let evaluation = browser.open(&format!("{}{of_team}", server.url));
    mark(&evaluation);

    board.wait_for(".board th.team a");
    let first = board.text(".board th.team a");
    let _ = board.evaluate("document.querySelector('.board th.team a').focus()");
    // What has changed is said to who does not see it.
    board.wait_until(
        "document.querySelector('[data-live-said]').textContent.includes('The board has changed')",
    );
    board.wait_until("document.querySelectorAll('.board th.team').length == 2");
    assert!(was_never_loaded_again(&board));
    assert_eq!(
        board.evaluate("document.activeElement.textContent"),
        first.as_str(),
        "who has come to a team stays there"
    );
    board.wait_until("document.querySelector('.under-way') === null");

    evaluation.wait_for("#result");
    assert!(was_never_loaded_again(&evaluation));
    // What comes out with the day's release came, too.
    evaluation.wait_for("#violations");
    for page in [&board, &evaluation] {
        assert_eq!(page.console_errors(), [""; 0]);
    }

    // A moment is told by the server's clock, and by that of who reads it.
    let far_away = View {
        time_zone: "Asia/Kolkata",
        ..View::PHONE
    };
    let page = browser.open_in(far_away, &format!("{}{of_team}", server.url));
    page.wait_for("time .local");
    assert!(page.text("time:has(.local)").contains(" UTC ("));
    assert!(page.text("time .local").contains("GMT+5:30"));
    assert_eq!(page.overflow(), 0);

    // Without scripts the same is there, for who loads it; and nothing is cut on a phone.
    for path in ["/", "/?sort=team", "/tasks/hit", &of_team] {
        for view in [View::PHONE, View::PHONE.dark().without_scripts()] {
            let page = browser.open_in(view, &format!("{}{path}", server.url));
            assert_eq!(page.overflow(), 0, "{path} is wider than a phone");
            if path != of_team {
                assert_eq!(
                    page.evaluate("document.querySelectorAll('.board th.team').length"),
                    2
                );
            }
            assert_eq!(page.evaluate(CUT), serde_json::json!([]), "{path}");
            assert_eq!(page.console_errors(), [""; 0], "{path}");
        }
    }
}

#[test]
fn a_page_that_is_refused_its_stream_comes_again_later_each_time() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    let address = server.url.trim_start_matches("http://");
    let others: Vec<TcpStream> = (0..READERS)
        .map(|_| {
            let mut reader = TcpStream::connect(address).expect("the server has room");
            let asked = format!("GET /api/v1/events/stream HTTP/1.1\r\nHost: {address}\r\n\r\n");
            reader
                .write_all(asked.as_bytes())
                .expect("the server reads");
            let mut status = [0; 12];
            reader.read_exact(&mut status).expect("the server answers");
            assert_eq!(&status, b"HTTP/1.1 200");
            reader
        })
        .collect();

    let page = browser.open(&format!("{}/docs", server.url));
    page.before_scripts(NOTES);
    page.go(&format!("{}/", server.url));
    page.wait_until("waits.length == 3");
    drop(others);
    page.wait_until("streams.at(-1).readyState == EventSource.OPEN");
    let waits = page.evaluate("waits.slice(0, 3)");
    for (index, least) in [500.0, 1000.0, 2000.0].into_iter().enumerate() {
        let wait = waits[index].as_f64().expect("milliseconds");
        assert!((least..3.0 * least).contains(&wait), "waited {waits} ms");
    }
    // It is as up to date as any other from then on.
    mark(&page);
    let _ = Team::create(&server, "Alpha").submit(&server, &repository().join("agents/hold"));
    let _ = start_day(&server);
    page.wait_for(".board th.team a");
    assert!(was_never_loaded_again(&page));
}

#[test]
fn who_does_not_look_holds_no_stream_and_who_has_scrolled_stays_there() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let board = browser.open(&format!("{}/docs", server.url));
    board.before_scripts(NOTES);
    board.go(&format!("{}/", server.url));
    board.wait_until("streams.at(-1)?.readyState == EventSource.OPEN");
    mark(&board);
    look_away(&board, true);
    let open = "streams.filter(one => one.readyState != EventSource.CLOSED).length";
    assert_eq!(board.evaluate(open), 0);

    let path = path_of(&start_day(&server), &submission).replace("/api/v1", "");
    let window = View {
        height: 200,
        ..View::PHONE
    };
    let read = browser.open_in(window, &format!("{}{path}", server.url));
    mark(&read);
    let _ = read.evaluate("scrollTo(0, document.documentElement.scrollHeight)");
    let place = "document.querySelector('footer a').getBoundingClientRect().top";
    let [before, height] = [place, "document.body.offsetHeight"].map(|of| read.evaluate(of));
    assert!(
        read.evaluate("document.querySelector('#result')").is_null()
            && read.evaluate("document.querySelector('main').getBoundingClientRect().bottom < 0")
                == true,
        "what will change lies above what is read"
    );
    read.wait_for("#result");
    read.wait_for("#violations");
    assert!(was_never_loaded_again(&read));
    assert_ne!(read.evaluate("document.body.offsetHeight"), height);
    // Windows scroll by whole pixels.
    let [before, now] = [before, read.evaluate(place)].map(|top| top.as_f64().unwrap_or(f64::NAN));
    assert!((now - before).abs() < 1.0, "from {before} to {now}");

    // Whoever comes back to a page finds it as it is now.
    assert_eq!(
        board.evaluate("document.querySelectorAll('.board th.team').length"),
        0
    );
    look_away(&board, false);
    board.wait_for(".board th.team a");
    assert_eq!(board.evaluate(open), 1);
    assert!(was_never_loaded_again(&board));
}
