//! Tests of reading one episode of a dataset without the others.

use crate::recordings::{Evaluation, hold_still, table};
use arrow_array::{UInt32Array, cast::AsArray};
use faceoff_airhockey::{DEFEND, HIT, PREPARE, simulator};
use faceoff_dataset::{Dataset, DatasetError};

#[test]
fn episode_equals_its_rows_in_the_whole_table() {
    let shards = [(HIT, 0..1), (DEFEND, 0..3), (DEFEND, 3..5)];
    let evaluation = Evaluation::play(Some(hold_still), &shards).assembled();
    let whole = table(&evaluation.folder().join("steps.parquet"));
    for path in [evaluation.archive(), evaluation.folder()] {
        let dataset = Dataset::open_lazily(&path, simulator().competition()).unwrap();
        let mut row = 0;
        for report in &evaluation.reports {
            for outcome in &report.outcomes {
                let rows = dataset
                    .episode(outcome.task, outcome.episode, None)
                    .unwrap();
                let steps = outcome.steps as usize;
                assert_eq!(rows, whole.slice(row, steps));
                row += steps;
            }
        }
        assert_eq!(row, whole.num_rows());

        let columns = ["step".to_owned(), "puck_x".to_owned()];
        let rows = dataset.episode(DEFEND, 4, Some(&columns)).unwrap();
        assert_eq!(rows.num_columns(), 2);
        let steps: &UInt32Array = rows["step"].as_primitive();
        assert!(steps.values().iter().copied().eq(0..rows.num_rows() as u32));

        let absent = |task, episode, columns: Option<&[String]>| match dataset
            .episode(task, episode, columns)
        {
            Err(DatasetError::Absent(message)) => message,
            other => panic!("{other:?}"),
        };
        assert!(absent(PREPARE, 0, None).contains("no episode of prepare"));
        assert!(absent(DEFEND, 5, None).contains("there are 5, from 0"));
        let unknown_column = absent(HIT, 0, Some(&["speed".to_owned()]));
        assert!(
            unknown_column.starts_with("there is no column \"speed\""),
            "{unknown_column}"
        );
    }
}

#[test]
fn episode_without_steps_has_columns_but_no_rows() {
    let evaluation = Evaluation::play(None, &[(HIT, 0..2)]).assembled();
    let dataset = Dataset::open(&evaluation.archive(), simulator().competition()).unwrap();
    let rows = dataset.episode(HIT, 1, None).unwrap();
    assert_eq!(rows.num_rows(), 0);
    assert!(rows.num_columns() > 60);
}
