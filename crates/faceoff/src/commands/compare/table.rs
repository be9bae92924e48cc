//! Tables of `faceoff compare`: the paired results of two evaluations A and B, and the episodes that each solved.

use faceoff_scoring::{Comparison, SolvedEpisodes};
use faceoff_types::TaskMap;
use std::fmt::Write as _;

/// The comparison as text.
pub(super) fn comparison_table(comparison: &Comparison) -> String {
    let mut out = String::new();
    write_table(&mut out, comparison).expect("writing to memory cannot fail");
    out
}

fn write_table(out: &mut String, comparison: &Comparison) -> std::fmt::Result {
    writeln!(
        out,
        "\n{:<8} {:>6} {:>6} {:>6} {:>7} {:>8} {:>8} {:>8} {:>18} {:>9}  verdict",
        "task", "both", "only A", "only B", "neither", "A", "B", "A - B", "95 % interval", "p"
    )?;
    for (task, paired) in &comparison.tasks {
        let [low, high] = paired.difference_ci95.map(|bound| 100.0 * bound);
        writeln!(
            out,
            "{task:<8} {:>6} {:>6} {:>6} {:>7} {:>6.1} % {:>6.1} % {:>+8.1} {:>18} {:>9}  {}",
            paired.both,
            paired.only_a,
            paired.only_b,
            paired.neither,
            100.0 * paired.success_rate_a,
            100.0 * paired.success_rate_b,
            100.0 * paired.difference,
            format!("{low:+.1} to {high:+.1}"),
            p_value(paired.p_value),
            verdict(paired.significant, paired.difference),
        )?;
    }
    let overall = &comparison.overall;
    let [low, high] = overall.difference_ci95;
    writeln!(
        out,
        "{:<8} {:>28} {:>6.1} % {:>6.1} % {:>+8.1} {:>18} {:>9}  {}",
        "score",
        "",
        overall.score_a,
        overall.score_b,
        overall.difference,
        format!("{low:+.1} to {high:+.1}"),
        p_value(overall.p_value),
        verdict(overall.significant, overall.difference),
    )?;
    writeln!(
        out,
        "\np: McNemar's exact test (score: its weighted form); interval: Newcombe's for paired \
         rates, in percentage points"
    )
}

/// The episodes that only A, only B, both or neither solved.
pub(super) fn episode_lists(episodes: &TaskMap<SolvedEpisodes>) -> String {
    let mut out = String::new();
    for (task, solved) in episodes {
        for (label, list) in [
            ("only A", &solved.only_a),
            ("only B", &solved.only_b),
            ("both", &solved.both),
            ("neither", &solved.neither),
        ] {
            let list = ranges(list);
            writeln!(out, "{task:<8} {label:<8} {list}").expect("writing to memory cannot fail");
        }
    }
    format!("\nepisodes\n{out}")
}

/// Numbers as ranges, e.g. `1-3 5 7-8`, or a dash.
fn ranges(numbers: &[u32]) -> String {
    if numbers.is_empty() {
        return "–".to_owned();
    }
    let runs = numbers.chunk_by(|number, next| number + 1 == *next);
    let run_text = |run: &[u32]| match run {
        [first, .., last] => format!("{first}-{last}"),
        [only] => only.to_string(),
        [] => String::new(),
    };
    runs.map(run_text).collect::<Vec<_>>().join(" ")
}

fn p_value(p: f64) -> String {
    if p < 1e-4 {
        format!("{p:.1e}")
    } else {
        format!("{p:.4}")
    }
}

fn verdict(is_significant: bool, difference: f64) -> &'static str {
    match (is_significant, difference > 0.0) {
        (false, _) => "statistically tied",
        (true, true) => "A is ahead",
        (true, false) => "B is ahead",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_episodes_are_a_range() {
        assert_eq!(ranges(&[]), "–");
        assert_eq!(ranges(&[4]), "4");
        assert_eq!(ranges(&[0, 1, 2, 5, 7, 8]), "0-2 5 7-8");
    }
}
