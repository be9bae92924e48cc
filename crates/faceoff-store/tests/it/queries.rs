//! Queries: none may scan (read completely) a table that grows with the season, and those of days, teams and boards read the
//! evaluations that count.

use crate::fixture::*;
use sqlx::{Row, SqlSafeStr};

/// Tables that grow with teams × days, or with what teams and visitors do.
const LARGE_TABLES: [&str; 11] = [
    "evaluations",
    "runs",
    "shards",
    "jobs",
    "contestants",
    "events",
    "episode_summaries",
    "webhook_deliveries",
    "tokens",
    "invitations",
    "submissions",
];

/// Partial indexes, which contain few rows of a large table: a scan of such an index reads only these rows.
const SMALL_INDEXES: [&str; 13] = [
    "jobs_open",
    "evaluations_open",
    "evaluations_of_proposal",
    "runs_with_recordings",
    "datasets_going",
    "datasets_unmeasured",
    "runs_to_clear",
    "webhook_deliveries_due",
    "bundles_going",
    "bundles_stored",
    "refused_bundles",
    "tokens_of_host",
    "tokens_not_revoked",
];

/// Queries that may read a whole index or table, identified by a fragment, each with its reason.
const MAY_SCAN: [(&str, &str); 6] = [
    (
        "/* import */",
        "a separate command, which makes a new data folder",
    ),
    (
        "/* archive */",
        "an organiser's request, for a copy of the season",
    ),
    ("/* backup */", "a separate command, which copies all rows"),
    (
        "substr(worker, 1",
        "the query runs once, at a worker's start",
    ),
    (
        "kind NOT IN ('shard_committed'",
        "the query reads one row: the last one of the index",
    ),
    (
        "FROM events ORDER BY id DESC LIMIT 1",
        "the query reads one row: the last one of the table",
    ),
];

#[tokio::test]
async fn queries_do_not_scan_growing_tables() {
    let f = TestStore::new().await;
    let mut connection = f.connection().await;
    let mut board_queries = 0;
    let mut scans = Vec::new();
    for (_, data) in query_data() {
        let sql = data["query"].as_str().unwrap().to_owned();
        board_queries += usize::from(sql.contains("/* board */"));
        if MAY_SCAN.iter().any(|(fragment, _)| sql.contains(fragment)) {
            continue;
        }
        let explain = sqlx::AssertSqlSafe(format!("EXPLAIN QUERY PLAN {sql}")).into_sql_str();
        let plan = sqlx::raw_sql(explain)
            .fetch_all(&mut connection)
            .await
            .unwrap();
        for step in plan {
            let step: String = step.get("detail");
            let scanned = step.strip_prefix("SCAN ").map(|rest| {
                let name = rest.split(' ').next().unwrap();
                table_of_alias(&sql, name)
            });
            let is_small = SMALL_INDEXES.iter().any(|index| step.ends_with(index));
            let is_large = |table: String| LARGE_TABLES.contains(&table.as_str());
            if !is_small && scanned.is_some_and(is_large) {
                scans.push(format!("{step} in {sql}"));
            }
        }
    }
    assert!(scans.is_empty(), "{}", scans.join("\n"));
    assert_eq!(board_queries, 1, "the board query is checked, too");
}

/// Queries that may read all evaluations, also those of trials and proposals, which do not count. They are identified by a
/// fragment, each with its reason.
const MAY_READ_ALL_EVALUATIONS: [(&str, &str); 4] = [
    (
        "FROM runs r",
        "recordings and shards go with any evaluation",
    ),
    ("/* backup */", "a backup has all files"),
    ("dataset_bytes IS NULL", "all datasets are measured"),
    (
        "UPDATE evaluations SET extra_for",
        "the query copies from one evaluation, by its id",
    ),
];

#[test]
fn queries_without_exemption_read_counting_evaluations() {
    let mut reads_of_whole_table = 0;
    for (_, data) in query_data() {
        let sql = data["query"].as_str().unwrap();
        let words: Vec<_> = sql.split_whitespace().collect();
        let reads_all = words
            .windows(2)
            .any(|pair| ["FROM", "JOIN"].contains(&pair[0]) && pair[1] == "evaluations");
        let names_purpose = sql.contains("purpose") || sql.contains("proposal_id");
        let is_exempt = MAY_READ_ALL_EVALUATIONS
            .iter()
            .any(|(fragment, _)| sql.contains(fragment));
        assert!(
            !reads_all || names_purpose || is_exempt,
            "this query reads trials, too: {sql}"
        );
        reads_of_whole_table += usize::from(reads_all);
    }
    assert!(
        reads_of_whole_table > 0,
        "the table is found in the queries"
    );
}

/// The table of an alias in a query (`FROM evaluations e`).
fn table_of_alias(sql: &str, name: &str) -> String {
    let words: Vec<_> = sql.split_whitespace().collect();
    words
        .windows(2)
        .find(|pair| pair[1] == name && LARGE_TABLES.contains(&pair[0]))
        .map_or(name, |pair| pair[0])
        .to_owned()
}
