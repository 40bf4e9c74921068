//! Numbers as people read them: in notes, not in files.

/// A share in percent with two significant digits: `0.35 %`, `12 %`, `0.0021 %`.
pub fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share))
}

/// A number with two significant digits: `0.35`, `12`, `1,300`, `190,000`.
pub fn significant(x: f64) -> String {
    if !x.is_finite() || x == 0.0 {
        return format!("{x}");
    }
    // The power of ten after rounding: .0996 is .10.
    let power = format!("{:.1e}", x.abs()).split_once('e').and_then(|(_, power)| power.parse::<i32>().ok()).unwrap_or_default();
    if power < 1 {
        return format!("{x:.*}", usize::try_from(1 - power).unwrap_or_default());
    }
    let step = 10_f64.powi(power - 1);
    let digits = format!("{:.0}", (x.abs() / step).round() * step);
    let groups: Vec<&str> = digits.as_bytes().rchunks(3).rev().map(|group| std::str::from_utf8(group).expect("digits")).collect();
    format!("{}{}", if x < 0.0 { "-" } else { "" }, groups.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_digits_that_count() {
        for (x, text) in [
            (0.353_553, "0.35"),
            (1.0, "1.0"),
            (0.0, "0"),
            (9.96, "10"),
            (0.0996, "0.10"),
            (12.4, "12"),
            (1_340.0, "1,300"),
            (194_618.0, "190,000"),
            (-1_048_576.0, "-1,000,000"),
            (0.000_021, "0.000021"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(significant(x), text);
        }
        assert_eq!(percent(0.003_535_533_905_932_738), "0.35 %");
        assert_eq!(percent(1.0), "100 %");
    }
}
