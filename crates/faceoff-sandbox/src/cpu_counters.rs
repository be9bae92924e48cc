//! The kernel's counters of run time, as its files have them.

use std::{fs::File, os::unix::fs::FileExt, time::Duration};

/// `USER_HZ` of every architecture that the seccomp filter knows.
const TICK: Duration = Duration::from_millis(10);

/// What one CPU did since the host's start, in ticks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Ticks {
    /// In user mode, the same with a nice value, in the kernel; interrupts are not among them.
    pub busy: [u64; 3],
    /// Idle, and idle with a disk at work.
    pub idle: [u64; 2],
    /// Held up by the machine below a virtual one.
    pub stolen: u64,
}

pub(crate) fn ticks(count: u64) -> Duration {
    TICK * u32::try_from(count).unwrap_or(u32::MAX)
}

/// A counter file's content; they are short.
pub(crate) fn text(file: &File) -> Option<String> {
    let mut bytes = vec![0; 16 << 10];
    let count = file.read_at(&mut bytes, 0).ok()?;
    bytes.truncate(count);
    String::from_utf8(bytes).ok()
}

/// The sum of some CPUs of `cpuacct.usage_percpu`.
pub(crate) fn of_cpus(text: &str, cpus: &[usize]) -> Option<Duration> {
    let each: Vec<&str> = text.split_ascii_whitespace().collect();
    let sum = cpus
        .iter()
        .map(|cpu| each.get(*cpu)?.parse::<u64>().ok())
        .sum::<Option<u64>>()?;
    Some(Duration::from_nanos(sum))
}

/// The lines of some CPUs of `/proc/stat`.
pub(crate) fn ticks_of(stat: &str, cpus: &[usize]) -> Option<Vec<Ticks>> {
    let one = |cpu: &usize| {
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
    cpus.iter().map(one).collect()
}

/// `cpu.stat` of either version.
pub(crate) fn throttled(stat: &str) -> Option<Duration> {
    keyed(stat, "throttled_usec")
        .map(Duration::from_micros)
        .or_else(|| keyed(stat, "throttled_time").map(Duration::from_nanos))
}

/// Run time of a whole cgroup, by `cpu.stat` of version 2.
pub(crate) fn usage(stat: &str) -> Option<Duration> {
    keyed(stat, "usage_usec").map(Duration::from_micros)
}

fn keyed(text: &str, key: &str) -> Option<u64> {
    text.lines()
        .find_map(|line| line.strip_prefix(key)?.trim().parse().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_are_found_in_the_kernels_files() {
        let stat =
            "cpu  9 9 9 9 9 9 9 9 0 0\ncpu1 1 2 3 4 5 6 7 8 0 0\ncpu10 0 0 0 0 0 0 0 0\nintr 5\n";
        let found = Ticks {
            busy: [1, 2, 3],
            idle: [4, 5],
            stolen: 8,
        };
        assert_eq!(
            ticks_of(stat, &[1, 10]),
            Some(vec![found, Ticks::default()])
        );
        assert_eq!(ticks_of(stat, &[0]), None);
        assert_eq!(
            of_cpus("10 20 30 \n", &[0, 2]),
            Some(Duration::from_nanos(40))
        );
        assert_eq!(of_cpus("10\n", &[1]), None);
        let v1 = "nr_periods 4\nnr_throttled 2\nthrottled_time 1500\n";
        assert_eq!(throttled(v1), Some(Duration::from_nanos(1500)));
        let v2 = "usage_usec 70\nnr_throttled 1\nthrottled_usec 3\n";
        assert_eq!(throttled(v2), Some(Duration::from_micros(3)));
        assert_eq!(usage(v2), Some(Duration::from_micros(70)));
    }
}
