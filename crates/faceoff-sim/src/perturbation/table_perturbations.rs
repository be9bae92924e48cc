//! The perturbations that act on the table and on the tracking of the puck. Therefore they affect all robots alike.

use super::{
    disturbance::Disturbance, rehearsal_table::RehearsalTable, tracking_loss::TrackingLoss,
};
use crate::PerturbationSettings;
use crate::{
    ActivePerturbations, Perturbation,
    stream::RandomStream,
    table::{geometry::PUCK, puck::Puck},
    world::World,
};
use faceoff_types::Seed;

/// The perturbations of the table in one episode or rally, with their draws.
#[derive(Debug, Clone)]
pub struct TablePerturbations {
    disturbance: Option<Disturbance>,
    tracking_loss: Option<TrackingLoss>,
    /// Force on the puck by the table's tilt, N.
    tilt_n: [f64; 2],
}

impl TablePerturbations {
    /// Draws from the seed of the episode or rally, and sets the puck's damping in the world. `settings` are the magnitudes.
    #[must_use]
    pub fn new(
        active_perturbations: ActivePerturbations,
        settings: &PerturbationSettings,
        seed: &Seed,
        world: &mut World,
    ) -> Self {
        let stream = |perturbation: Perturbation, label: &str| {
            active_perturbations
                .contains(perturbation)
                .then(|| RandomStream::new(seed, label))
        };
        let table = stream(Perturbation::Delay, "delay, table")
            .map(|stream| RehearsalTable::draw(&settings.delay, stream));
        if let Some(table) = &table {
            world.set_puck_damping(table.puck_damping_per_s);
        }
        Self {
            disturbance: stream(
                Perturbation::Disturbance,
                Perturbation::Disturbance.as_str(),
            )
            .map(|stream| Disturbance::new(&settings.disturbance, stream)),
            tracking_loss: stream(
                Perturbation::TrackingLoss,
                Perturbation::TrackingLoss.as_str(),
            )
            .map(|stream| TrackingLoss::new(&settings.tracking_loss, stream)),
            tilt_n: table.map_or([0.0; 2], |table| table.tilt_m_s2.map(|a| PUCK.mass_kg * a)),
        }
    }

    /// The force on the puck in the coming substep, N, table frame. Call it once per substep.
    pub fn force(&mut self, puck: &Puck) -> [f64; 2] {
        let [x, y] = self
            .disturbance
            .as_mut()
            .map_or([0.0; 2], |disturbance| disturbance.force(puck));
        [x + self.tilt_n[0], y + self.tilt_n[1]]
    }

    /// Advances the world by a control step; returns whether tracking has lost the puck at its end.
    pub fn control_step(&mut self, world: &mut World) -> bool {
        world.control_step(|puck| self.force(puck));
        self.draw_puck_lost()
    }

    /// Is the puck lost at the end of a control step? It draws random numbers, so call it once per control step.
    pub fn draw_puck_lost(&mut self) -> bool {
        self.tracking_loss
            .as_mut()
            .is_some_and(TrackingLoss::advance)
    }
}
