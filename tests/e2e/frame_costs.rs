//! CPU time of the replay's script per frame: `make frames`.

use crate::{
    compared_replays::{ONE_TABLE_BOX, compared_evaluations, show_both_at, wait_for_both},
    replay::{released_evaluation, show_sample},
};
use faceoff_tests::browser::{Browser, Page};

/// CPU time of scripts that 19 of 20 frames may take, in milliseconds per frame.
const MAX_FRAME_MS: f64 = 4.0;

/// Shows all samples twice, measures the second time, and checks the limit. `show` shows a sample.
#[expect(clippy::print_stdout, reason = "it prints its measurements")]
fn measure(page: &Page, name: &str, show: impl Fn(&Page, usize)) {
    let samples = page.evaluate("document.querySelector('input[type=range]').max");
    let samples = samples.as_str().and_then(|text| text.parse().ok());
    let samples: usize = samples.expect("the slider has an end");
    // The first pass creates cached objects and is not measured.
    let mut frame_times_ms = Vec::new();
    for pass in 0..2 {
        for sample in (0..samples).rev() {
            let before = page.script_cpu_s();
            show(page, sample);
            if pass > 0 {
                frame_times_ms.push(1e3 * (page.script_cpu_s() - before));
            }
        }
    }
    frame_times_ms.sort_by(f64::total_cmp);
    let percentile = |percent: usize| frame_times_ms[(frame_times_ms.len() - 1) * percent / 100];
    println!(
        "script per frame, {name}, ms of CPU: median {:.2}, 95th percentile {:.2}, of {} frames",
        percentile(50),
        percentile(95),
        frame_times_ms.len()
    );
    assert!(percentile(95) <= MAX_FRAME_MS, "{name}: {frame_times_ms:?}");
}

#[test]
#[ignore = "its verdict depends on the speed of the machine; `make frames` runs it"]
fn frames_need_little_script_time() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{evaluation}/episodes/defend/0", server.url));
    page.wait_for("#replay[data-state=ready]");
    measure(&page, "one replay", show_sample);
}

#[test]
#[ignore = "its verdict depends on the speed of the machine; `make frames` runs it"]
fn frames_of_two_replays_need_little_script_time() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, comparison) = compared_evaluations(scratch.path(), ["hold", "reckless"]);
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{comparison}/defend/0", server.url));
    wait_for_both(&page);
    measure(&page, "two tables", show_both_at);
    let _ = page.evaluate(&format!("{ONE_TABLE_BOX}.click()"));
    page.wait_for(".one-table");
    measure(&page, "both on one table", show_both_at);
}
