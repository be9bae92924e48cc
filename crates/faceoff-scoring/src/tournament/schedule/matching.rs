//! Maximum matching: how many new pairs of teams are possible.

use petgraph::{
    algo::maximum_matching,
    graph::{NodeIndex, UnGraph},
};

/// The maximum number of disjoint pairs of `members`, if only those with `may_meet` may be paired.
pub(super) fn most_pairs(members: &[usize], may_meet: impl Fn(usize, usize) -> bool) -> usize {
    let mut graph = UnGraph::<(), ()>::with_capacity(members.len(), 0);
    let nodes: Vec<NodeIndex> = members.iter().map(|_| graph.add_node(())).collect();
    for (index_a, a) in members.iter().enumerate() {
        for (index_b, b) in members.iter().enumerate().skip(index_a + 1) {
            if may_meet(*a, *b) {
                graph.add_edge(nodes[index_a], nodes[index_b], ());
            }
        }
    }
    maximum_matching(&graph).len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn most_pairs_by_enumeration(
        members: &[usize],
        may_meet: &impl Fn(usize, usize) -> bool,
    ) -> usize {
        let Some((first, rest)) = members.split_first() else {
            return 0;
        };
        let mut best = most_pairs_by_enumeration(rest, may_meet);
        for (index, other) in rest.iter().enumerate() {
            if may_meet(*first, *other) {
                let mut remaining = rest.to_vec();
                remaining.remove(index);
                best = best.max(1 + most_pairs_by_enumeration(&remaining, may_meet));
            }
        }
        best
    }

    proptest! {
        #[test]
        fn most_pairs_agrees_with_enumeration(edges in proptest::collection::vec(any::<bool>(), 64)) {
            let members: Vec<usize> = (0..8).collect();
            let may_meet = |a: usize, b: usize| edges[8 * a.min(b) + a.max(b)];
            prop_assert_eq!(most_pairs(&members, may_meet), most_pairs_by_enumeration(&members, &may_meet));
        }
    }
}
