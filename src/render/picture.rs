//! A picture in memory, and as an OpenEXR or PNG file.

use crate::numerics::cast::truncate_usize;
use crate::numerics::colour::{byte, srgb_byte};
use exr::prelude::{AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text, WritableImage};
use std::io::{Seek, Write};

/// What an OpenEXR or PNG file of [`super::render`] says of who made it.
pub const SOFTWARE: &str = concat!("biscale render ", env!("CARGO_PKG_VERSION"));

/// Share of the pixels with light in them that [`Picture::auto_exposure`] shows without cutting: highlights may be white. Chosen, not measured.
const BRIGHT: f64 = 0.995;

/// Radiance of every pixel, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Linear radiance.
    pub rgb: Vec<[f32; 3]>,
    /// Share of each pixel that objects cover.
    pub alpha: Vec<f32>,
}

impl Picture {
    /// A black one.
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = width as usize * height as usize;
        Self { width, height, rgb: vec![[0.0; 3]; pixels], alpha: vec![0.0; pixels] }
    }

    /// Writes a linear OpenEXR file: R, G, B in 32 bits, A where `with_alpha`; radiance is premultiplied by it, as OpenEXR wants.
    /// `comment` says how the picture was made. The same picture gives the same bytes.
    ///
    /// # Errors
    /// What `out` says.
    pub fn write_exr(&self, out: impl Write + Seek, with_alpha: bool, comment: &str) -> std::io::Result<()> {
        let text = |s: &str| Text::new_or_none(s).unwrap_or_default();
        let ascii: String = comment.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
        let mut attributes = LayerAttributes { software_name: Some(text(SOFTWARE)), ..LayerAttributes::default() };
        attributes.comments = Some(text(&ascii));
        attributes.other.insert(text("colour"), AttributeValue::Text(text("linear radiance, Rec. 709 primaries")));
        let plane = |c: usize| FlatSamples::F32(self.rgb.iter().map(|p| p[c]).collect());
        let mut channels: Vec<AnyChannel<FlatSamples>> =
            ["R", "G", "B"].iter().enumerate().map(|(c, name)| AnyChannel::new(text(name), plane(c))).collect();
        if with_alpha {
            channels.push(AnyChannel::new(text("A"), FlatSamples::F32(self.alpha.clone())));
        }
        let size = (self.width as usize, self.height as usize);
        let channels = AnyChannels::sort(channels.into_iter().collect());
        let image = Image::from_layer(Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels));
        image.write().to_buffered(out).map_err(|e| match e {
            exr::error::Error::Io(e) => e,
            other => std::io::Error::other(other),
        })
    }

    /// Share of the pixels that a screen cannot show at an exposure: a channel is brighter than white, and is cut.
    pub fn clipped(&self, exposure: f64) -> f64 {
        let white = (-exposure).exp2();
        let cut = self.rgb.iter().filter(|rgb| f64::from(brightest(**rgb)) > white).count();
        cut as f64 / self.rgb.len().max(1) as f64
    }

    /// The exposure, stops, at which [`BRIGHT`] of the pixels that are not black are no brighter than white; 0 for a black picture. A tenth of a stop
    /// is as fine as it is told.
    pub fn auto_exposure(&self) -> f64 {
        let mut levels: Vec<f32> = self.rgb.iter().map(|rgb| brightest(*rgb)).filter(|v| *v > 0.0).collect();
        if levels.is_empty() {
            return 0.0;
        }
        let place = truncate_usize(BRIGHT * (levels.len() - 1) as f64);
        let (_, level, _) = levels.select_nth_unstable_by(place, f32::total_cmp);
        (10.0 * -f64::from(*level).log2()).floor().clamp(-640.0, 640.0) / 10.0
    }

    /// What a screen is sent: radiance times `2^exposure`, clamped to 0..1, sRGB-encoded, in 8 bits; three bytes a pixel, or four
    /// with straight alpha.
    pub fn to_srgb(&self, exposure: f64, with_alpha: bool) -> Vec<u8> {
        let gain = exposure.exp2();
        let pixel = |(rgb, &alpha): (&[f32; 3], &f32)| {
            // Without alpha the pixel stands over black; with it the colour is that of the covered part.
            let over = if with_alpha && alpha > 0.0 { f64::from(alpha).min(1.0) } else { 1.0 };
            let [r, g, b] = rgb.map(|v| srgb_byte(gain * f64::from(v) / over));
            [r, g, b, byte(alpha.into())].into_iter().take(if with_alpha { 4 } else { 3 })
        };
        self.rgb.iter().zip(&self.alpha).flat_map(pixel).collect()
    }
}

/// The largest channel.
fn brightest(rgb: [f32; 3]) -> f32 {
    rgb.into_iter().fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn an_exr_file_gives_the_pixels_back_and_the_same_bytes_again() {
        let mut picture = Picture::new(3, 2);
        for (i, rgb) in picture.rgb.iter_mut().enumerate() {
            *rgb = [i as f32, 0.5, 1e-3 * i as f32];
        }
        let bytes = |picture: &Picture| {
            let mut out = Cursor::new(Vec::new());
            picture.write_exr(&mut out, true, "a test: 1°").unwrap();
            out.into_inner()
        };
        assert_eq!(bytes(&picture), bytes(&picture));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("p.exr");
        std::fs::write(&file, bytes(&picture)).unwrap();
        let raster = crate::image_file::read(&file).unwrap();
        assert_eq!((raster.width, raster.height), (3, 2));
        for (i, rgb) in picture.rgb.iter().enumerate() {
            assert_eq!(std::array::from_fn::<f32, 3, _>(|c| raster.channels[c][i]), *rgb);
        }
    }

    #[test]
    fn an_exposure_is_found_that_cuts_next_to_nothing() {
        let mut picture = Picture::new(100, 20);
        for (k, rgb) in picture.rgb.iter_mut().enumerate().skip(1000) {
            *rgb = [0.0, 0.004 * (k as f32 - 999.0), 0.001];
        }
        // The brightest is 4: half of the picture is black, a quarter of the rest darker than 1.
        assert!((picture.clipped(0.0) - 0.375).abs() < 2e-3, "{}", picture.clipped(0.0));
        let exposure = picture.auto_exposure();
        assert!((-2.1..=-1.9).contains(&exposure) && picture.clipped(exposure) <= 0.005, "{exposure}: {}", picture.clipped(exposure));
        assert!(picture.clipped(exposure + 0.2) > picture.clipped(exposure));
        assert_eq!((Picture::new(4, 4).auto_exposure(), Picture::new(4, 4).clipped(64.0)), (0.0, 0.0));
    }

    #[test]
    fn exposure_doubles_and_the_encoding_is_that_of_the_standard() {
        let mut picture = Picture::new(1, 1);
        picture.rgb[0] = [0.215_861, 0.107_93, 7.0];
        assert_eq!(picture.to_srgb(0.0, false), [128, 92, 255]);
        assert_eq!(picture.to_srgb(1.0, false)[1], 128);
        picture.alpha[0] = 0.5;
        assert_eq!(picture.to_srgb(-1.0, true)[0], 128);
        assert_eq!(picture.to_srgb(0.0, true)[3], 128);
    }
}
