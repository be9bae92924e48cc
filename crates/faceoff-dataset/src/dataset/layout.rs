use faceoff_wire::dataset::DATASET_SCHEMA;

/// The layouts that this version reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Sealed by a hash in the archive's comment; its tables split integers by bytes and have no index
    /// of pages. Mean computation times were summed up from the shortest time on.
    Two,
    /// Today's. Mean computation times are summed up in order of play.
    Three,
}

impl Layout {
    const ALL: [Self; 2] = [Self::Two, Self::Three];

    /// As manifests name it.
    #[must_use]
    pub const fn schema(self) -> &'static str {
        match self {
            Self::Two => "faceoff-dataset/2",
            Self::Three => DATASET_SCHEMA,
        }
    }

    pub(super) fn of(schema: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|layout| layout.schema() == schema)
    }

    /// For messages.
    pub(super) fn all() -> String {
        Self::ALL.map(Self::schema).join(" and ")
    }
}
