//! Worlds whose arms sit in the lanes.

use super::World;

/// A world that is moved together with others.
#[derive(Debug)]
pub struct Seat<'a, A> {
    pub world: &'a mut World,
    /// Tells the force of the air on its puck, N, before each substep.
    pub air: A,
    /// The lane of its first arm; the second arm's is the next one.
    pub first: usize,
    /// A world that has come to the end of its bounds stands still.
    pub moves: bool,
    /// What the contacts of this substep do to the puck, N, N, N m.
    pub puck_force: Option<[f64; 3]>,
}

impl<'a, A> Seat<'a, A> {
    /// Of a world that moves.
    pub fn new(world: &'a mut World, air: A, first: usize) -> Self {
        Self {
            world,
            air,
            first,
            moves: true,
            puck_force: None,
        }
    }

    /// The lanes of its arms, as bits.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        ((1 << self.world.arms.len()) - 1) << self.first
    }
}

/// Whose arm is in a lane, and which of its arms. In lanes that are left over is the first arm of all once
/// more.
#[inline(always)]
pub fn seat_of<'s, 'a, A>(seats: &'s [Seat<'a, A>], lane: usize) -> (&'s Seat<'a, A>, usize) {
    for seat in seats {
        if lane >= seat.first && lane - seat.first < seat.world.arms.len() {
            return (seat, lane - seat.first);
        }
    }
    (&seats[0], 0)
}
