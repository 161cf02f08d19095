//! `leo study` over the real processes.

use serde_json::Value;

use crate::house::tell;

#[test]
fn the_study_comes_out_as_in_the_paper_in_every_cell() {
    let told = tell(&["study", "--json"]);
    assert_eq!((told.status, told.err.as_str()), (Some(0), ""), "{told:?}");
    let study: Value = serde_json::from_str(&told.out).expect("is JSON");
    let cells = study.pointer("/cells").and_then(Value::as_array).expect("a list");
    assert_eq!(cells.len(), 8);
    for cell in cells {
        assert_eq!(cell.pointer("/differs"), Some(&Value::Array(Vec::new())), "{cell}");
    }
    let tests = study.pointer("/chi_square").and_then(Value::as_array).expect("a list");
    assert!(tests.iter().all(|test| test.pointer("/p").and_then(Value::as_f64).is_some_and(|p| p < 0.001)));
}
