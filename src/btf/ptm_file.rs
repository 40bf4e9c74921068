//! Polynomial texture maps as files: PTM 1.2 of Hewlett-Packard, formats `LRGB` and `RGB`.
//!
//! Lines: `PTM_1.2`, the format, width, height, six scales, six biases; then bytes, rows from bottom to top. A coefficient is `(byte - bias) scale`, for values of 0..255. `LRGB`:
//! six bytes a texel, then its colour, three bytes; a value is colour times polynomial over 255. `RGB`: six bytes a texel for red, then all of green, then all of blue.

use super::ptm::{Ptm, PtmColours, TERMS};
use crate::error::{BadInput, Error, Result};
use crate::numerics::cast::{narrow, truncate_i32, truncate_u8};
use std::io::{self, Write};

/// Largest value in a file.
const WHITE: f64 = 255.0;
/// Most texels of a file that is read. Chosen, not measured: the largest cameras have a tenth.
const MOST_TEXELS: usize = 1 << 30;
/// Characters of the head, at most.
const MOST_HEAD: usize = 1 << 12;

/// How coefficients become bytes: over the whole map the least one is byte 0 and the largest byte 255.
struct Scales {
    scale: [f64; TERMS],
    bias: [i32; TERMS],
}

impl Scales {
    fn of<'a>(coefficients: impl Iterator<Item = &'a [f64; TERMS]>) -> Self {
        let (mut low, mut high) = ([0.0_f64; TERMS], [0.0_f64; TERMS]);
        for own in coefficients {
            for k in 0..TERMS {
                (low[k], high[k]) = (low[k].min(own[k]), high[k].max(own[k]));
            }
        }
        // A constant one must not divide by 0; the bias is a whole number, so that the ends move by less than a step.
        let scale = std::array::from_fn(|k| ((high[k] - low[k]) / 254.0).max(1e-6));
        Self { scale, bias: std::array::from_fn(|k: usize| truncate_i32((-low[k] / scale[k]).round())) }
    }

    fn bytes(&self, own: &[f64; TERMS]) -> [u8; TERMS] {
        std::array::from_fn(|k| truncate_u8((own[k] / self.scale[k] + f64::from(self.bias[k])).round().clamp(0.0, 255.0)))
    }

    fn value(&self, k: usize, byte: u8) -> f64 {
        (f64::from(byte) - f64::from(self.bias[k])) * self.scale[k]
    }
}

impl Ptm {
    /// Writes a PTM 1.2 file, of values that are 1 where a viewer's screen is white.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, mut out: impl Write) -> io::Result<()> {
        let [width, height] = self.texels;
        let upward = || (0..height).rev().flat_map(|row| row * width..(row + 1) * width);
        let levels = |own: &[f32; TERMS], factor: f64| own.map(|a| f64::from(a) * factor);
        let head = |out: &mut dyn Write, format: &str, scales: &Scales| {
            let line = |of: Vec<String>| of.join(" ");
            writeln!(out, "PTM_1.2\nPTM_FORMAT_{format}\n{width}\n{height}")?;
            writeln!(out, "{}", line(scales.scale.iter().map(|s| format!("{s:.9}")).collect()))?;
            writeln!(out, "{}", line(scales.bias.iter().map(i32::to_string).collect()))
        };
        match &self.colours {
            PtmColours::Rgb(of) => {
                let channels: Vec<Vec<[f64; TERMS]>> = (0..3).map(|c| of.iter().map(|own| levels(&own[c], WHITE)).collect()).collect();
                let scales = Scales::of(channels.iter().flatten());
                head(&mut out, "RGB", &scales)?;
                for channel in &channels {
                    out.write_all(&upward().flat_map(|t| scales.bytes(&channel[t])).collect::<Vec<u8>>())?;
                }
            }
            PtmColours::Luminance { coefficients, colour } => {
                // The colour's brightest channel is 255, so that its bytes tell it best.
                let brightest = |c: &[f32; 3]| f64::from(c.iter().copied().fold(0.0, f32::max));
                let of: Vec<[f64; TERMS]> = coefficients.iter().zip(colour).map(|(own, c)| levels(own, WHITE * brightest(c))).collect();
                let scales = Scales::of(of.iter());
                head(&mut out, "LRGB", &scales)?;
                out.write_all(&upward().flat_map(|t| scales.bytes(&of[t])).collect::<Vec<u8>>())?;
                let byte =
                    |c: f32, top: f64| if top > 0.0 { truncate_u8((WHITE * f64::from(c) / top).round().clamp(0.0, 255.0)) } else { 0 };
                out.write_all(&upward().flat_map(|t| colour[t].map(|c| byte(c, brightest(&colour[t])))).collect::<Vec<u8>>())?;
            }
        }
        out.flush()
    }

    /// Reads the bytes of a PTM file, 1.2 or 1.1 (whose colours stand beside each texel's coefficients), `LRGB` or `RGB`.
    ///
    /// # Errors
    /// Bad input: another format, a head that is none, too few bytes.
    pub fn read(bytes: &[u8]) -> Result<Self> {
        let mut head = Head { bytes, at: 0 };
        let version = head.word()?;
        if version != "PTM_1.2" && version != "PTM_1.1" {
            return Err(bad(format!("a PTM file begins with PTM_1.2, and this one with \"{version}\""), "name a PTM file"));
        }
        let format = head.word()?;
        let is_rgb = match &*format {
            "PTM_FORMAT_RGB" => true,
            "PTM_FORMAT_LRGB" => false,
            other => return Err(bad(format!("the format {other} is not read"), "convert it to LRGB or RGB")),
        };
        let mut size = || head.number::<usize>("a width or height");
        let (width, height) = (size()?, size()?);
        let count = width.checked_mul(height).filter(|n| (1..=MOST_TEXELS).contains(n));
        let Some(count) = count else { return Err(bad(format!("{width} x {height} texels"), "use a map of at most 2^30 texels")) };
        let (mut scale, mut bias) = ([0.0; TERMS], [0; TERMS]);
        for scale in &mut scale {
            *scale = head.number::<f64>("a scale")?;
            if !scale.is_finite() {
                return Err(bad(format!("\"{scale}\" stands where a scale should"), "the head of the file is damaged"));
            }
        }
        for bias in &mut bias {
            // Some programs write whole numbers with a fraction of 0.
            *bias = truncate_i32(head.number::<f64>("a bias")?.round());
        }
        let scales = Scales { scale, bias };
        let data = head.data()?;
        let needed = count * if is_rgb { 3 * TERMS } else { TERMS + 3 };
        if data.len() < needed {
            return Err(bad(
                format!("{} bytes of texels, and {width} x {height} need {needed}", data.len()),
                "the file is cut off: copy it again",
            ));
        }
        let row_upward = |texel: usize| (height - 1 - texel / width) * width + texel % width;
        let own = |from: usize| -> [f32; TERMS] { std::array::from_fn(|k| narrow(scales.value(k, data[from + k]) / WHITE)) };
        let colours = if is_rgb {
            PtmColours::Rgb((0..count).map(|t| [0, 1, 2].map(|c| own((c * count + row_upward(t)) * TERMS))).collect())
        } else {
            let is_beside = version == "PTM_1.1";
            let place = |t: usize| if is_beside { row_upward(t) * (TERMS + 3) } else { row_upward(t) * TERMS };
            let colour = |t: usize| if is_beside { place(t) + TERMS } else { count * TERMS + row_upward(t) * 3 };
            PtmColours::Luminance {
                coefficients: (0..count).map(|t| own(place(t))).collect(),
                colour: (0..count).map(|t| [0, 1, 2].map(|c| f32::from(data[colour(t) + c]) / 255.0)).collect(),
            }
        };
        Ok(Self { texels: [width, height], colours })
    }
}

fn bad(what: String, remedy: &str) -> Error {
    BadInput::new(what, remedy).into()
}

/// The words before the bytes.
struct Head<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Head<'_> {
    fn word(&mut self) -> Result<String> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let begin = rest.iter().take(MOST_HEAD).position(|b| !b.is_ascii_whitespace());
        let Some(begin) = begin else { return Err(bad("the head ends too soon".to_owned(), "the file is cut off: copy it again")) };
        let length = rest[begin..].iter().take(MOST_HEAD).position(u8::is_ascii_whitespace);
        let Some(length) = length else { return Err(bad("the head ends too soon".to_owned(), "the file is cut off: copy it again")) };
        self.at += begin + length;
        Ok(String::from_utf8_lossy(&rest[begin..begin + length]).into_owned())
    }

    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T> {
        let word = self.word()?;
        word.parse().map_err(|_| bad(format!("\"{word}\" stands where {what} should"), "the head of the file is damaged"))
    }

    /// What follows the line in which the last word stands.
    fn data(&self) -> Result<&[u8]> {
        let rest = &self.bytes[self.at..];
        let line = rest.iter().position(|&b| b == b'\n').filter(|&end| rest[..end].iter().all(u8::is_ascii_whitespace));
        // Bytes may be blanks themselves: only one line end belongs to the head.
        line.map(|end| &rest[end + 1..]).ok_or_else(|| bad("no line ends behind the biases".to_owned(), "the head of the file is damaged"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn map(luminance: bool) -> Ptm {
        let own = |t: usize| -> [f32; TERMS] { std::array::from_fn(|k| 0.3 / (1 + k) as f32 - 0.02 * (t % 5) as f32) };
        let colours = if luminance {
            let colour = (0..12).map(|t| [0.9, 0.1 * (t % 7) as f32, 0.4]).collect();
            PtmColours::Luminance { coefficients: (0..12).map(own).collect(), colour }
        } else {
            PtmColours::Rgb((0..12).map(|t| [own(t), own(t + 1), [0.0; TERMS]]).collect())
        };
        Ptm { texels: [4, 3], colours }
    }

    #[test]
    fn a_file_decodes_to_the_map_within_its_bytes() {
        for luminance in [false, true] {
            let map = map(luminance);
            let mut bytes = Vec::new();
            map.write(&mut bytes).unwrap();
            let read = Ptm::read(&bytes).unwrap();
            for light in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.3, 0.5, 0.8).normalize()] {
                for (a, b) in map.image(light).iter().flatten().zip(read.image(light).iter().flatten()) {
                    assert!((a - b).abs() < 0.012, "{a} {b}");
                }
            }
            // Every length, and every byte of the head otherwise: an error or a map, never a panic.
            for length in 0..bytes.len() {
                assert!(Ptm::read(&bytes[..length]).is_err());
            }
            for k in 0..80 {
                let mut other = bytes.clone();
                other[k] ^= 0x15;
                let _ = Ptm::read(&other);
            }
        }
        assert!(Ptm::read(b"PTM_1.2\nPTM_FORMAT_LUT\n1\n1\n").unwrap_err().to_string().contains("PTM_FORMAT_LUT"));
    }
}
