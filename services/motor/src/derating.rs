use crate::job::{ServoLimits, Supply};

/// Derating begins this far below the temperature limit of a servo ...
const WARM_C: f64 = 12.0;
/// ... and stops the joint this far below it, before the servo shuts down.
const HOT_C: f64 = 2.0;
/// Derating begins below this share of the range from the minimum voltage to the nominal voltage.
const LOW_VOLTAGE_SHARE: f64 = 0.4;
/// Derating ends this much further from both bounds, so that it does not toggle.
const HYSTERESIS_C: f64 = 3.0;
const HYSTERESIS_SHARE: f64 = 0.1;

/// Derating factor of the speed of a servo: 1 is full speed, 0 is hold. `was_derated`: whether it was derated before.
pub(crate) fn derating(supply: Supply, bounds: ServoLimits, nominal_v: f64, was_derated: bool) -> f64 {
    let (more_c, more) = if was_derated { (HYSTERESIS_C, HYSTERESIS_SHARE) } else { (0.0, 0.0) };
    let below_c = f64::from(bounds.temperature_c) - f64::from(supply.temperature_c);
    let cool = (below_c - HOT_C) / (WARM_C + more_c - HOT_C);
    let spare_v = (LOW_VOLTAGE_SHARE + more) * (nominal_v - f64::from(bounds.min_v));
    let fed = (f64::from(supply.input_v) - f64::from(bounds.min_v)) / spare_v;
    // A minimum voltage above the nominal voltage is set for another supply, whose range is unknown. Below it the
    // servo reports an error itself.
    let fed = if spare_v > 0.0 { fed } else { 1.0 };
    // A bound without meaning (NaN) limits nothing.
    [cool, fed].into_iter().filter(|share| !share.is_nan()).fold(1.0, f64::min).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds(min_v: f32) -> ServoLimits {
        ServoLimits { temperature_c: 80.0, min_v, velocity_rad_s: 4.0, pwm: 885, goal_duty: 885 }
    }

    fn share(temperature_c: f32, input_v: f32) -> f64 {
        let supply = Supply { temperature_c, input_v };
        derating(supply, bounds(9.5), 12.0, false)
    }

    #[test]
    fn a_servo_is_derated_before_it_would_shut_down() {
        assert!((share(40.0, 12.0) - 1.0).abs() < 1e-9);
        assert!((share(68.0, 12.0) - 1.0).abs() < 1e-9);
        assert!((share(73.0, 12.0) - 0.5).abs() < 1e-9);
        assert!(share(78.0, 12.0).abs() < 1e-9);
        assert!(share(90.0, 12.0).abs() < 1e-9);
        assert!((share(40.0, 10.0) - 0.5).abs() < 1e-6);
        assert!(share(40.0, 9.0).abs() < 1e-9);
        assert!((share(f32::NAN, f32::NAN) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_servo_at_the_limit_is_derated_without_flapping() {
        // The temperature alternates by one degree.
        let mut is_derated = false;
        let mut changes = 0;
        for step in 0..100_u8 {
            let temperature_c = if step % 2 == 0 { 67.5 } else { 68.5 };
            let supply = Supply { temperature_c, input_v: 12.0 };
            let was_derated = is_derated;
            is_derated = derating(supply, bounds(9.5), 12.0, was_derated) < 1.0;
            changes += u32::from(was_derated != is_derated);
        }
        assert_eq!((is_derated, changes), (true, 1));
        let cool = Supply { temperature_c: 64.9, input_v: 12.0 };
        assert!((derating(cool, bounds(9.5), 12.0, true) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_minimum_voltage_above_the_nominal_voltage_disables_derating() {
        // Four cells in series, and a limit that keeps them from deep discharge.
        for min_v in [12.0, 13.0, 14.9] {
            let supply = Supply { temperature_c: 40.0, input_v: 14.8 };
            let share = derating(supply, bounds(min_v), 12.0, false);
            assert!((share - 1.0).abs() < 1e-9, "{share} at a limit of {min_v} V");
        }
    }
}
