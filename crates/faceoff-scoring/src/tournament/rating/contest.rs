/// Two submissions against each other: how many trials each of them won. A game is one trial of two
/// halves, of which a draw gives one to each; or every goal is a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Contest {
    /// Their places in the list of submissions, the lower one first.
    pub(super) sides: [usize; 2],
    /// Halves of a game, or goals.
    pub(super) won: [u32; 2],
}

impl Contest {
    /// With the sides in order.
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

    /// Whether it says anything.
    pub(super) fn is_informative(&self) -> bool {
        self.sides[0] != self.sides[1] && self.won != [0, 0]
    }
}
