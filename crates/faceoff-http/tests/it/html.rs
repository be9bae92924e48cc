//! Helpers for tests of pages: they fetch a page, and parse it as a browser does.

use crate::site::Site;
use scraper::{Html, Selector};

/// Fetches a page, which must be valid HTML without inline styles or scripts.
pub async fn page(site: &Site, path: &str) -> Html {
    let answer = site.get(path, None).await;
    let html = answer.html(200);
    assert!(!answer.body.contains("style="));
    // The content security policy allows no other script.
    for (start, _) in answer.body.match_indices("<script") {
        let script = &answer.body[start..];
        assert!(script.starts_with("<script type=\"module\" src=\"/static/live.js?"));
    }
    html
}

/// The text of each element that the selector finds, with single spaces between words.
pub fn texts(html: &Html, selector: &str) -> Vec<String> {
    html.select(&Selector::parse(selector).unwrap())
        .map(|element| {
            element
                .text()
                .collect::<String>()
                .split_whitespace()
                .collect::<Vec<_>>()
                .join(" ")
        })
        .collect()
}

/// The target of each link that the selector finds.
pub fn links(html: &Html, selector: &str) -> Vec<String> {
    attributes(html, selector, "href")
}

/// The attribute `name` of each element that the selector finds.
pub fn attributes(html: &Html, selector: &str, name: &str) -> Vec<String> {
    html.select(&Selector::parse(selector).unwrap())
        .map(|element| element.attr(name).unwrap().to_owned())
        .collect()
}

/// The text of each table row that the selector finds: its cells with one space between.
pub fn rows(html: &Html, selector: &str) -> Vec<String> {
    let cell = Selector::parse("th, td").unwrap();
    html.select(&Selector::parse(selector).unwrap())
        .map(|row| {
            let cells = row.select(&cell).map(|cell| {
                let text: String = cell.text().collect();
                text.split_whitespace().collect::<Vec<_>>().join(" ")
            });
            cells.collect::<Vec<_>>().join(" ")
        })
        .collect()
}
