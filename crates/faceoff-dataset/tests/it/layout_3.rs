//! Tests that datasets in layout 3 (written by commit d418cdf) are read and verified. They do not record host interference.

use crate::{
    recordings::{fixture, table},
    verify::check,
};
use faceoff_airhockey::{HIT, simulator};
use faceoff_dataset::{Dataset, Layout};

const ARCHIVE: &str = "dataset-layout-3.zip";

#[test]
fn archive_is_read_and_verified() {
    let dataset = Dataset::open(&fixture(ARCHIVE), simulator().competition()).unwrap();
    assert_eq!(dataset.layout(), Layout::Three);
    let verified = check(&fixture(ARCHIVE), 2).unwrap();
    assert_eq!(verified.episodes, 4);
    assert_eq!(verified.result, dataset.results().unwrap());
    let steps = dataset.episode(HIT, 0, None).unwrap();
    assert!(steps.column_by_name("host_time_ns").is_none());
    // Read in order, the table has the current columns.
    let mut all = dataset.steps().unwrap().read(None).unwrap();
    let first = all.next_batch().unwrap().unwrap();
    let names: Vec<String> = first
        .schema()
        .fields()
        .iter()
        .map(|field| field.name().clone())
        .collect();
    let current =
        crate::recordings::Evaluation::play(Some(crate::recordings::hold_still), &[(HIT, 0..1)])
            .assembled();
    let current = table(&current.folder().join("steps.parquet"));
    let current_names: Vec<String> = current
        .schema()
        .fields()
        .iter()
        .map(|field| field.name().clone())
        .collect();
    assert_eq!(names, current_names);
}
