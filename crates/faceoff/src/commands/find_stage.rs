use crate::client::Client;
use anyhow::bail;
use faceoff_api::views::stage::StageView;
use faceoff_types::StageId;

/// The stage of this name or id.
pub(super) async fn find_stage(client: &Client, wanted: &str) -> anyhow::Result<StageView> {
    let stages = client.stages().await?;
    let id: Option<StageId> = wanted.parse().ok();
    let named = |stage: &StageView| stage.name.as_str().eq_ignore_ascii_case(wanted);
    let mut names = Vec::new();
    for stage in stages {
        if Some(stage.id) == id || named(&stage) {
            return Ok(stage);
        }
        names.push(stage.name.to_string());
    }
    bail!(
        "no stage is named {wanted:?}; there are: {}",
        names.join(", ")
    )
}
