//! Tests of the rendering of Markdown: escaped HTML, links, anchors, tables and sections for the search.

use super::*;

/// Resolves two links: the page of `rules.md` and the picture `robot.svg`.
struct RulesAndRobot;

impl LinkResolver for RulesAndRobot {
    fn page(&self, file: &str) -> Option<(&str, String)> {
        (file == "rules.md").then(|| ("The rules", "/docs/rules".into()))
    }

    fn picture(&self, file: &str) -> Option<String> {
        (file == "images/robot.svg").then(|| "/docs/images/robot.svg".into())
    }
}

fn html(markdown: &str) -> String {
    render_document(markdown, "/docs/page", "Page", "Summary.", &RulesAndRobot).html
}

#[test]
fn html_is_shown_as_text() {
    let page = html(
        "# A <b>\n\nx <script>alert(1)</script> [<i>](#a) ![<u>](images/robot.svg)\n\n<div onclick=\"x\">\n</div>\n",
    );
    for raw in ["<b>", "<script", "<i>", "<u>", "<div onclick"] {
        assert!(!page.contains(raw), "{page}");
    }
    assert!(
        page.contains("&lt;script&gt;alert(1)&lt;/script&gt;"),
        "{page}"
    );
    let prose = render_prose("a <b> [`Item`] `<PATH>`");
    assert_eq!(
        prose.html,
        "<p>a &lt;b&gt; <code>Item</code> <code>&lt;PATH&gt;</code></p>\n"
    );
    assert_eq!(prose.plain, "a <b> Item <PATH>");
}

#[test]
fn links_point_to_pages_or_name_a_file() {
    for (markdown, link) in [
        (
            "[rules.md](rules.md)",
            r#"<a href="/docs/rules">The rules</a>"#,
        ),
        (
            "[teams](rules.md#teams-that-leave)",
            r#"<a href="/docs/rules#teams-that-leave">teams</a>"#,
        ),
        ("[here](#there)", r##"<a href="#there">here</a>"##),
        (
            "[Rust](https://rustup.rs)",
            r#"<a href="https://rustup.rs">Rust</a>"#,
        ),
        (
            "[agents/examples](../agents/examples/README.md)",
            "<code>agents/examples/README.md</code>",
        ),
        (
            "[the *list*](../docker/list.txt)",
            "the <em>list</em> (<code>docker/list.txt</code>)",
        ),
        ("[x](javascript:alert)", "x (<code>javascript:alert</code>)"),
    ] {
        assert_eq!(html(markdown), format!("<p>{link}</p>\n"), "{markdown}");
    }
}

#[test]
fn heading_ids_follow_github_rules() {
    for (heading, id) in [
        ("The day: cutoff and release", "the-day-cutoff-and-release"),
        ("Which `files`?", "which-files"),
        ("Time – measured, fairly", "time--measured-fairly"),
        ("Über snake_case", "über-snake_case"),
    ] {
        let markdown = format!("## {heading}\n\n## {heading}\n");
        let rendered = render_document(&markdown, "/docs/page", "Page", "Summary.", &RulesAndRobot);
        let ids: Vec<&str> = rendered
            .contents
            .iter()
            .map(|entry| entry.id.as_str())
            .collect();
        assert_eq!(ids, [id, &format!("{id}-1")]);
    }
}

#[test]
fn tables_are_scrollable_and_align_by_class() {
    let page = html("## Masses\n\n| body | kg |\n|---|--:|\n| puck | 0.01 |\n");
    assert!(
        page.contains(
            r#"<div class="wide" role="region" aria-label="Table 1: Masses" tabindex="0">"#
        )
    );
    assert!(
        page.contains(r#"<th scope="col" class="number">kg</th>"#),
        "{page}"
    );
    assert!(page.contains(r#"<td class="number">0.01</td>"#), "{page}");
    assert!(!page.contains("style="));
}

#[test]
fn listing_has_a_name_and_coloured_code() {
    let page = html("## Start\n\n```console\n$ ls <a>\n```\n\n```toml\na = 1 # b\n```\n");
    for part in [
        r#"<pre tabindex="0" role="group" aria-label="Commands 1: Start"><code><span class="prompt">$ </span>"#,
        "<span class=\"command\">ls &#60;a&#62;</span>\n</code></pre></div>",
        r#"aria-label="Listing 2: Start"><code><span class="code-key">a</span> = "#,
    ] {
        assert!(page.contains(part), "{part}: {page}");
    }
}

#[test]
fn sections_have_the_text_below_their_headings() {
    let rendered = render_document(
        "# Page\n\nIntro\nhere.\n\n## One\n\nA **b**c.\n\n- d\n- e\n\n### Two\n\n```\ncode\n```\n\n| x | y |\n|---|---|\n| [rules.md](rules.md) | 2 |\n",
        "/docs/page",
        "Page",
        "Summary.",
        &RulesAndRobot,
    );
    let summaries: Vec<&str> = rendered
        .sections
        .iter()
        .map(|section| &*section.summary)
        .collect();
    assert_eq!(summaries, ["Summary.", "", ""]);
    let sections: Vec<(&str, &str, &str)> = rendered
        .sections
        .iter()
        .map(|section| (&*section.heading, &*section.href, &*section.text))
        .collect();
    assert_eq!(
        sections,
        [
            ("Page", "/docs/page", "Intro here."),
            ("One", "/docs/page#one", "A bc. d e"),
            ("Two", "/docs/page#two", "code x y The rules 2"),
        ]
    );
}
