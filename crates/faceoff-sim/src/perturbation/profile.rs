//! Profiles: named sets of perturbations, that is, of deliberate differences between the evaluator's simulator and the
//! one that teams have.

use faceoff_types::{Profile, UnknownProfile};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// One difference between the evaluator's simulator and the ideal one (`docs/rules.md`, "Perturbations").
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Perturbation {
    /// The plant's masses, gains and friction differ from the nominal model, once per season.
    ModelMismatch,
    /// Gaussian noise on everything that the agent observes.
    ObservationNoise,
    /// Air flow pushes a moving puck.
    Disturbance,
    /// The puck's pose freezes for some steps.
    TrackingLoss,
    /// Delays, and tilt and friction of the table, as in a real laboratory. Not in [`Perturbation::EVALUATION`], since only the profile
    /// `delay` uses it.
    Delay,
}

impl Perturbation {
    /// The perturbations of the `evaluation` profile.
    pub const EVALUATION: [Self; 4] = [
        Self::ModelMismatch,
        Self::ObservationNoise,
        Self::Disturbance,
        Self::TrackingLoss,
    ];

    /// The name used in files; also that of the profile with this perturbation alone.
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

impl fmt::Display for Perturbation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// The set of perturbations that are active in an episode or game.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ActivePerturbations(u8);

impl ActivePerturbations {
    /// No perturbation: the simulator that the teams have.
    pub const NONE: Self = Self(0);
    /// The four perturbations of the `evaluation` profile; not [`Perturbation::Delay`].
    pub const EVALUATION: Self = Self(0b1111);

    #[must_use]
    pub const fn only(perturbation: Perturbation) -> Self {
        Self(1 << perturbation as u8)
    }

    /// This set with one more perturbation.
    #[must_use]
    pub const fn with(self, perturbation: Perturbation) -> Self {
        Self(self.0 | 1 << perturbation as u8)
    }

    /// Is the perturbation active?
    #[must_use]
    pub const fn contains(self, perturbation: Perturbation) -> bool {
        self.0 & (1 << perturbation as u8) != 0
    }
}

/// A named set of perturbations.
///
/// [`AirHockeyProfile::Delay`] is for a rehearsal: practice with the delays, and a table with the tilt and friction, of a real laboratory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AirHockeyProfile {
    /// The simulator that the teams have, without perturbations.
    Ideal,
    /// Model mismatch alone.
    ModelMismatch,
    /// Observation noise alone.
    ObservationNoise,
    /// Air-flow disturbance alone.
    Disturbance,
    /// Tracking loss alone.
    TrackingLoss,
    /// Delays, and tilt and friction of the table, as in a real laboratory, alone.
    Delay,
    /// Model mismatch, observation noise, disturbance and tracking loss together; used for evaluations that count.
    Evaluation,
}

impl AirHockeyProfile {
    /// All profiles, in the order in which tables list them.
    pub const ALL: [Self; 7] = [
        Self::Ideal,
        Self::ModelMismatch,
        Self::ObservationNoise,
        Self::Disturbance,
        Self::TrackingLoss,
        Self::Delay,
        Self::Evaluation,
    ];

    /// Its name, by which others know it.
    #[must_use]
    pub const fn name(self) -> Profile {
        Profile::new(match self {
            Self::Ideal => "ideal",
            Self::ModelMismatch => Perturbation::ModelMismatch.as_str(),
            Self::ObservationNoise => Perturbation::ObservationNoise.as_str(),
            Self::Disturbance => Perturbation::Disturbance.as_str(),
            Self::TrackingLoss => Perturbation::TrackingLoss.as_str(),
            Self::Delay => Perturbation::Delay.as_str(),
            Self::Evaluation => "evaluation",
        })
    }

    /// The perturbations that are active in this profile.
    #[must_use]
    pub const fn active_perturbations(self) -> ActivePerturbations {
        match self {
            Self::Ideal => ActivePerturbations::NONE,
            Self::ModelMismatch => ActivePerturbations::only(Perturbation::ModelMismatch),
            Self::ObservationNoise => ActivePerturbations::only(Perturbation::ObservationNoise),
            Self::Disturbance => ActivePerturbations::only(Perturbation::Disturbance),
            Self::TrackingLoss => ActivePerturbations::only(Perturbation::TrackingLoss),
            Self::Delay => ActivePerturbations::only(Perturbation::Delay),
            Self::Evaluation => ActivePerturbations::EVALUATION,
        }
    }
}

impl fmt::Display for AirHockeyProfile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.name().fmt(f)
    }
}

impl From<AirHockeyProfile> for Profile {
    fn from(profile: AirHockeyProfile) -> Self {
        profile.name()
    }
}

impl FromStr for AirHockeyProfile {
    type Err = UnknownProfile;
    fn from_str(name: &str) -> Result<Self, UnknownProfile> {
        let found = Self::ALL
            .into_iter()
            .find(|profile| profile.name().as_str() == name);
        found.ok_or_else(|| UnknownProfile::new(name, Self::ALL.map(Self::name)))
    }
}

impl TryFrom<Profile> for AirHockeyProfile {
    type Error = UnknownProfile;
    fn try_from(name: Profile) -> Result<Self, UnknownProfile> {
        name.as_str().parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_found_by_name_with_their_perturbations() {
        for profile in AirHockeyProfile::ALL {
            assert_eq!(profile.name().try_into(), Ok(profile));
            let json = serde_json::to_string(&profile.name()).unwrap();
            assert_eq!(serde_json::to_string(&profile).unwrap(), json);
        }
        assert!("easy".parse::<AirHockeyProfile>().is_err());
        for perturbation in Perturbation::EVALUATION {
            assert!(
                AirHockeyProfile::Evaluation
                    .active_perturbations()
                    .contains(perturbation)
            );
            let single: AirHockeyProfile = perturbation.as_str().parse().unwrap();
            assert_eq!(
                single.active_perturbations(),
                ActivePerturbations::only(perturbation)
            );
        }
    }
}
