//! Streams of random numbers, with the same bits on every machine.

use faceoff_types::Seed;
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;

/// One stream of random numbers: ChaCha8 with a seed that is derived from a root seed and a label. Each consumer has its own label, so
/// that its draws never affect those of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RandomStream(ChaCha8Rng);

impl RandomStream {
    /// The stream of the consumer that `label` names, e.g. `initial_state`.
    #[must_use]
    pub fn new(seed: &Seed, label: &str) -> Self {
        Self(ChaCha8Rng::from_seed(*seed.derive(label, &[]).as_bytes()))
    }

    /// Uniform in [0, 1), with 53 random bits.
    pub fn unit(&mut self) -> f64 {
        const SCALE: f64 = 1.0 / (1u64 << 53) as f64;
        (self.0.next_u64() >> 11) as f64 * SCALE
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform over the integers low, …, high.
    pub fn integer(&mut self, low: u32, high: u32) -> u32 {
        let span = u64::from(high - low) + 1;
        // Multiply and shift: the bias is below span / 2³².
        low + u32::try_from(((self.0.next_u64() >> 32) * span) >> 32).unwrap_or(0)
    }

    /// Two independent standard normal numbers (Box–Muller: always two draws, unlike rejection
    /// methods, so that streams stay aligned).
    pub fn normal_pair(&mut self) -> [f64; 2] {
        // 1 − u lies in (0, 1], where the logarithm is finite.
        let radius = (-2.0 * libm::log(1.0 - self.unit())).sqrt();
        let (sin, cos) = libm::sincos(TAU * self.unit());
        [radius * cos, radius * sin]
    }
}
