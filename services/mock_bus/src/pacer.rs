use clock::{Duration, Instant};

/// Computes when a reply would have arrived over a real bus of a given baud rate, since a pseudo-terminal does not pace
/// bytes.
#[derive(Clone, Copy, Debug)]
pub struct Pacer {
    pub(crate) baud: u32,
    /// The time at which the bus is free again.
    free_at: Instant,
}

impl Pacer {
    /// A bus of `baud` bits per second.
    #[must_use]
    pub const fn new(baud: u32) -> Self {
        Self { baud, free_at: Instant::EPOCH }
    }

    /// The time at which the last byte of a reply of `said` bytes may leave. It follows an instruction of `heard` bytes
    /// written at `at`, after a return delay of `delay`. A byte takes ten bits; bytes already on the bus come first.
    pub fn departure_at(&mut self, at: Instant, heard: usize, delay: Duration, said: usize) -> Instant {
        let bits = u64::try_from(10 * (heard + said)).unwrap_or(u64::MAX);
        let on_wire = Duration::from_nanos(bits.saturating_mul(1_000_000_000) / u64::from(self.baud.max(1)));
        self.free_at = self.free_at.max(at) + on_wire + delay;
        self.free_at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn us(micros: u64) -> Instant {
        Instant::EPOCH + Duration::from_micros(micros)
    }

    #[test]
    fn bytes_arrive_one_after_the_other_at_the_line_speed() {
        let mut pacer = Pacer::new(1_000_000);
        assert_eq!(pacer.departure_at(us(1000), 14, Duration::ZERO, 15), us(1290));
        assert_eq!(pacer.departure_at(us(1100), 10, Duration::from_micros(500), 0), us(1890));
        assert_eq!(pacer.departure_at(us(5000), 10, Duration::ZERO, 0), us(5100));
    }
}
