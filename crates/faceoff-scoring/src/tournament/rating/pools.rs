//! Which submissions can be compared: those that games connect.

use super::contest::Contest;

/// For each submission the number of its pool, from 0, in the order of the pools' first members.
/// Submissions are in one pool if a chain of contests leads from one to the other.
pub(super) fn pools<'a>(
    submissions: usize,
    contests: impl Iterator<Item = &'a Contest>,
) -> Vec<usize> {
    // Each points to an earlier member of its pool, the first one to itself.
    let mut leader: Vec<usize> = (0..submissions).collect();
    for contest in contests {
        let [a, b] = contest.sides.map(|side| first(&mut leader, side));
        leader[a.max(b)] = a.min(b);
    }
    let mut numbers = vec![0; submissions];
    let mut next = 0;
    for member in 0..submissions {
        let first = first(&mut leader, member);
        numbers[member] = if first == member {
            next += 1;
            next - 1
        } else {
            numbers[first]
        };
    }
    numbers
}

fn first(leader: &mut [usize], mut member: usize) -> usize {
    while leader[member] != member {
        leader[member] = leader[leader[member]]; // the next search has half the way
        member = leader[member];
    }
    member
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_of_contests_is_one_pool() {
        let contests = [[4, 2], [3, 5], [2, 0]].map(|sides| Contest::new(sides, [1, 0]));
        assert_eq!(pools(6, contests.iter()), [0, 1, 0, 2, 0, 2]);
        assert_eq!(pools(2, [].iter()), [0, 1]);
    }
}
