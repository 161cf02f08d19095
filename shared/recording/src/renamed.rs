//! Fields of recorded types that were renamed without a change of their bytes.

/// The type, the old name and the new name of each renamed field.
const RENAMED: [(&str, &str, &str); 6] = [
    ("leo/Header/1", "left_out", "over_capacity"),
    ("leo/PerceptHead/1", "looked", "active_sources"),
    ("leo/Aspect/1", "apart", "distance"),
    ("leo/Observation/2", "reserved", "detection"),
    ("leo/JointState/3", "licence", "arming"),
    ("leo/JointState/3", "licence_cause", "arming_cause"),
];

/// The text of a schema, with the new names of renamed fields.
pub(crate) fn with_new_names(schema: &str) -> String {
    let mut kind = "";
    let mut text = String::with_capacity(schema.len());
    for line in schema.split_inclusive('\n') {
        let place = line.trim_start_matches([' ', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']);
        let (before, name) = (line.len() - place.len(), place.split(':').next().unwrap_or_default());
        if before == 0 {
            kind = name;
        }
        match RENAMED.iter().find(|(of, old, _)| before > 0 && *of == kind && *old == name) {
            Some((_, old, new)) => text += &line.replacen(old, new, 1),
            None => text += line,
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use message::TopicId;

    use super::*;
    use crate::Channel;

    #[test]
    fn every_old_name_becomes_the_name_of_a_present_field() {
        for (of, old, new) in RENAMED {
            let schemas = [TopicId::Percepts, TopicId::Divergences(1), TopicId::JointStates]
                .map(|topic| Channel(topic).schema());
            let schema =
                schemas.iter().find(|schema| schema.contains(&format!("\n{of}: "))).expect("a recorded type");
            let (before, rest) = schema.split_once(&format!("\n{of}: ")).expect("its type");
            let older =
                format!("{before}\n{of}: {}", rest.replacen(&format!(" {new}: "), &format!(" {old}: "), 1));
            assert_ne!(&older, schema, "{new}");
            assert_eq!(&with_new_names(&older), schema, "{old}");
        }
    }

    #[test]
    fn the_same_name_in_another_type_is_kept() {
        let schema = "leo/Other/1: 8 bytes\n       0 licence: u16\n";
        assert_eq!(with_new_names(schema), schema);
    }
}
