/// For how many steps in a row another belief was observed where one is expected, but not observed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    /// Identity of the other; 0 if there is none.
    pub(super) of: u64,
    pub(super) steps: u32,
}
