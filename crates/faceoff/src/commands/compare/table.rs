use faceoff_scoring::{Comparison, WhoSolved};
use faceoff_types::Task;
use std::{collections::BTreeMap, fmt::Write as _};

/// The comparison as a table for a terminal.
pub(super) fn of(comparison: &Comparison) -> String {
    let mut out = String::new();
    write(&mut out, comparison).expect("writing to memory cannot fail");
    out
}

fn write(out: &mut String, comparison: &Comparison) -> std::fmt::Result {
    writeln!(
        out,
        "\n{:<8} {:>6} {:>6} {:>6} {:>7} {:>8} {:>8} {:>8} {:>18} {:>9}  verdict",
        "task", "both", "only A", "only B", "neither", "A", "B", "A - B", "95 % interval", "p"
    )?;
    for (task, of) in &comparison.tasks {
        let [low, high] = of.difference_ci95.map(|bound| 100.0 * bound);
        writeln!(
            out,
            "{task:<8} {:>6} {:>6} {:>6} {:>7} {:>6.1} % {:>6.1} % {:>+8.1} {:>18} {:>9}  {}",
            of.both,
            of.only_a,
            of.only_b,
            of.neither,
            100.0 * of.success_rate_a,
            100.0 * of.success_rate_b,
            100.0 * of.difference,
            format!("{low:+.1} to {high:+.1}"),
            p_value(of.p_value),
            verdict(of.told_apart, of.difference),
        )?;
    }
    let of = &comparison.overall;
    let [low, high] = of.difference_ci95;
    writeln!(
        out,
        "{:<8} {:>28} {:>6.1} % {:>6.1} % {:>+8.1} {:>18} {:>9}  {}",
        "score",
        "",
        of.score_a,
        of.score_b,
        of.difference,
        format!("{low:+.1} to {high:+.1}"),
        p_value(of.p_value),
        verdict(of.told_apart, of.difference),
    )?;
    writeln!(
        out,
        "\np: McNemar's exact test (score: its weighted form); interval: Newcombe's for paired \
         rates, in percentage points"
    )
}

/// The episodes by who solved them.
pub(super) fn by_whom(episodes: &BTreeMap<Task, WhoSolved>) -> String {
    let mut out = String::new();
    for (task, of) in episodes {
        for (whom, list) in [
            ("only A", &of.only_a),
            ("only B", &of.only_b),
            ("both", &of.both),
            ("neither", &of.neither),
        ] {
            let list = ranges(list);
            writeln!(out, "{task:<8} {whom:<8} {list}").expect("writing to memory cannot fail");
        }
    }
    format!("\nepisodes\n{out}")
}

/// 1-3 5 7-8, or a dash.
fn ranges(numbers: &[u32]) -> String {
    if numbers.is_empty() {
        return "–".to_owned();
    }
    let runs = numbers.chunk_by(|one, next| one + 1 == *next);
    let run = |run: &[u32]| match run {
        [first, .., last] => format!("{first}-{last}"),
        [only] => only.to_string(),
        [] => String::new(),
    };
    runs.map(run).collect::<Vec<_>>().join(" ")
}

fn p_value(p: f64) -> String {
    if p < 1e-4 {
        format!("{p:.1e}")
    } else {
        format!("{p:.4}")
    }
}

fn verdict(told_apart: bool, difference: f64) -> &'static str {
    match (told_apart, difference > 0.0) {
        (false, _) => "not told apart",
        (true, true) => "A is ahead",
        (true, false) => "B is ahead",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn episodes_that_follow_each_other_are_a_range() {
        assert_eq!(ranges(&[]), "–");
        assert_eq!(ranges(&[4]), "4");
        assert_eq!(ranges(&[0, 1, 2, 5, 7, 8]), "0-2 5 7-8");
    }
}
