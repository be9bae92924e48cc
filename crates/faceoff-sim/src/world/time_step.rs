//! Advances worlds in time, one alone or several at once in the lanes of SIMD registers. A *substep* is 1 ms, a *control step* (one
//! action) 20 substeps.

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
    /// Advances by a control step. `air_force` returns the force of the air flow on the puck (N) and is called before each substep.
    pub fn control_step(&mut self, air_force: impl FnMut(&Puck) -> [f64; 2]) {
        self.advance(SUBSTEPS, air_force);
    }

    /// Advances by one substep. After every 20 substeps a new action is due: call [`World::command`] or [`World::hold`] first, since
    /// otherwise the last trajectory is repeated. A world that has *diverged* (its next state was beyond the bounds) stays in its state.
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
        let mut first_lane = 0;
        for (world, air_force) in worlds {
            if !world.has_moving_arms() {
                world.control_step(air_force);
                continue;
            }
            world.begin_step();
            let arms = world.arms.len();
            lane_worlds.push(LaneWorld::new(world, air_force, first_lane));
            first_lane += arms;
        }
        debug_assert!(first_lane <= MAX_LANES);
        match lane_worlds.as_mut_slice() {
            [] => {}
            [lane_world] => lane_world.world.control_step(&mut lane_world.air_force),
            lane_worlds => simd_level.run(first_lane, ControlStep { lane_worlds }),
        }
    }

    /// Does the world have arms to simulate? Not if it has none, if a mallet is imposed, or if the world has diverged.
    fn has_moving_arms(&self) -> bool {
        self.divergence.is_none() && self.imposed_mallet.is_none() && !self.arms.is_empty()
    }

    /// Clears the impacts of the previous control step.
    fn begin_step(&mut self) {
        if self.substep == 0 {
            self.impacts.begin_step();
        }
    }

    fn advance(&mut self, substeps: usize, mut air_force: impl FnMut(&Puck) -> [f64; 2]) {
        self.begin_step();
        if self.has_moving_arms() {
            let robots = self.arms.len();
            let mut lane_worlds = [LaneWorld::new(self, air_force, 0)];
            return match robots {
                1 => advance_in_lanes::<f64, _>(&mut lane_worlds, substeps),
                _ => advance_in_lanes::<f64x2, _>(&mut lane_worlds, substeps),
            };
        }
        for _ in 0..substeps {
            self.air_n = air_force(&self.puck);
            if self.divergence.is_some() {
                continue;
            }
            if self.imposed_mallet.is_some() {
                self.advance_puck_with_imposed_mallet();
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
        advance_in_lanes::<T, A>(self.lane_worlds, SUBSTEPS);
    }
}

/// Advances worlds in lanes by some substeps.
#[inline(always)]
fn advance_in_lanes<T: Lanes, A: FnMut(&Puck) -> [f64; 2]>(
    lane_worlds: &mut [LaneWorld<'_, A>],
    substeps: usize,
) {
    let mut arms = ArmLanes::<T>::gather(|lane| {
        let (lane_world, arm) = world_in_lane(lane_worlds, lane);
        (&lane_world.world.arms[arm], &lane_world.world.plant)
    });
    // For arms in contact or with a joint at its stop, which are solved one by one.
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
        for (robot, arm) in lane_world.world.arms.iter_mut().enumerate() {
            arms.store(lane_world.first_lane + robot, arm);
        }
    }
}
