//! `.sqlx/` says what the compiler believes about the queries; the migrations say what is true.

use crate::fixture::*;
use sqlx::{Connection, Executor, SqlSafeStr, SqliteConnection};
use std::path::Path;

#[tokio::test]
async fn the_committed_query_data_fits_the_migrations() {
    let f = Fixture::new().await;
    let url = format!(
        "sqlite://{}",
        f.folder.path().join("faceoff.sqlite3").display()
    );
    let mut connection = SqliteConnection::connect(&url).await.unwrap();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.sqlx");
    let mut checked = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let data: serde_json::Value = serde_json::from_str(&text).unwrap();
        let sql = data["query"].as_str().unwrap().to_owned();
        let sql = sqlx::AssertSqlSafe(sql).into_sql_str();
        let described = (&mut connection).describe(sql).await.unwrap();
        let described = serde_json::to_value(described).unwrap();
        assert_eq!(
            described,
            data["describe"],
            "{} is out of date: run crates/faceoff-store/prepare.sh",
            path.display()
        );
        checked += 1;
    }
    assert!(checked > 30, "only {checked} queries found");
}
