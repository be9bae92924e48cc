//! Tests of the search: ranking, forms of words, typos, synonyms, and the texts of results.

use super::{snippet::SNIPPET_BYTES, *};

fn section(heading: &str, text: &str) -> Section {
    Section {
        kind: SectionKind::Document,
        page: "Page".into(),
        heading: heading.into(),
        summary: String::new(),
        href: format!("/docs/page#{heading}"),
        text: text.into(),
    }
}

/// The first section of a page.
fn start(title: &str, summary: &str, text: &str) -> Section {
    Section {
        page: title.into(),
        summary: summary.into(),
        ..section(title, text)
    }
}

fn text_of(pieces: &[Piece]) -> String {
    pieces.iter().map(|piece| &*piece.text).collect()
}

fn marked(pieces: &[Piece]) -> String {
    let pieces = pieces.iter().map(|piece| match piece.is_match {
        true => format!("[{}]", piece.text),
        false => piece.text.clone(),
    });
    pieces.collect()
}

fn results(found: &SearchResults) -> Vec<&SearchResult> {
    found.kinds.iter().flat_map(|kind| &kind.results).collect()
}

fn headings(index: &Index, query: &str) -> Vec<String> {
    let found = index.search(query);
    let headings = results(&found).into_iter();
    headings.map(|result| text_of(&result.heading)).collect()
}

#[test]
fn ranking_is_title_then_heading_then_text() {
    let index = Index::new([
        section("Once", "the puck"),
        section("Often", "puck, Puck and PUCK"),
        section("The puck", "round"),
        start("Round things", "Table and puck.", "text"),
        start("Pucks", "", "text"),
        section("Other", "text"),
    ]);
    assert_eq!(
        headings(&index, "puck"),
        ["Pucks", "The puck", "Round things", "Often", "Once"]
    );
    assert_eq!(headings(&index, "PUCK round"), ["Round things", "The puck"]);
    assert_eq!(headings(&index, "puck mallet"), [""; 0]);
    assert_eq!(headings(&index, "  …"), [""; 0]);
}

#[test]
fn page_title_alone_is_no_match_of_later_sections() {
    let on_page = |heading: &str, text: &str| Section {
        page: "Backup".into(),
        ..section(heading, text)
    };
    let index = Index::new([
        on_page("Backup", "copies"),
        on_page("Buckets", "S3"),
        on_page("Disks", "local"),
    ]);
    assert_eq!(headings(&index, "backup s3"), ["Buckets"]);
    assert_eq!(headings(&index, "backup"), ["Backup"]);
}

#[test]
fn documents_come_before_operations_and_schemas() {
    let of_kind = |kind, heading: &str| Section {
        kind,
        ..section(heading, "puck")
    };
    let index = Index::new([
        of_kind(SectionKind::Schema, "Puck"),
        of_kind(SectionKind::Operation, "GET puck"),
        of_kind(SectionKind::Document, "Prose"),
    ]);
    let found = index.search("puck");
    let kinds: Vec<(&str, usize)> = found
        .kinds
        .iter()
        .map(|kind| (kind.name, kind.count))
        .collect();
    assert_eq!(
        kinds,
        [("Documents", 1), ("API operations", 1), ("API schemas", 1)]
    );
    assert_eq!(headings(&index, "puck"), ["Prose", "GET puck", "Puck"]);
}

#[test]
fn other_forms_of_a_word_are_found_and_marked() {
    let index = Index::new([section(
        "Days",
        "Evaluated: ≤ 2 evaluations, BoardView2.boards µ",
    )]);
    let found = index.search("evaluating board µ");
    assert_eq!(
        marked(&results(&found)[0].snippet),
        "[Evaluated]: ≤ 2 [evaluations], [Board]View2.[boards] [µ]"
    );
    // A name as a whole, and the beginning of a word.
    assert_eq!(headings(&index, "boardview2"), ["Days"]);
    assert_eq!(headings(&index, "evalu"), ["Days"]);
    assert_eq!(headings(&index, "ev"), [""; 0]);
    assert_eq!(found.correction, None);
}

#[test]
fn typo_is_corrected_only_in_an_unknown_long_word() {
    let index = Index::new([
        section("Mallet", "mallet mallet"),
        section("Mullet", "a mullet fish"),
        section("Ballet", "the ballet"),
    ]);
    for typo in ["mallte", "malet", "mmallet", "xallet"] {
        let found = index.search(&format!("The {typo}?"));
        assert_eq!(text_of(&results(&found)[0].heading), "Mallet", "{typo}");
        let correction = found.correction.unwrap();
        assert_eq!(correction.query, "the mallet");
        assert_eq!(correction.unknown, [typo]);
    }
    // A word that exists is searched as it is; short words have too many neighbours.
    assert_eq!(headings(&index, "mullet"), ["Mullet"]);
    assert_eq!(index.search("mullet").correction, None);
    assert_eq!(index.search("fosh"), SearchResults::default());
    assert_eq!(index.search("quidditch"), SearchResults::default());
}

#[test]
fn synonyms_are_found_after_the_word_itself() {
    let index = Index::new([
        section("Sending", "upload a bundle"),
        section("Own", "submit a bundle"),
        section("The board", "ranks"),
    ]);
    assert_eq!(headings(&index, "How do I submit?"), ["Own", "Sending"]);
    assert_eq!(headings(&index, "leaderboards"), ["The board"]);
    // Where the documentation has the word itself, its synonyms do not reach the headings' rank.
    let index_of_own = Index::new([
        section("Limits", "of memory"),
        section("Days", "the daily quota"),
    ]);
    assert_eq!(headings(&index_of_own, "quotas"), ["Days", "Limits"]);
    let found = index.search("leaderbord");
    assert_eq!(found.correction.unwrap().query, "leaderboard");
    assert_eq!(found.count, 1);
    // Stop words alone are searched.
    assert_eq!(headings(&index, "a"), ["Sending", "Own"]);
}

#[test]
fn snippet_surrounds_first_match_on_char_boundaries() {
    let filler = "äöü … ".repeat(200);
    let index = Index::new([section("Long", &format!("{filler}here {filler}"))]);
    let found = index.search("here");
    let texts: Vec<&str> = results(&found)[0]
        .snippet
        .iter()
        .map(|piece| &*piece.text)
        .collect();
    assert_eq!(texts[0], "…");
    assert_eq!(texts[2], "here");
    assert_eq!(*texts.last().unwrap(), "…");
    assert!(texts.concat().len() < 4 * SNIPPET_BYTES, "{texts:?}");
    // A single long word.
    let word = "ä".repeat(5000);
    let index = Index::new([section("Word", &word)]);
    let found = index.search(&word);
    assert!(text_of(&results(&found)[0].snippet).len() < 4 * SNIPPET_BYTES);
    // A match outside the text shows the summary.
    let index = Index::new([start("Rules", "Fouls and tiers.", "text")]);
    let found = index.search("tiers");
    assert_eq!(marked(&results(&found)[0].snippet), "Fouls and [tiers].");
}

#[test]
fn count_includes_results_that_are_not_shown() {
    let index = Index::new((0..100).map(|_| section("Same", "puck")));
    let found = index.search("puck");
    assert_eq!((found.shown, found.count), (MAX_RESULTS_OF_A_KIND, 100));
    assert_eq!(results(&found).len(), MAX_RESULTS_OF_A_KIND);
}
