//! Writes a lesson as the text of its file.

use std::fmt::{self, Write as _};
use std::time::Duration;

use super::{Act, Destination, Lesson, Needs, Object, ObjectKind, Occluder, Step, Table};

/// Decimal places of written numbers: micrometres, far below the sensor noise.
const PLACES: usize = 6;

impl Lesson {
    /// The lesson as the text of a file. Parsing it gives the same lesson, with numbers rounded to six decimal places.
    /// Unnamed kinds and colours get generated names.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        // Writing to a `String` cannot fail.
        let _ = Writer { catalogue: Catalogue::of(self), out: &mut out }.lesson(self);
        out
    }
}

/// The names of kinds and colours.
struct Catalogue {
    kinds: Vec<(String, ObjectKind)>,
    colours: Vec<(String, [f64; 3])>,
}

impl Catalogue {
    fn of(lesson: &Lesson) -> Self {
        let mut kinds: Vec<_> = lesson.kinds.iter().map(|(name, kind)| (name.clone(), *kind)).collect();
        let mut colours: Vec<_> = lesson.colours.iter().map(|(name, rgb)| (name.clone(), *rgb)).collect();
        for object in lesson.tables().flat_map(|table| &table.objects) {
            if !kinds.iter().any(|(_, kind)| *kind == object.kind) {
                kinds.push((format!("kind_{}", kinds.len() + 1), object.kind));
            }
            if !colours.iter().any(|(_, rgb)| is_same(rgb, &object.colour_rgb)) {
                colours.push((format!("colour_{}", colours.len() + 1), object.colour_rgb));
            }
        }
        Self { kinds, colours }
    }

    fn kind(&self, object: &Object) -> &str {
        self.kinds.iter().find(|(_, kind)| *kind == object.kind).map_or("", |(name, _)| name)
    }

    fn colour(&self, object: &Object) -> &str {
        self.colours.iter().find(|(_, rgb)| is_same(rgb, &object.colour_rgb)).map_or("", |(name, _)| name)
    }
}

/// Whether two colours are equal bit for bit, so that a named colour keeps its name.
fn is_same(one: &[f64; 3], other: &[f64; 3]) -> bool {
    one.iter().zip(other).all(|(one, other)| one.to_bits() == other.to_bits())
}

struct Writer<'a> {
    catalogue: Catalogue,
    out: &'a mut String,
}

impl Writer<'_> {
    fn lesson(mut self, lesson: &Lesson) -> fmt::Result {
        let Lesson { title, watch, needs, seed, robot, teachers, noise, table_timing, .. } = lesson;
        writeln!(self.out, "title = {}\nwatch = {}\nseed = {seed}\n", text(title), text(watch))?;
        self.needs(needs)?;
        writeln!(self.out, "[noise]\nposition_sd_m = {}", number(noise.position_sd_m))?;
        writeln!(self.out, "confidence = {}\n", number(noise.confidence))?;
        writeln!(self.out, "[table_timing]\nempty_s = {}", seconds(table_timing.empty))?;
        writeln!(self.out, "occluders_first_s = {}", seconds(table_timing.occluders_first))?;
        writeln!(self.out, "keep_s = {}\n", seconds(table_timing.keep))?;
        writeln!(self.out, "[robot]\nposition_m = {}", numbers(&robot.position_m))?;
        writeln!(self.out, "heading_deg = {}\n", degrees(robot.heading_rad))?;
        for teacher in teachers {
            writeln!(self.out, "[[teacher]]\nnumber = {}", teacher.number)?;
            writeln!(self.out, "eyes_m = {}", numbers(&teacher.eyes_m))?;
            writeln!(self.out, "looks_at_m = {}\n", numbers(&teacher.looks_at_m))?;
        }
        self.catalogue()?;
        for table in &lesson.demonstrations {
            self.out.push_str("[[demonstration]]\n");
            self.table(table)?;
        }
        if let Some(table) = &lesson.novel {
            self.out.push_str("[novel]\n");
            self.table(table)?;
        }
        Ok(())
    }

    fn needs(&mut self, needs: &Needs) -> fmt::Result {
        let Needs { partners, depth, language, noise } = needs;
        if needs.is_empty() {
            return Ok(());
        }
        writeln!(self.out, "[needs]")?;
        if let Some(partners) = partners {
            writeln!(self.out, "partners = {partners}")?;
        }
        if let Some(depth) = depth {
            writeln!(self.out, "depth = {}", depth.get())?;
        }
        if let Some(language) = language {
            writeln!(self.out, "language = \"{}\"", language.word())?;
        }
        if let Some(noise) = noise {
            writeln!(self.out, "noise = {}", number(noise.get()))?;
        }
        writeln!(self.out)
    }

    fn catalogue(&mut self) -> fmt::Result {
        writeln!(self.out, "[colour]")?;
        for (name, rgb) in &self.catalogue.colours {
            writeln!(self.out, "{} = {}", text(name), numbers(rgb))?;
        }
        for (name, kind) in &self.catalogue.kinds {
            let role = kind.role.word();
            writeln!(self.out, "\n[kind.{}]\nrole = \"{role}\"", text(name))?;
            writeln!(self.out, "shape = {}", numbers(&kind.shape))?;
            writeln!(self.out, "half_extents_m = {}", numbers(&kind.half_extents_m))?;
            writeln!(self.out, "hole = {}\nmarkable = {}", kind.hole, kind.markable)?;
        }
        writeln!(self.out)
    }

    fn table(&mut self, table: &Table) -> fmt::Result {
        writeln!(self.out, "objects = [")?;
        for object in &table.objects {
            let ([x, y, z], [.., half_height_m]) = (object.place.position_m, object.kind.half_extents_m);
            let (kind, colour) = (text(self.catalogue.kind(object)), text(self.catalogue.colour(object)));
            write!(self.out, "  {{ name = {}, kind = {kind}, colour = {colour}, ", text(&object.name))?;
            write!(self.out, "position_m = {}", numbers(&[x, y]))?;
            underside(self.out, z - half_height_m)?;
            writeln!(self.out, ", heading_deg = {} }},", degrees(object.place.heading_rad))?;
        }
        writeln!(self.out, "]\noccluders = [")?;
        for Occluder { name, centre_m, half_extents_m } in &table.occluders {
            let corner = |sign: f64| {
                let mut corner = *centre_m;
                for (coordinate, half) in corner.iter_mut().zip(half_extents_m) {
                    *coordinate += sign * half;
                }
                numbers(&corner)
            };
            let name = text(name);
            writeln!(self.out, "  {{ name = {name}, from_m = {}, to_m = {} }},", corner(-1.0), corner(1.0))?;
        }
        writeln!(self.out, "]\nterritory = [")?;
        for territory in &table.territory {
            let (from, to) = (numbers(&territory.from_m), numbers(&territory.to_m));
            writeln!(self.out, "  {{ owner = {}, from_m = {from}, to_m = {to} }},", territory.owner)?;
        }
        writeln!(self.out, "]\nscript = [")?;
        for step in &table.script {
            self.step(step, table)?;
        }
        writeln!(self.out, "]\n")
    }

    fn step(&mut self, step: &Step, table: &Table) -> fmt::Result {
        let object = |index: usize| text(table.objects.get(index).map_or("", |object| &object.name));
        write!(self.out, "  {{ at_s = {}, who = {}, ", seconds(step.at), step.who)?;
        match &step.act {
            Act::Say(words) => write!(self.out, "say = {}", text(words))?,
            Act::Move { object: index, to, .. } => {
                write!(self.out, "move = {}", object(*index))?;
                match to {
                    Destination::Hole(block) => write!(self.out, ", into = {}", object(*block))?,
                    Destination::Top(below) => write!(self.out, ", onto = {}", object(*below))?,
                    Destination::UprightPose(place) => {
                        let half_m = table.objects.get(*index).map_or(0.0, |o| o.kind.half_extents_m[2]);
                        let [x, y, z] = place.position_m;
                        write!(self.out, ", to_m = {}", numbers(&[x, y]))?;
                        underside(self.out, z - half_m)?;
                        write!(self.out, ", heading_deg = {}", degrees(place.heading_rad))?;
                    }
                }
            }
            Act::Slide { occluder, centre_m: [x, y, _], .. } => {
                let name = table.occluders.get(*occluder).map_or("", |occluder| &occluder.name);
                write!(self.out, "slide = {}, to_m = {}", text(name), numbers(&[*x, *y]))?;
            }
            Act::Look { at_m, .. } => write!(self.out, "look_at_m = {}", numbers(at_m))?,
            Act::Walk { eyes_m, .. } => write!(self.out, "eyes_to_m = {}", numbers(eyes_m))?,
            Act::Leave => write!(self.out, "leave = true")?,
            Act::Return => write!(self.out, "return = true")?,
        }
        if !step.act.takes().is_zero() {
            write!(self.out, ", duration_s = {}", seconds(step.act.takes()))?;
        }
        writeln!(self.out, " }},")
    }
}

/// Writes the height of the underside above the table, unless the object stands on the table.
fn underside(out: &mut String, underside_m: f64) -> fmt::Result {
    if underside_m > 0.000_000_5 { write!(out, ", underside_m = {}", number(underside_m)) } else { Ok(()) }
}

fn text(text: &str) -> String {
    toml::Value::from(text).to_string()
}

fn number(value: f64) -> String {
    let written = format!("{value:.PLACES$}");
    let trimmed = written.trim_end_matches('0');
    let whole = if trimmed.ends_with('.') { "0" } else { "" };
    let written = format!("{trimmed}{whole}");
    if written == "-0.0" { "0.0".to_owned() } else { written }
}

fn numbers(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", "))
}

fn seconds(duration: Duration) -> String {
    number(duration.as_secs_f64())
}

fn degrees(angle_rad: f64) -> String {
    number(angle_rad.to_degrees())
}
