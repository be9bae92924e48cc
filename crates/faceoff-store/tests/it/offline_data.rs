//! `.sqlx/` says what the compiler believes about the queries; the migrations say what is true.

use crate::fixture::*;
use sqlx::{Executor, SqlSafeStr};

#[tokio::test]
async fn the_committed_query_data_fits_the_migrations() {
    let f = Fixture::new().await;
    let mut connection = f.connection().await;
    let queries = query_data();
    assert!(queries.len() > 30, "only {} queries found", queries.len());
    for (path, data) in queries {
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
    }
}
