//! A reference implementation of maximum matching for small numbers of teams.

use faceoff_types::TeamName;

/// Maximum number of disjoint pairs of `members` with `may_meet`, by enumeration.
pub fn most_pairs(
    members: &[&TeamName],
    may_meet: &impl Fn(&TeamName, &TeamName) -> bool,
) -> usize {
    let Some((first, rest)) = members.split_first() else {
        return 0;
    };
    let mut best = most_pairs(rest, may_meet);
    for (index, other) in rest.iter().enumerate() {
        if may_meet(first, other) {
            let mut remaining = rest.to_vec();
            remaining.remove(index);
            best = best.max(1 + most_pairs(&remaining, may_meet));
        }
    }
    best
}
