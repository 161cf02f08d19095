//! Two persons cross. One tracker confuses them and another does not: their detections are equal, their measures differ.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use evaluation::{ImageBox, Sequence};

/// The box of a person at a time in frames: one walks to the right and the other to the left.
fn person(number: u64, frame: u64) -> ImageBox {
    let way = quantity::number::float(frame) * 10.0;
    ImageBox { left: if number == 1 { way } else { 200.0 - way }, top: 0.0, width: 40.0, height: 100.0 }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut measured = Vec::new();
    for confuses in [false, true] {
        let mut sequence = Sequence::default();
        for frame in 0..20 {
            let objects = [1, 2].map(|number| (number, person(number, frame)));
            let is_turned = confuses && frame >= 10;
            let hypotheses = objects.map(|(number, at)| (if is_turned { 3 - number } else { number }, at));
            sequence.add(&objects, &hypotheses, ImageBox::iou)?;
        }
        let (clear, identity, hota) = (sequence.clear_mot(0.5), sequence.identity(0.5), sequence.hota());
        let measures = [clear.mota(), identity.idf1(), hota.hota()].map(Option::unwrap_or_default);
        let [mota, idf1, all] = measures;
        println!("confuses: {confuses:<5} MOTA {mota:.3} IDF1 {idf1:.3} HOTA {all:.3}");
        measured.push(measures);
    }
    assert_eq!(measured.first(), Some(&[1.0, 1.0, 1.0]));
    assert_eq!(measured.last().map(|[_, idf1, _]| *idf1 < 0.6), Some(true));
    Ok(())
}
