use super::*;

#[test]
fn a_session_that_breaks_is_followed_by_another_one_until_nobody_wants_one() {
    let (mut opened, mut paused) = (0, 0);
    let open = || {
        opened += 1;
        Some(opened)
    };
    // The third one ends because nobody sends any more.
    let carry = |session| if session < 3 { Err("it was closed") } else { Ok(()) };
    let pause = || {
        paused += 1;
        true
    };
    keep(open, carry, pause);
    assert_eq!((opened, paused), (3, 2));
    // Nobody wants one while none can be opened, or after one broke.
    keep(|| None::<()>, |()| Err("is not opened"), || true);
    let mut carried = 0;
    keep(
        || Some(()),
        |()| {
            carried += 1;
            Err("it was closed")
        },
        || false,
    );
    assert_eq!(carried, 1);
}
