use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// One way in which the evaluator's simulator differs from the ideal one (RULES, "Perturbation profiles").
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Factor {
    /// The plant's masses, gains and friction differ from the nominal model, once per season.
    ModelMismatch,
    /// Gaussian noise on everything the agent observes.
    ObservationNoise,
    /// Air flow pushes a moving puck.
    Disturbance,
    /// The puck's pose freezes for some steps.
    TrackingLoss,
    /// The laboratory's delays and table. Part of the rehearsal only, so not among [`Factor::ALL`].
    Delay,
}

impl Factor {
    /// All factors that count in the `evaluation` profile.
    pub const ALL: [Self; 4] = [
        Self::ModelMismatch,
        Self::ObservationNoise,
        Self::Disturbance,
        Self::TrackingLoss,
    ];

    /// The name used in files and as the single-factor profile.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::ModelMismatch => "model_mismatch",
            Self::ObservationNoise => "observation_noise",
            Self::Disturbance => "disturbance",
            Self::TrackingLoss => "tracking_loss",
            Self::Delay => "delay",
        }
    }
}

impl fmt::Display for Factor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// Which factors are switched on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Factors(u8);

impl Factors {
    /// No factor: the simulator the teams have.
    pub const NONE: Self = Self(0);
    /// All four factors of the `evaluation` profile.
    pub const ALL: Self = Self(0b1111);

    #[must_use]
    pub const fn only(factor: Factor) -> Self {
        Self(1 << factor as u8)
    }

    /// These factors and one more.
    #[must_use]
    pub const fn with(self, factor: Factor) -> Self {
        Self(self.0 | 1 << factor as u8)
    }

    /// Is the factor switched on?
    #[must_use]
    pub const fn contains(self, factor: Factor) -> bool {
        self.0 & (1 << factor as u8) != 0
    }
}

/// A named set of perturbations.
///
/// The rules' rehearsal profile, with its safety layer, is not offered yet; its delays are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// The simulator the teams have.
    Ideal,
    /// Model mismatch alone.
    ModelMismatch,
    /// Observation noise alone.
    ObservationNoise,
    /// Air-flow disturbance alone.
    Disturbance,
    /// Tracking loss alone.
    TrackingLoss,
    /// The laboratory's delays and table alone.
    Delay,
    /// The four factors together: what counts.
    Evaluation,
}

impl Profile {
    /// What an ablation compares: nothing, each factor that counts alone, and all of them.
    pub const ABLATION: [Self; 6] = [
        Self::Ideal,
        Self::ModelMismatch,
        Self::ObservationNoise,
        Self::Disturbance,
        Self::TrackingLoss,
        Self::Evaluation,
    ];

    pub const ALL: [Self; 7] = [
        Self::Ideal,
        Self::ModelMismatch,
        Self::ObservationNoise,
        Self::Disturbance,
        Self::TrackingLoss,
        Self::Delay,
        Self::Evaluation,
    ];

    /// The name used in files and on the command line.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::ModelMismatch => Factor::ModelMismatch.as_str(),
            Self::ObservationNoise => Factor::ObservationNoise.as_str(),
            Self::Disturbance => Factor::Disturbance.as_str(),
            Self::TrackingLoss => Factor::TrackingLoss.as_str(),
            Self::Delay => Factor::Delay.as_str(),
            Self::Evaluation => "evaluation",
        }
    }

    /// The factors that this profile switches on.
    #[must_use]
    pub const fn factors(self) -> Factors {
        match self {
            Self::Ideal => Factors::NONE,
            Self::ModelMismatch => Factors::only(Factor::ModelMismatch),
            Self::ObservationNoise => Factors::only(Factor::ObservationNoise),
            Self::Disturbance => Factors::only(Factor::Disturbance),
            Self::TrackingLoss => Factors::only(Factor::TrackingLoss),
            Self::Delay => Factors::only(Factor::Delay),
            Self::Evaluation => Factors::ALL,
        }
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// A word that names no profile.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown profile {0:?}: expected ideal, model_mismatch, observation_noise, disturbance, tracking_loss, delay or evaluation"
)]
pub struct ParseProfileError(pub String);

impl FromStr for Profile {
    type Err = ParseProfileError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|profile| profile.as_str() == s)
            .ok_or_else(|| ParseProfileError(s.to_owned()))
    }
}
