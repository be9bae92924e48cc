//! The query data in `.sqlx/`, which the compiler uses, must match the schema of the migrations.

use crate::fixture::*;
use sqlx::{Executor, SqlSafeStr};

#[tokio::test]
async fn query_data_matches_the_migrations() {
    let f = TestStore::new().await;
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
