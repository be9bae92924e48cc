//! Rank groups: adjacent teams of a board that cannot be distinguished statistically.

use crate::board::RankedEntry;

/// Rank groups of a board: adjacent rows that are statistically tied with the leader of their group.
///
/// The first row is the leader of group 1. Each next row joins the current group if it is in the same tier and
/// `differs(leader, row)` is false; otherwise it is the leader of the next group. Therefore all members of a group are
/// tied with its leader, but not necessarily with each other. Groups are contiguous, and each is within one tier. Each
/// pair is tested at 5 %, without a correction for the number of teams.
///
/// Returns one group number per row, from 1.
///
/// # Errors
/// The first error of `differs`.
pub fn rank_groups<K, E>(
    board: &[RankedEntry<K>],
    mut differs: impl FnMut(&K, &K) -> Result<bool, E>,
) -> Result<Vec<u32>, E> {
    let mut groups = Vec::with_capacity(board.len());
    let mut group = 0;
    let mut leader: Option<&RankedEntry<K>> = None;
    for row in board {
        let joins = match leader {
            Some(leader) if leader.tier == row.tier => !differs(&leader.entry.key, &row.entry.key)?,
            _ => false,
        };
        if !joins {
            group += 1;
            leader = Some(row);
        }
        groups.push(group);
    }
    Ok(groups)
}
