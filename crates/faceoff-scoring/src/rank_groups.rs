use crate::board::RankedEntry;

/// Rank groups of a board: neighbours that the day's episodes cannot tell apart.
///
/// Down the board, the first row opens group 1 and leads it. A row joins the group above it if it
/// stands in the same tier and `told_apart(leader, row)` is false; otherwise it opens the next group
/// and leads that one. So every member of a group cannot be told from its leader (two members further
/// down might be), groups are contiguous, and none spans two tiers. Each pair is tested at 5 %; there
/// is no correction for the number of teams.
///
/// Returns one group number per row, from 1.
///
/// # Errors
/// The first error of `told_apart`.
pub fn rank_groups<K, E>(
    board: &[RankedEntry<K>],
    mut told_apart: impl FnMut(&K, &K) -> Result<bool, E>,
) -> Result<Vec<u32>, E> {
    let mut groups = Vec::with_capacity(board.len());
    let mut group = 0;
    let mut leader: Option<&RankedEntry<K>> = None;
    for row in board {
        let joins = match leader {
            Some(leader) if leader.tier == row.tier => {
                !told_apart(&leader.entry.key, &row.entry.key)?
            }
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
