use std::mem::MaybeUninit;

/// Whether a time service synchronises the wall clock, according to the kernel (adjtimex(2)); `None` if it cannot be
/// queried.
#[must_use]
pub fn is_wall_clock_synchronised() -> Option<bool> {
    let mut state = MaybeUninit::<libc::timex>::zeroed();
    // SAFETY: `state` is valid for reads and writes of one `timex`, and its mode of zero changes nothing.
    if unsafe { libc::adjtimex(state.as_mut_ptr()) } < 0 {
        return None;
    }
    // SAFETY: we zeroed it, and zero is a value of each of its fields, which are all integers.
    let state = unsafe { state.assume_init() };
    Some(state.status & libc::STA_UNSYNC == 0)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_kernel_reports_whether_the_clock_is_synchronised() {
        assert!(super::is_wall_clock_synchronised().is_some());
    }
}
