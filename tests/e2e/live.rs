//! Pages that follow what happens, in a real browser.

use crate::{CONFIG, Team, path_of, start_day};
use faceoff_tests::{
    browser::{Browser, Page, View},
    repository,
    server::Server,
};

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
