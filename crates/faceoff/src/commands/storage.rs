//! Text of a team's disk usage.

use faceoff_api::views::storage::StorageView;

/// A number of bytes with a unit; units are powers of 1000.
pub(super) fn format_bytes(bytes: u64) -> String {
    #[expect(clippy::cast_precision_loss, reason = "only one decimal is shown")]
    let mut shown = bytes as f64;
    for unit in ["bytes", "kB", "MB", "GB"] {
        if shown < 1000.0 {
            return match unit {
                "bytes" => format!("{bytes} bytes"),
                unit => format!("{shown:.1} {unit}"),
            };
        }
        shown /= 1000.0;
    }
    format!("{shown:.1} TB")
}

/// A team's disk usage as one line.
pub(super) fn storage_line(storage: &StorageView) -> String {
    let mut line = format!(
        "{:<40} {} bundles, {} of {}; {} datasets, {}",
        storage.team_name,
        storage.bundles,
        format_bytes(storage.bundle_bytes),
        format_bytes(storage.quota_bytes),
        storage.datasets,
        format_bytes(storage.dataset_bytes)
    );
    if storage.unmeasured_datasets > 0 {
        line.push_str(&format!(
            ", {} of them with unknown size",
            storage.unmeasured_datasets
        ));
    }
    // Datasets of evaluations that do not count: trials, and re-evaluations before an organiser decides about them.
    if let Some(proposed) = storage.proposal_bytes.filter(|bytes| *bytes > 0) {
        line.push_str(&format!(
            "; trials and proposals, {}",
            format_bytes(proposed)
        ));
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_a_decimal_unit() {
        for (count, expected) in [
            (0, "0 bytes"),
            (999, "999 bytes"),
            (1500, "1.5 kB"),
            (2_000_000, "2.0 MB"),
            (34_359_738_368, "34.4 GB"),
            (5_000_000_000_000, "5.0 TB"),
        ] {
            assert_eq!(format_bytes(count), expected);
        }
    }
}
