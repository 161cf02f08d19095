use std::fmt;

use message::Feature;

/// A belief distance function d with its applicability q (Eq. 4), for `measure = { plugin = "NAME" }`.
///
/// ```
/// use belief::Distance;
/// use message::Feature;
///
/// /// Horizontal distance of two positions; the height does not count.
/// struct AlongTheFloor;
///
/// impl Distance for AlongTheFloor {
///     fn between(&self, one: &Feature, other: &Feature) -> Option<f64> {
///         let (Feature::Vector([x, y, _]), Feature::Vector([u, v, _])) = (one, other) else { return None };
///         Some(f64::from((x - u).hypot(y - v)))
///     }
/// }
///
/// let (low, high) = (Feature::Vector([1.0, 0.0, 0.0]), Feature::Vector([1.0, 0.5, 9.0]));
/// assert_eq!(AlongTheFloor.between(&low, &high), Some(0.5));
/// assert_eq!(AlongTheFloor.between(&low, &Feature::Symbol(3)), None);
/// ```
pub trait Distance: Send + Sync {
    /// d of the term's percept for two beliefs; `None` (q = 0) if the function does not apply. The result must depend
    /// on the two features only. They are passed in a canonical order, independent of the order of the beliefs, so D is
    /// symmetric.
    ///
    /// A distance must not be negative, so that D is never below any other of its terms and the position gate stays
    /// valid. A negative or NaN result means that the two beliefs cannot merge. Must not allocate.
    fn between(&self, one: &Feature, other: &Feature) -> Option<f64>;
}

/// Only says that there is one: a plug-in function has no contents to show.
impl fmt::Debug for dyn Distance {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("Supplied")
    }
}
