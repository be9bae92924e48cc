//! Advances worlds in time: one, or several at once.

use super::{
    World,
    arm_lanes::ArmLanes,
    lane_worlds::{LaneWorld, world_in_lane},
    scalar_arms::ScalarSolutions,
    substep::substep,
};
use crate::{
    dynamics::{
        lane_kernel::LaneKernel,
        lanes::{Lanes, MAX_LANES},
        simd_level::SimdLevel,
    },
    model::SUBSTEPS,
    table::puck::Puck,
};
use wide::f64x2;

impl World {
    /// Advances by a control step, 20 substeps. `air` is called before each of them.
    pub fn control_step(&mut self, air: impl FnMut(&Puck) -> [f64; 2]) {
        self.advance(SUBSTEPS, air);
    }

    /// Advances by one substep, 1 ms. After 20 of them a new action is due; without one the last
    /// trajectory would be repeated, so call [`World::command`] or [`World::hold`] first. A world that has
    /// diverged stays in its state.
    pub fn substep(&mut self) {
        let air_n = self.air_n;
        self.advance(1, |_| air_n);
    }

    /// Control steps of several worlds at once, with the same bits as [`World::control_step`]: at most four arms share
    /// the lanes of a register. Each world has its own air force.
    pub(crate) fn control_step_all<'a, A: FnMut(&Puck) -> [f64; 2]>(
        simd_level: SimdLevel,
        worlds: impl Iterator<Item = (&'a mut Self, A)>,
    ) {
        let mut lane_worlds: Vec<LaneWorld<'_, A>> = Vec::with_capacity(MAX_LANES);
        let mut first = 0;
        for (world, air) in worlds {
            if !world.has_moving_arms() {
                world.control_step(air);
                continue;
            }
            world.begin_step();
            let arms = world.arms.len();
            lane_worlds.push(LaneWorld::new(world, air, first));
            first += arms;
        }
        debug_assert!(first <= MAX_LANES);
        match lane_worlds.as_mut_slice() {
            [] => {}
            [lane_world] => lane_world.world.control_step(&mut lane_world.air_force),
            lane_worlds => simd_level.run(first, ControlStep { lane_worlds }),
        }
    }

    /// Can its arms be computed in lanes? Not if there are none, they are imposed, or the world has diverged.
    fn has_moving_arms(&self) -> bool {
        self.divergence.is_none() && self.imposed.is_none() && !self.arms.is_empty()
    }

    /// Clears the impacts of the previous control step.
    fn begin_step(&mut self) {
        if self.substep == 0 {
            self.impacts.begin_step();
        }
    }

    fn advance(&mut self, substeps: usize, mut air: impl FnMut(&Puck) -> [f64; 2]) {
        self.begin_step();
        if self.has_moving_arms() {
            let robots = self.arms.len();
            let mut lane_worlds = [LaneWorld::new(self, air, 0)];
            return match robots {
                1 => advance::<f64, _>(&mut lane_worlds, substeps),
                _ => advance::<f64x2, _>(&mut lane_worlds, substeps),
            };
        }
        for _ in 0..substeps {
            self.air_n = air(&self.puck);
            if self.divergence.is_some() {
                continue;
            }
            if self.imposed.is_some() {
                self.substep_imposed();
            } else {
                self.advance_puck_alone();
            }
            self.substep = (self.substep + 1) % SUBSTEPS;
        }
    }
}

/// A control step of several worlds.
struct ControlStep<'s, 'a, A> {
    lane_worlds: &'s mut [LaneWorld<'a, A>],
}

impl<A: FnMut(&Puck) -> [f64; 2]> LaneKernel for ControlStep<'_, '_, A> {
    type Output = ();

    #[inline(always)]
    fn run<T: Lanes>(self) {
        advance::<T, A>(self.lane_worlds, SUBSTEPS);
    }
}

/// Advances worlds in lanes by some substeps.
#[inline(always)]
fn advance<T: Lanes, A: FnMut(&Puck) -> [f64; 2]>(
    lane_worlds: &mut [LaneWorld<'_, A>],
    substeps: usize,
) {
    let mut arms = ArmLanes::<T>::gather(|lane| {
        let (lane_world, arm) = world_in_lane(lane_worlds, lane);
        (&lane_world.world.arms[arm], &lane_world.world.plant)
    });
    let mut scalar = ScalarSolutions::empty();
    for _ in 0..substeps {
        for lane_world in lane_worlds.iter_mut() {
            lane_world.world.air_n = (lane_world.air_force)(&lane_world.world.puck);
        }
        substep(&mut arms, lane_worlds, &mut scalar);
        for lane_world in lane_worlds
            .iter_mut()
            .filter(|lane_world| lane_world.is_moving)
        {
            lane_world.world.substep = (lane_world.world.substep + 1) % SUBSTEPS;
            lane_world.is_moving = lane_world.world.divergence.is_none();
        }
    }
    for lane_world in lane_worlds
        .iter_mut()
        .filter(|lane_world| lane_world.is_moving)
    {
        for (a, arm) in lane_world.world.arms.iter_mut().enumerate() {
            arms.store(lane_world.first_lane + a, arm);
        }
    }
}
