//! Lookup of a stage that a command names.

use crate::client::Client;
use anyhow::bail;
use faceoff_api::views::stage::StageView;
use faceoff_types::StageId;

/// Finds a stage by name or id.
pub(super) async fn find_stage(client: &Client, name_or_id: &str) -> anyhow::Result<StageView> {
    let stages = client.stages().await?;
    let id: Option<StageId> = name_or_id.parse().ok();
    let has_name = |stage: &StageView| stage.name.as_str().eq_ignore_ascii_case(name_or_id);
    let mut names = Vec::new();
    for stage in stages {
        if Some(stage.id) == id || has_name(&stage) {
            return Ok(stage);
        }
        names.push(stage.name.to_string());
    }
    bail!(
        "there is no stage {name_or_id:?}; the stages are: {}",
        names.join(", ")
    )
}
