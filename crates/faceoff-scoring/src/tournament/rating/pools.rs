//! Pools of comparable submissions: two submissions are in one pool if a chain of games connects them.

use super::trial_counts::TrialCounts;

/// For each submission the number of its pool, from 0, sorted by the first members of the pools. Two submissions are in
/// one pool if a chain of trials connects them.
pub(super) fn pool_numbers<'a>(
    submissions: usize,
    trial_counts: impl Iterator<Item = &'a TrialCounts>,
) -> Vec<usize> {
    // Union–find: each submission refers to an earlier member of its pool, the first one to itself.
    let mut parents: Vec<usize> = (0..submissions).collect();
    for counts in trial_counts {
        let [a, b] = counts.sides.map(|side| find_root(&mut parents, side));
        parents[a.max(b)] = a.min(b);
    }
    let mut numbers = vec![0; submissions];
    let mut next = 0;
    for member in 0..submissions {
        let root = find_root(&mut parents, member);
        numbers[member] = if root == member {
            next += 1;
            next - 1
        } else {
            numbers[root]
        };
    }
    numbers
}

fn find_root(parents: &mut [usize], mut member: usize) -> usize {
    while parents[member] != member {
        parents[member] = parents[parents[member]]; // Path halving.
        member = parents[member];
    }
    member
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chain_of_trials_is_one_pool() {
        let trial_counts = [[4, 2], [3, 5], [2, 0]].map(|sides| TrialCounts::new(sides, [1, 0]));
        assert_eq!(pool_numbers(6, trial_counts.iter()), [0, 1, 0, 2, 0, 2]);
        assert_eq!(pool_numbers(2, [].iter()), [0, 1]);
    }
}
