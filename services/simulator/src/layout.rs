use config::lesson::{Object, Occluder, Table, Territory};

/// The content of a table, from a lesson or set up interactively.
#[derive(Clone, Debug, Default)]
pub(crate) struct TableLayout {
    /// The objects, with their initial places.
    pub(crate) objects: Vec<Object>,
    /// The occluders, with their initial places.
    pub(crate) occluders: Vec<Occluder>,
    /// The owners of the table's regions, as in the lesson; copied into a saved lesson.
    pub(crate) territory: Vec<Territory>,
}

impl TableLayout {
    pub(crate) fn of(table: &Table) -> Self {
        let Table { objects, occluders, territory, .. } = table.clone();
        Self { objects, occluders, territory }
    }
}
