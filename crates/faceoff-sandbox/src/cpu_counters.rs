//! Parsers of the kernel's counters of CPU time: files of cgroups and `/proc/stat`.

use std::{fs::File, os::unix::fs::FileExt, time::Duration};

/// Unit of the counters in `/proc/stat`: 1 / `USER_HZ`, the same on every architecture that the seccomp filter supports.
const TICK: Duration = Duration::from_millis(10);

/// Counters of one CPU since the host's start, in ticks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Ticks {
    /// User mode, user mode with a nice value, kernel mode; without interrupts.
    pub busy: [u64; 3],
    /// Idle, and idle while waiting for I/O.
    pub idle: [u64; 2],
    /// Steal time: the hypervisor ran something else.
    pub stolen: u64,
}

pub(crate) fn ticks_to_duration(count: u64) -> Duration {
    TICK * u32::try_from(count).unwrap_or(u32::MAX)
}

/// Content of a counter file; such files are short.
pub(crate) fn read_text(file: &File) -> Option<String> {
    let mut bytes = vec![0; 16 << 10];
    let count = file.read_at(&mut bytes, 0).ok()?;
    bytes.truncate(count);
    String::from_utf8(bytes).ok()
}

/// Sum over `cpus` in `cpuacct.usage_percpu`.
pub(crate) fn sum_of_cpus(text: &str, cpus: &[usize]) -> Option<Duration> {
    let each: Vec<&str> = text.split_ascii_whitespace().collect();
    let sum = cpus
        .iter()
        .map(|cpu| each.get(*cpu)?.parse::<u64>().ok())
        .sum::<Option<u64>>()?;
    Some(Duration::from_nanos(sum))
}

/// The counters of `cpus` in `/proc/stat`.
pub(crate) fn parse_ticks(stat: &str, cpus: &[usize]) -> Option<Vec<Ticks>> {
    let ticks_of = |cpu: &usize| {
        let name = format!("cpu{cpu} ");
        let line = stat.lines().find_map(|line| line.strip_prefix(&name))?;
        let numbers: Vec<u64> = line
            .split_ascii_whitespace()
            .map_while(|number| number.parse().ok())
            .collect();
        let [user, nice, system, idle, waiting, _hard, _soft, stolen, ..] = numbers[..] else {
            return None;
        };
        Some(Ticks {
            busy: [user, nice, system],
            idle: [idle, waiting],
            stolen,
        })
    };
    cpus.iter().map(ticks_of).collect()
}

/// Throttled time in `cpu.stat` of either cgroup version.
pub(crate) fn parse_throttled(stat: &str) -> Option<Duration> {
    number_of_key(stat, "throttled_usec")
        .map(Duration::from_micros)
        .or_else(|| number_of_key(stat, "throttled_time").map(Duration::from_nanos))
}

/// Run time of a whole cgroup in `cpu.stat` of cgroup version 2.
pub(crate) fn parse_usage(stat: &str) -> Option<Duration> {
    number_of_key(stat, "usage_usec").map(Duration::from_micros)
}

/// The number after `key` at the start of a line.
fn number_of_key(text: &str, key: &str) -> Option<u64> {
    text.lines()
        .find_map(|line| line.strip_prefix(key)?.trim().parse().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_are_parsed_from_kernel_files() {
        let stat =
            "cpu  9 9 9 9 9 9 9 9 0 0\ncpu1 1 2 3 4 5 6 7 8 0 0\ncpu10 0 0 0 0 0 0 0 0\nintr 5\n";
        let found = Ticks {
            busy: [1, 2, 3],
            idle: [4, 5],
            stolen: 8,
        };
        assert_eq!(
            parse_ticks(stat, &[1, 10]),
            Some(vec![found, Ticks::default()])
        );
        assert_eq!(parse_ticks(stat, &[0]), None);
        assert_eq!(
            sum_of_cpus("10 20 30 \n", &[0, 2]),
            Some(Duration::from_nanos(40))
        );
        assert_eq!(sum_of_cpus("10\n", &[1]), None);
        let v1 = "nr_periods 4\nnr_throttled 2\nthrottled_time 1500\n";
        assert_eq!(parse_throttled(v1), Some(Duration::from_nanos(1500)));
        let v2 = "usage_usec 70\nnr_throttled 1\nthrottled_usec 3\n";
        assert_eq!(parse_throttled(v2), Some(Duration::from_micros(3)));
        assert_eq!(parse_usage(v2), Some(Duration::from_micros(70)));
    }
}
