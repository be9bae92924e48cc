/// Marks an answer that pages of other sites may hold.
#[derive(Debug, Clone, Copy)]
pub struct Embeddable;
