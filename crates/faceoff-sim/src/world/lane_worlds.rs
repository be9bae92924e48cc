//! Assignment of worlds and their arms to *lanes*, the number slots of a SIMD register: each arm has a lane.

use super::World;

/// A world that is stepped together with others. `A` is the function that returns its air force.
#[derive(Debug)]
pub struct LaneWorld<'a, A> {
    pub world: &'a mut World,
    /// Returns the force of the air flow on the world's puck, N; called before each substep.
    pub air_force: A,
    /// The lane of the world's first arm; the second arm has the next lane.
    pub first_lane: usize,
    /// False once the world has diverged.
    pub is_moving: bool,
    /// Force of this substep's contacts on the puck, N, N, N m.
    pub puck_force: Option<[f64; 3]>,
}

impl<'a, A> LaneWorld<'a, A> {
    pub fn new(world: &'a mut World, air_force: A, first_lane: usize) -> Self {
        Self {
            world,
            air_force,
            first_lane,
            is_moving: true,
            puck_force: None,
        }
    }

    /// The lanes of the world's arms, as bits.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        ((1 << self.world.arms.len()) - 1) << self.first_lane
    }
}

/// The world whose arm is in a lane, and the index of that arm. Unused lanes repeat the first arm.
#[inline(always)]
pub fn world_in_lane<'s, 'a, A>(
    lane_worlds: &'s [LaneWorld<'a, A>],
    lane: usize,
) -> (&'s LaneWorld<'a, A>, usize) {
    for lane_world in lane_worlds {
        if lane >= lane_world.first_lane
            && lane - lane_world.first_lane < lane_world.world.arms.len()
        {
            return (lane_world, lane - lane_world.first_lane);
        }
    }
    (&lane_worlds[0], 0)
}
