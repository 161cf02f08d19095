//! The CSV of the MOT Challenge: `frame,id,x,y,w,h,conf,…`, for true objects, detections and hypotheses.

use std::collections::BTreeSet;
use std::io::BufRead;
use std::str::FromStr;

use evaluation::ImageBox;

use super::error::{FieldError, InputError, read_lines};

/// The last frame that is read: eleven hours at 25 Hz. The frames between two lines are made, so one line must not make
/// millions.
const MAX_FRAME: u32 = 1_000_000;
/// Maximum absolute coordinate and side, in pixels.
const MAX_PIXELS: f64 = 1.0e6;

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    /// The number of the frame, from 1.
    pub(super) frame: u32,
    /// The identity; -1 in a detection.
    pub(super) id: i64,
    /// In pixels, from the upper left corner of the picture.
    pub(super) place: ImageBox,
    /// Of a true object: 0 leaves it out. Of a detection: the detector's score.
    pub(super) confidence: f64,
}

/// Reads the lines in the order of the file. The columns behind the seventh are not used.
pub(super) fn read(from: impl BufRead, name: &str) -> Result<Vec<Row>, InputError> {
    let mut rows = Vec::new();
    read_lines(from, name, |text, _line| {
        rows.push(row(text)?);
        Ok(u64::try_from(size_of::<Row>()).unwrap_or(u64::MAX))
    })?;
    Ok(rows)
}

fn row(text: &[u8]) -> Result<Row, FieldError> {
    let text = std::str::from_utf8(text).map_err(|_| FieldError::new("line", "it is not text"))?;
    let mut columns = text.split(',').map(str::trim);
    let frame: f64 = number(&mut columns, "frame")?;
    let id: f64 = number(&mut columns, "id")?;
    let [left, top] = [pixels(&mut columns, "x")?, pixels(&mut columns, "y")?];
    let [width, height] = [pixels(&mut columns, "w")?, pixels(&mut columns, "h")?];
    let confidence: f64 = number(&mut columns, "conf")?;
    for (side, column) in [(width, "w"), (height, "h")] {
        if side <= 0.0 {
            return Err(FieldError::new(column, format!("it is {side}: a side of a box is above 0")));
        }
    }
    let frame = whole(frame)
        .and_then(|frame| u32::try_from(frame).ok())
        .filter(|frame| (1..=MAX_FRAME).contains(frame));
    let frame = frame.ok_or_else(|| {
        FieldError::new("frame", format!("give the number of the frame, from 1 to {MAX_FRAME}"))
    })?;
    let id = whole(id).ok_or_else(|| FieldError::new("id", "give a whole number, or -1 for none"))?;
    Ok(Row { frame, id, place: ImageBox { left, top, width, height }, confidence })
}

/// Programs write whole numbers as `3` and as `3.0`.
fn whole(number: f64) -> Option<i64> {
    (number.fract() == 0.0 && number.abs() < 1.0e15).then(|| quantity::number::round_i64(number))
}

fn number<'a, T: FromStr>(
    columns: &mut impl Iterator<Item = &'a str>,
    column: &str,
) -> Result<T, FieldError> {
    let text = columns.next().ok_or_else(|| {
        FieldError::new(column, "the column is missing: a line is frame,id,x,y,w,h,conf and more")
    })?;
    text.parse().map_err(|_| FieldError::new(column, format!("`{text}` is not a number")))
}

/// NaN fails the comparison.
fn pixels<'a>(columns: &mut impl Iterator<Item = &'a str>, column: &str) -> Result<f64, FieldError> {
    let pixels: f64 = number(columns, column)?;
    let is_valid = pixels.abs() <= MAX_PIXELS;
    is_valid
        .then_some(pixels)
        .ok_or_else(|| FieldError::new(column, format!("it is {pixels}: give pixels, up to {MAX_PIXELS}")))
}

/// The true objects among the lines: those whose `conf` is not 0. Their identities must be whole numbers from 0, each
/// once in a frame.
pub(super) fn true_objects(rows: &[Row], name: &str) -> Result<Vec<(u64, Row)>, InputError> {
    let mut seen = BTreeSet::new();
    let mut objects = Vec::new();
    for row in rows.iter().filter(|row| row.confidence != 0.0) {
        let wrong = |reason| InputError::Content { name: name.to_owned(), reason };
        let id = u64::try_from(row.id).map_err(|_| {
            wrong(format!("frame {} has the identity {}: a true object has one from 0", row.frame, row.id))
        })?;
        if !seen.insert((row.frame, id)) {
            return Err(wrong(format!("frame {} has object {id} twice", row.frame)));
        }
        objects.push((id, *row));
    }
    Ok(objects)
}

/// A line with a hypothesis.
pub(super) fn line(frame: u64, id: u64, place: &ImageBox) -> String {
    let ImageBox { left, top, width, height } = place;
    format!("{frame},{id},{left},{top},{width},{height},1,-1,-1,-1\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn true_objects_and_detections_are_read() {
        let text = "1,2,282,201,92,184,1,-1,-1,-1\n\n 2 , -1.0, 56.5, 144.25, 93.5, 295, 0.99\n3,4,1,1,1,1,0,7,0.5\n";
        let rows = read(text.as_bytes(), "gt.txt").unwrap();
        let read: Vec<_> =
            rows.iter().map(|row| (row.frame, row.id, row.place.left, row.confidence)).collect();
        assert_eq!(read, [(1, 2, 282.0, 1.0), (2, -1, 56.5, 0.99), (3, 4, 1.0, 0.0)]);
        assert_eq!(true_objects(&rows[..1], "gt.txt").unwrap(), [(2, rows[0])]);
        assert!(true_objects(&rows[2..], "gt.txt").unwrap().is_empty(), "left out by its conf");
        let again = line(1, 2, &rows[0].place);
        assert_eq!(super::read(again.as_bytes(), "again").unwrap()[0].place, rows[0].place);
    }

    #[test]
    fn invalid_lines_name_the_column() {
        let mut wording = String::new();
        for (text, column) in [
            ("1,2,3", "y"),
            ("0,1,1,1,1,1,1", "frame"),
            ("1.5,1,1,1,1,1,1", "frame"),
            ("2000000,1,1,1,1,1,1", "frame"),
            ("1,one,1,1,1,1,1", "id"),
            ("1,1,NaN,1,1,1,1", "x"),
            ("1,1,1,1e9,1,1,1", "y"),
            ("1,1,1,1,-1,1,1", "w"),
            ("1,1,1,1,1,0,1", "h"),
            ("frame,id,x,y,w,h,conf", "frame"),
        ] {
            let error = read(text.as_bytes(), "gt.txt").unwrap_err();
            let is_named =
                matches!(&error, InputError::Line { line: 1, field, .. } if *field == format!("{column}: "));
            assert!(is_named, "{text}: {error}");
            wording += &format!("{error}\n");
        }
        for text in ["1,-1,1,1,1,1,1", "1,4,1,1,1,1,1\n1,4,2,1,1,1,1"] {
            let rows = read(text.as_bytes(), "gt.txt").unwrap();
            wording += &format!("{}\n", true_objects(&rows, "gt.txt").unwrap_err());
        }
        insta::assert_snapshot!(wording);
    }
}
