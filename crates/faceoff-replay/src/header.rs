//! What a clip says of itself, beside its columns.

use crate::group::Group;
use faceoff_types::EpisodeEnd;
use serde::{Deserialize, Serialize};

/// Name and version of a clip's layout. A reader skips what it does not know; another meaning is another version.
pub(crate) const CLIP_FORMAT: &str = "faceoff-clip/1";

/// What a clip shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClipKind {
    /// What everybody could see who stood at the table.
    Motion,
    /// What a side was told and commanded, and how long it took.
    Observed,
}

/// A clip's header, as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// `faceoff-clip/1`.
    pub format: String,
    pub kind: ClipKind,
    /// `hit`, `defend`, `prepare` or `game`.
    pub contest: String,
    /// Index within the evaluation; absent of games.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub episode: Option<u32>,
    /// 0 or 1, whose observations and commands they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<u32>,
    /// Index of the clip's first sample; sample k is the state after k control steps.
    pub first: u32,
    /// Samples of the clip.
    pub samples: u32,
    /// Length of a control step, s.
    pub step_s: f64,
    /// The columns, in the payload's order.
    pub columns: Vec<ColumnHeader>,
    /// When the puck came to touch what, in order of time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<Contact>,
    /// Broken constraints, in order of their first sample.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub violations: Vec<ViolationTold>,
    /// Ends of a game's rallies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub breaks: Vec<Break>,
    /// Of games: the count at the first sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub score: Option<[u32; 2]>,
    /// Samples whose answer took more than a control step.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub late: Vec<u32>,
    /// When tracking had lost the puck.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<Lost>,
    /// How an episode ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub end: Option<EndTold>,
}

/// A column of the payload; [`crate::Column`] tells what its fields mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ColumnHeader {
    pub name: String,
    pub unit: String,
    /// What one counts for.
    pub scale: f64,
    /// Order of the differences.
    pub order: u8,
    /// Samples of the clip before the column's first.
    #[serde(default)]
    pub first: u32,
    pub count: u32,
    /// Length in the payload.
    pub bytes: u32,
}

/// The puck begins to touch something.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Time since sample 0 of the episode or game, s.
    pub t: f64,
    pub what: ContactWith,
    /// The puck's true place then, m, table frame.
    pub x: f64,
    /// See `x`.
    pub y: f64,
}

/// What the puck touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactWith {
    /// A rim of the table.
    Rim,
    /// The mallet of the first robot: the agent's own, or side A's.
    Mallet,
    /// The mallet of the second robot.
    OpponentMallet,
}

/// A constraint that was broken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ViolationTold {
    /// 0 or 1: whose.
    pub side: u32,
    pub group: Group,
    /// The first sample.
    pub from: u32,
    pub to: u32,
    /// By how much at most: rad, rad/s or m.
    pub worst: f64,
}

/// A rally of a game is over; the next sample is the next rally's first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Break {
    /// The rally's last sample.
    pub sample: u32,
    pub what: BreakKind,
    /// Who scored or fouled, 0 or 1.
    pub by: Option<u32>,
    pub score: [u32; 2],
}

/// Why a rally is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BreakKind {
    Goal,
    Foul,
    /// The puck lay out of reach.
    Stuck,
    /// The puck left the table.
    LeftTable,
    /// A robot was commanded beyond what can be simulated.
    Diverged,
    /// The game is over.
    GameOver,
}

/// The camera had lost the puck.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lost {
    /// The first sample.
    pub from: u32,
    pub to: u32,
}

/// How an episode ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EndTold {
    pub end: EpisodeEnd,
    pub success: bool,
    pub why: String,
    pub steps: u32,
}
