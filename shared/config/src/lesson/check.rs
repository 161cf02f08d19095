//! Converts a parsed lesson into a checked one: validates what involves more than one value.

mod script;

use std::collections::BTreeMap;

use settings::number::{Coordinate, NotNegative, Positive, UnitInterval};
use settings::{Spanned, SpannedError};

use super::{
    Lesson, Noise, Object, ObjectKind, Occluder, Table, TableTiming, Teacher, Territory, UprightPose, raw,
};

/// The definitions that the tables of a lesson refer to.
struct Catalogue {
    kinds: BTreeMap<String, ObjectKind>,
    colours: BTreeMap<String, [UnitInterval; 3]>,
    teachers: Vec<u16>,
}

pub(super) fn lesson(raw: raw::Lesson) -> Result<Lesson, SpannedError> {
    let table_timing = table_timing(&raw.table_timing)?;
    let teachers = teachers(&raw.teacher)?;
    let catalogue = Catalogue {
        kinds: raw.kind.into_iter().map(|(name, kind)| (name, self::kind(&kind))).collect(),
        colours: raw.colour,
        teachers: teachers.iter().map(|teacher| teacher.number).collect(),
    };
    if raw.demonstration.is_empty() && raw.novel.is_none() {
        return Err(SpannedError::within(
            0..0,
            "a lesson needs a [[demonstration]] or a [novel] set: it has neither",
        ));
    }
    // A teacher who left stays away until they return, across tables.
    let mut away = Vec::new();
    let mut table = |raw| table(raw, &catalogue, &mut away);
    let demonstrations = raw.demonstration.into_iter().map(&mut table).collect::<Result<_, _>>()?;
    let novel = raw.novel.map(table).transpose()?;
    Ok(Lesson {
        title: raw.title,
        watch: raw.watch,
        needs: raw.needs,
        seed: raw.seed,
        robot: UprightPose {
            position_m: raw.robot.position_m.map(Coordinate::get),
            heading_rad: raw.robot.heading_deg.get().to_radians(),
        },
        teachers,
        noise: Noise { position_sd_m: raw.noise.position_sd_m.get(), confidence: raw.noise.confidence.get() },
        table_timing,
        kinds: catalogue.kinds,
        colours: catalogue
            .colours
            .into_iter()
            .map(|(name, rgb)| (name, rgb.map(UnitInterval::get)))
            .collect(),
        demonstrations,
        novel,
    })
}

fn table_timing(raw: &raw::TableTiming) -> Result<TableTiming, SpannedError> {
    let first = &raw.occluders_first_s;
    if first.get_ref() > &raw.empty_s {
        let reason = format!(
            "the occluders cannot appear {} s before the objects: the table is empty for only {} s",
            first.get_ref().get(),
            raw.empty_s.get()
        );
        return Err(SpannedError::at(first, reason));
    }
    Ok(TableTiming {
        empty: raw.empty_s.duration(),
        occluders_first: first.get_ref().duration(),
        keep: raw.keep_s.duration(),
    })
}

fn teachers(raw: &[raw::Teacher]) -> Result<Vec<Teacher>, SpannedError> {
    let mut teachers: Vec<Teacher> = Vec::with_capacity(raw.len());
    for teacher in raw {
        let number = *teacher.number.get_ref();
        if number == 0 || number == message::NOBODY {
            let reason = format!("{number} is no partner: partners are numbered 1, 2, … (0 is the robot)");
            return Err(SpannedError::at(&teacher.number, reason));
        }
        if teachers.iter().any(|other| other.number == number) {
            return Err(SpannedError::at(
                &teacher.number,
                format!("there is a teacher {number} already: every teacher needs a different number"),
            ));
        }
        let eyes_m = teacher.eyes_m.map(Coordinate::get);
        let looks_at_m = teacher.looks_at_m.get_ref().map(Coordinate::get);
        if distance(eyes_m, looks_at_m) < 0.01 {
            return Err(SpannedError::at(
                &teacher.looks_at_m,
                "a teacher cannot look at their own eyes: name a point before them",
            ));
        }
        teachers.push(Teacher { number, eyes_m, looks_at_m });
    }
    Ok(teachers)
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

fn kind(raw: &raw::ObjectKind) -> ObjectKind {
    ObjectKind {
        role: raw.role,
        shape: raw.shape.map(UnitInterval::get),
        half_extents_m: raw.half_extents_m.map(Positive::get),
        hole: raw.hole,
        markable: raw.markable,
    }
}

fn table(
    raw: Spanned<raw::Table>,
    catalogue: &Catalogue,
    away: &mut Vec<u16>,
) -> Result<Table, SpannedError> {
    let span = raw.span();
    let raw = raw.into_inner();
    unique(raw.objects.iter().map(|object| &object.name), "object")?;
    unique(raw.occluders.iter().map(|occluder| &occluder.name), "occluder")?;
    let objects: Vec<Object> =
        raw.objects.iter().map(|raw| object(raw, catalogue)).collect::<Result<_, _>>()?;
    let occluders: Vec<Occluder> = raw.occluders.iter().map(occluder).collect::<Result<_, _>>()?;
    let lying = script::TableContents { objects: &objects, occluders: &occluders };
    Ok(Table {
        script: script::script(&raw.script, span, &lying, catalogue, away)?,
        objects,
        occluders,
        territory: raw.territory.iter().map(|raw| territory(raw, catalogue)).collect::<Result<_, _>>()?,
    })
}

fn unique<'a>(names: impl Iterator<Item = &'a Spanned<String>>, what: &str) -> Result<(), SpannedError> {
    let mut seen = std::collections::BTreeSet::new();
    for name in names {
        if name.get_ref().trim().is_empty() {
            return Err(SpannedError::at(name, format!("an {what} needs a name")));
        }
        if !seen.insert(name.get_ref()) {
            let reason =
                format!("there is an {what} `{0}` already: call this one `{0} 2`, say", name.get_ref());
            return Err(SpannedError::at(name, reason));
        }
    }
    Ok(())
}

fn object(raw: &raw::Object, catalogue: &Catalogue) -> Result<Object, SpannedError> {
    let kind = *named(&raw.kind, "kind", catalogue.kinds.iter().map(|(name, kind)| (name.as_str(), kind)))?;
    let colours = catalogue.colours.iter().map(|(name, colour)| (name.as_str(), colour));
    let colour = named(&raw.colour, "colour", colours)?;
    let underside_m = raw.underside_m.map_or(0.0, NotNegative::get);
    Ok(Object {
        name: raw.name.get_ref().clone(),
        kind,
        colour_rgb: colour.map(UnitInterval::get),
        place: standing(raw.position_m, underside_m, raw.heading_deg.get(), &kind),
    })
}

/// The pose of an object's centre, given the height `underside_m` of its underside above the table.
fn standing(at_m: [Coordinate; 2], underside_m: f64, heading_deg: f64, kind: &ObjectKind) -> UprightPose {
    let [x, y] = at_m.map(Coordinate::get);
    let [_, _, half_height_m] = kind.half_extents_m;
    UprightPose { position_m: [x, y, underside_m + half_height_m], heading_rad: heading_deg.to_radians() }
}

fn occluder(raw: &raw::Occluder) -> Result<Occluder, SpannedError> {
    let from = raw.from_m.map(Coordinate::get);
    let to = raw.to_m.get_ref().map(Coordinate::get);
    ascending(&from, &to, &raw.to_m)?;
    let [x0, y0, z0] = from;
    let [x1, y1, z1] = to;
    Ok(Occluder {
        name: raw.name.get_ref().clone(),
        centre_m: [f64::midpoint(x0, x1), f64::midpoint(y0, y1), f64::midpoint(z0, z1)],
        half_extents_m: [(x1 - x0) / 2.0, (y1 - y0) / 2.0, (z1 - z0) / 2.0],
    })
}

fn territory(raw: &raw::Territory, catalogue: &Catalogue) -> Result<Territory, SpannedError> {
    let owner = *raw.owner.get_ref();
    if owner != 0 && !catalogue.teachers.contains(&owner) {
        let reason =
            format!("there is no agent {owner}: the owner is 0, the robot, or the number of a teacher");
        return Err(SpannedError::at(&raw.owner, reason));
    }
    let from_m = raw.from_m.map(Coordinate::get);
    let to_m = raw.to_m.get_ref().map(Coordinate::get);
    ascending(&from_m, &to_m, &raw.to_m)?;
    Ok(Territory { owner, from_m, to_m })
}

fn ascending<T>(from: &[f64], to: &[f64], at: &Spanned<T>) -> Result<(), SpannedError> {
    if from.iter().zip(to).all(|(from, to)| from < to) {
        Ok(())
    } else {
        Err(SpannedError::at(at, "every coordinate of `to_m` must be greater than that of `from_m`"))
    }
}

/// Looks up a name; the error lists the known names and suggests the closest one.
fn named<'a, T>(
    name: &Spanned<String>,
    what: &str,
    known: impl Iterator<Item = (&'a str, T)>,
) -> Result<T, SpannedError> {
    let mut known: Vec<(&str, T)> = known.collect();
    if let Some(found) = known.iter().position(|(known, _)| known == name.get_ref()) {
        return Ok(known.swap_remove(found).1);
    }
    let list: Vec<String> = known.iter().map(|(known, _)| format!("`{known}`")).collect();
    let closest = settings::closest(name.get_ref(), known.iter().map(|(known, _)| *known));
    let hint = closest.map_or(String::new(), |known| format!("; did you mean `{known}`?"));
    let there_is = if list.is_empty() { "none".to_owned() } else { list.join(", ") };
    Err(SpannedError::at(name, format!("unknown {what} `{}`: there is {there_is}{hint}", name.get_ref())))
}
