//! Queries of the disk usage of teams.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    store::Store,
};
use faceoff_types::{TeamId, TeamName};

/// Disk usage of a team's files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TeamStorage {
    pub team: TeamId,
    pub name: TeamName,
    /// Number of stored bundles; they count towards the quota.
    pub bundles: u32,
    pub bundle_bytes: u64,
    /// Number of stored datasets of evaluations of days, also of voided ones.
    pub datasets: u32,
    /// Total size of the measured datasets.
    pub dataset_bytes: u64,
    /// Number of stored datasets that have not been measured yet.
    pub unmeasured: u32,
    /// Size of the datasets of trials and proposals with the team's submissions.
    pub proposal_bytes: u64,
}

/// Which datasets a team's disk usage includes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StorageScope {
    All,
    /// Datasets that the team can download: of released days, and of no blind stage. The size of others would reveal
    /// something about their episodes.
    VisibleToTeam,
}

/// A row of the statement. Bundles were called archives when its columns were named.
struct StorageRow {
    team: TeamId,
    name: TeamName,
    archives: u32,
    archive_bytes: i64,
    datasets: u32,
    dataset_bytes: i64,
    unmeasured: u32,
    proposal_bytes: i64,
}

impl TryFrom<StorageRow> for TeamStorage {
    type Error = StoreError;
    fn try_from(row: StorageRow) -> Result<Self> {
        let bytes = |sum: i64| {
            u64::try_from(sum).map_err(|_| StoreError::Damaged(format!("files of {sum} bytes")))
        };
        Ok(Self {
            team: row.team,
            name: row.name,
            bundles: row.archives,
            bundle_bytes: bytes(row.archive_bytes)?,
            datasets: row.datasets,
            dataset_bytes: bytes(row.dataset_bytes)?,
            unmeasured: row.unmeasured,
            proposal_bytes: bytes(row.proposal_bytes)?,
        })
    }
}

impl Store {
    /// Disk usage of a team's files, or of all teams by name. It is read from the database, not from the files.
    #[boxed_future]
    pub async fn storage(
        &self,
        team: Option<TeamId>,
        scope: StorageScope,
    ) -> Result<Vec<TeamStorage>> {
        let all = scope == StorageScope::All;
        let rows = sqlx::query_as!(
            StorageRow,
            r#"SELECT t.id AS team, t.name,
                      (SELECT COUNT(*) FROM submissions s WHERE s.team_id = t.id AND s.bundle_removed_at IS NULL)
                      AS "archives!: u32",
                      (SELECT COALESCE(SUM(s.bundle_bytes), 0) FROM submissions s
                       WHERE s.team_id = t.id AND s.bundle_removed_at IS NULL) AS "archive_bytes!: i64",
                      COUNT(e.id) AS "datasets!: u32", COALESCE(SUM(e.dataset_bytes), 0) AS "dataset_bytes!: i64",
                      COUNT(e.id) - COUNT(e.dataset_bytes) AS "unmeasured!: u32",
                      (SELECT COALESCE(SUM(p.dataset_bytes), 0) FROM evaluations p
                       WHERE p.team_id = t.id AND p.purpose <> 'counting' AND p.state = 'finished'
                         AND p.dataset_removed_at IS NULL) AS "proposal_bytes!: i64"
               FROM teams t
               LEFT JOIN counting_evaluations e
                   ON e.team_id = t.id AND e.state = 'finished' AND e.dataset_removed_at IS NULL
                  AND (?2 OR EXISTS (SELECT 1 FROM days d JOIN stages g ON g.id = d.stage_id
                                     WHERE d.stage_id = e.stage_id AND d.day = e.day AND d.released_at IS NOT NULL
                                       AND json_extract(g.settings, '$.blind') IS NOT 1))
               WHERE ?1 IS NULL OR t.id = ?1
               GROUP BY t.id ORDER BY t.name"#,
            team,
            all,
        )
        .fetch_all(&mut *self.database.read.acquire().await?)
        .await?;
        rows.into_iter().map(TeamStorage::try_from).collect()
    }
}
