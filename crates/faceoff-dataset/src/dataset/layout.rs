use faceoff_wire::dataset::DATASET_SCHEMA;

/// The layouts that this version reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Sealed by a hash in the archive's comment; its tables split integers by bytes and have no index
    /// of pages. Mean computation times were summed up from the shortest time on.
    Two,
    /// What the host took of an answer's time is not told apart. Mean computation times are summed up in
    /// order of play, as in all that follow.
    Three,
    Four,
}

impl Layout {
    const ALL: [Self; 3] = [Self::Two, Self::Three, Self::Four];

    /// As manifests name it.
    #[must_use]
    pub const fn schema(self) -> &'static str {
        match self {
            Self::Two => "faceoff-dataset/2",
            Self::Three => "faceoff-dataset/3",
            Self::Four => DATASET_SCHEMA,
        }
    }

    pub(super) fn of(schema: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|layout| layout.schema() == schema)
    }

    pub(super) fn all() -> String {
        Self::ALL.map(Self::schema).join(", ")
    }
}
