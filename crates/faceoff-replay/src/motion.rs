//! Collects the columns of the true motion of puck and robots, and the puck's contacts.

use crate::{
    column::Column,
    header::{Contact, ContactWith},
};
use faceoff_sim::{ContactBody, EpisodeState, GameState, Impact, JOINTS, model::CONTROL_STEP_S};

// Resolutions: values are stored as multiples of these.
/// A tenth of a pixel in the largest picture.
const POSITION_RESOLUTION_M: f64 = 1e-4;
/// An error of a few tenths of a millimetre at the end effector.
const JOINT_ANGLE_RESOLUTION_RAD: f64 = 1e-4;
const PUCK_YAW_RESOLUTION_RAD: f64 = 1e-3;
const PUCK_SPEED_RESOLUTION_M_S: f64 = 1e-3;
/// A quarter of a percent of the slowest joint's limit.
const JOINT_SPEED_RESOLUTION_RAD_S: f64 = 4e-3;
/// Angles of the universal joint between arm and mallet.
const UNIVERSAL_RESOLUTION_RAD: f64 = 1e-3;

/// A contact that begins sooner after one with the same body belongs to the same bounce.
const BOUNCE_S: f64 = 0.01;

/// The samples of the motion.
#[derive(Debug, Default)]
pub(crate) struct Motion {
    columns: Vec<Column>,
    contacts: Vec<Contact>,
}

/// One column for each joint: `name_1` … `name_7`.
pub(crate) fn joint_columns(
    name: &str,
    unit: &str,
    scale: f64,
    order: u8,
) -> impl Iterator<Item = Column> {
    (1..=JOINTS).map(move |joint| Column::new(format!("{name}_{joint}"), unit, scale, order))
}

impl Motion {
    /// The columns of an episode, with or without an opponent.
    pub fn new(has_opponent: bool) -> Self {
        let mut columns = vec![
            Column::new("puck_x", "m", POSITION_RESOLUTION_M, 2),
            Column::new("puck_y", "m", POSITION_RESOLUTION_M, 2),
            Column::new("puck_yaw", "rad", PUCK_YAW_RESOLUTION_RAD, 2),
            Column::new("puck_vx", "m/s", PUCK_SPEED_RESOLUTION_M_S, 1),
            Column::new("puck_vy", "m/s", PUCK_SPEED_RESOLUTION_M_S, 1),
        ];
        columns.extend(joint_columns("q", "rad", JOINT_ANGLE_RESOLUTION_RAD, 2));
        columns.extend(joint_columns(
            "dq",
            "rad/s",
            JOINT_SPEED_RESOLUTION_RAD_S,
            1,
        ));
        columns.extend([1, 2].map(|axis| {
            Column::new(
                format!("universal_{axis}"),
                "rad",
                UNIVERSAL_RESOLUTION_RAD,
                1,
            )
        }));
        if has_opponent {
            columns.extend(joint_columns(
                "opponent_q",
                "rad",
                JOINT_ANGLE_RESOLUTION_RAD,
                2,
            ));
        }
        Self {
            columns,
            contacts: Vec::new(),
        }
    }

    /// The columns of a game, in which both robots have the same columns.
    pub fn for_game() -> Self {
        let mut motion = Self::new(true);
        motion.columns.extend(joint_columns(
            "opponent_dq",
            "rad/s",
            JOINT_SPEED_RESOLUTION_RAD_S,
            1,
        ));
        motion.columns.extend([1, 2].map(|axis| {
            Column::new(
                format!("opponent_universal_{axis}"),
                "rad",
                UNIVERSAL_RESOLUTION_RAD,
                1,
            )
        }));
        motion
    }

    /// Adds a sample of a game.
    pub fn push_game(&mut self, state: &GameState) {
        let [x, y, yaw, vx, vy, _] = state.puck;
        let [q, opponent_q] = state.q;
        let [dq, opponent_dq] = state.dq;
        let [universal, opponent_universal] = state.universal;
        let puck_and_joints = [x, y, yaw, vx, vy].into_iter().chain(q).chain(dq);
        let values = puck_and_joints
            .chain(universal)
            .chain(opponent_q)
            .chain(opponent_dq)
            .chain(opponent_universal);
        for (column, value) in self.columns.iter_mut().zip(values) {
            column.push(value);
        }
    }

    /// Adds a sample of an episode.
    pub fn push(&mut self, state: &EpisodeState) {
        let [x, y, yaw, vx, vy, _] = state.puck;
        let puck_and_joints = [x, y, yaw, vx, vy]
            .into_iter()
            .chain(state.q)
            .chain(state.dq);
        let values = puck_and_joints
            .chain(state.universal)
            .chain(state.opponent_q.into_iter().flatten());
        for (column, value) in self.columns.iter_mut().zip(values) {
            column.push(value);
        }
    }

    /// Adds contacts that began in a control step.
    pub fn add_contacts(&mut self, step: u32, impacts: &[Impact]) {
        for impact in impacts {
            let t = f64::from(step) * CONTROL_STEP_S + impact.after_s();
            let body = match impact.body {
                ContactBody::LongRim | ContactBody::ShortRim => ContactWith::Rim,
                ContactBody::Mallet(0) => ContactWith::Mallet,
                ContactBody::Mallet(_) => ContactWith::OpponentMallet,
            };
            let is_same_bounce =
                |earlier: &Contact| earlier.body == body && t - earlier.t < BOUNCE_S;
            if !self.contacts.iter().rev().any(is_same_bounce) {
                let [x, y] = impact.puck;
                self.contacts.push(Contact {
                    t: rounded(t, 1e3),
                    body,
                    x: rounded(x, 1e4),
                    y: rounded(y, 1e4),
                });
            }
        }
    }

    /// The columns and the contacts.
    pub fn take(self) -> (Vec<Column>, Vec<Contact>) {
        (self.columns, self.contacts)
    }
}

/// Rounds to a multiple of 1 / `per_unit`.
fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}
