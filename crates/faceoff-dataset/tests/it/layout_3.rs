//! What commit d418cdf left: its archives do not tell what the host took, and verify all the same.

use crate::{
    played::{fixture, table},
    verify::check,
};
use faceoff_dataset::{Dataset, Layout};
use faceoff_types::Task;

const ARCHIVE: &str = "dataset-layout-3.zip";

#[test]
fn an_archive_is_read_and_verified() {
    let dataset = Dataset::open(&fixture(ARCHIVE)).unwrap();
    assert_eq!(dataset.layout(), Layout::Three);
    let verified = check(&fixture(ARCHIVE), 2).unwrap();
    assert_eq!(verified.episodes, 4);
    assert_eq!(verified.result, dataset.results().unwrap());
    let steps = dataset.episode(Task::Hit, 0, None).unwrap();
    assert!(steps.column_by_name("host_time_ns").is_none());
    // Read from the first on, it is a table like today's.
    let mut all = dataset.steps().unwrap().read(None).unwrap();
    let first = all.next_batch().unwrap().unwrap();
    let names: Vec<String> = first
        .schema()
        .fields()
        .iter()
        .map(|field| field.name().clone())
        .collect();
    let ours = crate::played::Evaluation::play(Some(crate::played::holding), &[(Task::Hit, 0..1)])
        .assembled();
    let ours = table(&ours.folder().join("steps.parquet"));
    let todays: Vec<String> = ours
        .schema()
        .fields()
        .iter()
        .map(|field| field.name().clone())
        .collect();
    assert_eq!(names, todays);
}
