//! Worlds in time: alone, or several at once.

use super::{
    World,
    apart::Apart,
    arm_lanes::ArmLanes,
    seats::{Seat, seat_of},
    substep::substep,
};
use crate::{
    dynamics::{
        in_lanes::InLanes,
        lanes::{Lanes, MAX_LANES},
        path::LanePath,
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
    /// trajectory would be repeated, so [`World::command`] or [`World::hold`] first. A world that has come
    /// to the end of its bounds stands still.
    pub fn substep(&mut self) {
        let air_n = self.air_n;
        self.advance(1, |_| air_n);
    }

    /// Several worlds' control steps at once, as [`World::control_step`] with the same bits: the arms share
    /// the lanes of a register, at most four of them. Each world with its air.
    pub(crate) fn control_step_together<'a, A: FnMut(&Puck) -> [f64; 2]>(
        path: LanePath,
        worlds: impl Iterator<Item = (&'a mut Self, A)>,
    ) {
        let mut seats: Vec<Seat<'_, A>> = Vec::with_capacity(MAX_LANES);
        let mut first = 0;
        for (world, air) in worlds {
            if !world.is_laned() {
                world.control_step(air);
                continue;
            }
            world.begin_step();
            let arms = world.arms.len();
            seats.push(Seat::new(world, air, first));
            first += arms;
        }
        debug_assert!(first <= MAX_LANES);
        match seats.as_mut_slice() {
            [] => {}
            [seat] => seat.world.control_step(&mut seat.air),
            seats => path.run(first, ControlStep { seats }),
        }
    }

    /// Has it arms that move?
    fn is_laned(&self) -> bool {
        self.divergence.is_none() && self.imposed.is_none() && !self.arms.is_empty()
    }

    /// Forgets what was noted of the control step before.
    fn begin_step(&mut self) {
        if self.substep == 0 {
            self.impacts.begin_step();
        }
    }

    fn advance(&mut self, substeps: usize, mut air: impl FnMut(&Puck) -> [f64; 2]) {
        self.begin_step();
        if self.is_laned() {
            let robots = self.arms.len();
            let mut seats = [Seat::new(self, air, 0)];
            return match robots {
                1 => advance::<f64, _>(&mut seats, substeps),
                _ => advance::<f64x2, _>(&mut seats, substeps),
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

/// A control step of all seats.
struct ControlStep<'s, 'a, A> {
    seats: &'s mut [Seat<'a, A>],
}

impl<A: FnMut(&Puck) -> [f64; 2]> InLanes for ControlStep<'_, '_, A> {
    type Output = ();

    #[inline(always)]
    fn run<T: Lanes>(self) {
        advance::<T, A>(self.seats, SUBSTEPS);
    }
}

/// Advances the worlds of the seats, which move, by some substeps.
#[inline(always)]
fn advance<T: Lanes, A: FnMut(&Puck) -> [f64; 2]>(seats: &mut [Seat<'_, A>], substeps: usize) {
    let mut arms = ArmLanes::<T>::gather(|lane| {
        let (seat, arm) = seat_of(seats, lane);
        (&seat.world.arms[arm], &seat.world.plant)
    });
    let mut apart = Apart::none();
    for _ in 0..substeps {
        for seat in seats.iter_mut() {
            seat.world.air_n = (seat.air)(&seat.world.puck);
        }
        substep(&mut arms, seats, &mut apart);
        for seat in seats.iter_mut().filter(|seat| seat.moves) {
            seat.world.substep = (seat.world.substep + 1) % SUBSTEPS;
            seat.moves = seat.world.divergence.is_none();
        }
    }
    for seat in seats.iter_mut().filter(|seat| seat.moves) {
        for (a, arm) in seat.world.arms.iter_mut().enumerate() {
            arms.store(seat.first + a, arm);
        }
    }
}
