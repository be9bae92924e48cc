/// The newest format of archives that this program writes and reads.
pub const FORMAT: u32 = 1;
