use petgraph::{
    algo::maximum_matching,
    graph::{NodeIndex, UnGraph},
};

/// How many pairs can be made of `members` at most, if only those may be paired that `may_meet`.
pub(super) fn most_pairs(members: &[usize], may_meet: impl Fn(usize, usize) -> bool) -> usize {
    let mut graph = UnGraph::<(), ()>::with_capacity(members.len(), 0);
    let nodes: Vec<NodeIndex> = members.iter().map(|_| graph.add_node(())).collect();
    for (place, a) in members.iter().enumerate() {
        for (other, b) in members.iter().enumerate().skip(place + 1) {
            if may_meet(*a, *b) {
                graph.add_edge(nodes[place], nodes[other], ());
            }
        }
    }
    maximum_matching(&graph).len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn by_trying(members: &[usize], may_meet: &impl Fn(usize, usize) -> bool) -> usize {
        let Some((first, rest)) = members.split_first() else {
            return 0;
        };
        let mut best = by_trying(rest, may_meet);
        for (place, other) in rest.iter().enumerate() {
            if may_meet(*first, *other) {
                let mut left = rest.to_vec();
                left.remove(place);
                best = best.max(1 + by_trying(&left, may_meet));
            }
        }
        best
    }

    proptest! {
        #[test]
        fn as_many_pairs_as_trying_everything_finds(edges in proptest::collection::vec(any::<bool>(), 64)) {
            let members: Vec<usize> = (0..8).collect();
            let may_meet = |a: usize, b: usize| edges[8 * a.min(b) + a.max(b)];
            prop_assert_eq!(most_pairs(&members, may_meet), by_trying(&members, &may_meet));
        }
    }
}
