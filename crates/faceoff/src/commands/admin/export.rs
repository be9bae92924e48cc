//! `faceoff admin export`: downloads the season's archive, one file with all its data, which `faceoff import` reads.

use crate::{
    client::Client,
    commands::output::{exact_time_text, print},
};
use faceoff_archive::Edition;
use serde_json::json;
use std::path::Path;

/// Downloads the season's archive and prints its summary.
pub(super) async fn export(
    client: &Client,
    as_json: bool,
    file: &Path,
    public: bool,
) -> anyhow::Result<()> {
    let edition = match public {
        true => Edition::Public,
        false => Edition::Organiser,
    };
    let (manifest, bytes) = client.download_season_archive(edition, file).await?;
    let summary = json!({
        "file": file,
        "bytes": bytes,
        "season": manifest.season,
        "edition": edition,
        "made_at": manifest.made_at,
        "files": manifest.files.len(),
        "unpacked_bytes": manifest.total_bytes(),
        "left_out": manifest.left_out,
    });
    print(as_json, &summary, |_| {
        let mut lines = vec![format!(
            "{}: {bytes} bytes, the {edition} archive of {:?} of {}; {} files of {} bytes",
            file.display(),
            manifest.season,
            exact_time_text(manifest.made_at),
            manifest.files.len(),
            manifest.total_bytes(),
        )];
        lines.extend(
            manifest
                .left_out
                .iter()
                .map(|part| format!("left out: {part}")),
        );
        lines.join("\n")
    })
}
