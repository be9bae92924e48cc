//! Trials between two submissions, the observations of the rating model.

/// The numbers of trials that two submissions won against each other. Either a game is one trial with two halves, of which
/// a draw gives one to each side, or each goal is a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TrialCounts {
    /// Indices of the submissions, the lower one first.
    pub(super) sides: [usize; 2],
    /// Halves of a game or goals that each side won.
    pub(super) won: [u32; 2],
}

impl TrialCounts {
    /// Sorts the sides.
    pub(super) fn new(sides: [usize; 2], won: [u32; 2]) -> Self {
        if sides[0] <= sides[1] {
            Self { sides, won }
        } else {
            Self {
                sides: [sides[1], sides[0]],
                won: [won[1], won[0]],
            }
        }
    }

    /// Whether the counts have any influence on the ratings.
    pub(super) fn is_informative(&self) -> bool {
        self.sides[0] != self.sides[1] && self.won != [0, 0]
    }
}
