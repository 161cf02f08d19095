use config::lesson::{Object, Occluder, Table, Territory};

/// What lies and stands on a table: as a lesson has it, or as somebody set it by hand.
#[derive(Clone, Debug, Default)]
pub(crate) struct Setting {
    /// What the objects are; where they lie first.
    pub(crate) objects: Vec<Object>,
    /// What hides things; where it stands first.
    pub(crate) occluders: Vec<Occluder>,
    /// Whose the regions of the table are, as the lesson notes it: a lesson that is saved notes it again.
    pub(crate) territory: Vec<Territory>,
}

impl Setting {
    pub(crate) fn of(table: &Table) -> Self {
        let Table { objects, occluders, territory, .. } = table.clone();
        Self { objects, occluders, territory }
    }
}
