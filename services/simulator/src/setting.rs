use config::lesson::{Object, Occluder, Table};

/// What lies and stands on a table: as a lesson has it, or as somebody set it by hand.
#[derive(Clone, Debug, Default)]
pub(crate) struct Setting {
    /// What the objects are; where they lie first.
    pub(crate) objects: Vec<Object>,
    /// What hides things; where it stands first.
    pub(crate) occluders: Vec<Occluder>,
}

impl Setting {
    pub(crate) fn of(table: &Table) -> Self {
        Self { objects: table.objects.clone(), occluders: table.occluders.clone() }
    }
}
