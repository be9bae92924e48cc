//! Tests of the puck's estimate: noisy observations, lost tracking, a sudden strike.

use super::*;
use crate::testing::env;

/// Control period, seconds.
const DT: f64 = 0.02;
/// A mallet that the puck does not reach.
const DISTANT_MALLET: MalletState = MalletState {
    pos: Vec2::new(-0.9, 0.0),
    vel: Vec2::new(0.0, 0.0),
};

/// Reproducible noise with a standard deviation of about one.
struct Noise {
    state: u64,
}

impl Noise {
    fn seeded(seed: u64) -> Self {
        Self { state: seed }
    }

    fn next(&mut self) -> f64 {
        // The sum of twelve uniform numbers has variance 1.
        let mut sum = -6.0;
        for _ in 0..12 {
            self.state = self
                .state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (self.state >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }
}

/// The observation of a puck, with the noise of evaluations.
fn observation(puck: &Puck, noise: &mut Noise) -> PuckObservation {
    PuckObservation {
        pose: [
            puck.pos.x + 1e-3 * noise.next(),
            puck.pos.y + 1e-3 * noise.next(),
            0.02 * noise.next(),
        ],
        velocity: [
            puck.vel.x + 0.1 * noise.next(),
            puck.vel.y + 0.1 * noise.next(),
            0.1 * noise.next(),
        ],
    }
}

#[test]
fn velocity_estimate_is_better_than_observations() {
    let field = Field::new(&env());
    let mut noise = Noise::seeded(7);
    let mut filter = Estimator::new(&field, DT);
    let mut puck = Puck {
        pos: Vec2::new(0.6, 0.1),
        vel: Vec2::new(-1.0, 0.3),
        spin: 0.0,
    };
    let mut worst: f64 = 0.0;
    for step in 0..40 {
        let estimate = filter.observe(&observation(&puck, &mut noise), DISTANT_MALLET);
        // The filter has converged.
        if step > 12 {
            worst = worst.max((estimate.vel - puck.vel).norm());
            assert!((estimate.pos - puck.pos).norm() < 4e-3);
        }
        puck.advance(&field, DT);
    }
    assert!(worst < 0.12, "velocity off by {worst} m/s");
}

#[test]
fn lost_puck_moves_on_and_bounces() {
    let field = Field::new(&env());
    let mut noise = Noise::seeded(3);
    let mut filter = Estimator::new(&field, DT);
    let mut puck = Puck {
        pos: Vec2::new(0.3, 0.3),
        vel: Vec2::new(-1.0, 0.9),
        spin: 0.0,
    };
    for _ in 0..9 {
        filter.observe(&observation(&puck, &mut noise), DISTANT_MALLET);
        puck.advance(&field, DT);
    }
    // While tracking is lost, the last pose is repeated with zero velocity.
    let frozen = PuckObservation {
        velocity: [0.0; 3],
        ..observation(&puck, &mut noise)
    };
    filter.observe(
        &PuckObservation {
            velocity: [puck.vel.x, puck.vel.y, 0.0],
            ..frozen
        },
        DISTANT_MALLET,
    );
    let mut estimate = puck;
    for _ in 0..14 {
        puck.advance(&field, DT);
        estimate = filter.observe(&frozen, DISTANT_MALLET);
    }
    assert!(puck.vel.y < 0.0, "the case includes a bounce");
    assert!(
        (estimate.pos - puck.pos).norm() < 0.05,
        "estimate {estimate:?}, true {puck:?}"
    );
}

#[test]
fn struck_puck_is_tracked_within_five_steps() {
    let field = Field::new(&env());
    let mut noise = Noise::seeded(11);
    let mut filter = Estimator::new(&field, DT);
    let mut puck = Puck {
        pos: Vec2::new(-0.4, 0.0),
        vel: Vec2::zeros(),
        spin: 0.0,
    };
    for _ in 0..30 {
        filter.observe(&observation(&puck, &mut noise), DISTANT_MALLET);
    }
    puck.vel = Vec2::new(2.0, 0.5);
    let mut estimate = puck;
    for _ in 0..5 {
        puck.advance(&field, DT);
        estimate = filter.observe(&observation(&puck, &mut noise), DISTANT_MALLET);
    }
    assert!(
        (estimate.vel - puck.vel).norm() < 0.2,
        "estimate {estimate:?}, true {puck:?}"
    );
}
