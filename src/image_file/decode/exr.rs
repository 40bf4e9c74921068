//! `OpenEXR`: the layer that holds what is wanted, laid into the display window.

use super::common::{MAX_BYTES, unreadable};
use crate::error::BadInput;
use crate::image_file::raster::{Raster, check_size};
use ::exr::image::{AnyChannel, AnyChannels, FlatSamples, Layer};
use ::exr::meta::attribute::{IntegerBounds, Text};
use ::exr::prelude::{ReadChannels, ReadLayers};
use std::io::Cursor;

/// What a file is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// The channels R, G and B, else the only one, else Z or Y.
    Colour,
    /// Z, in whichever layer it is; else as a colour.
    Heights,
    /// As a colour; light is 0 where the display window has no data.
    Radiance,
}

/// Decodes an EXR file. Pixels of the display window that have no data are NaN, or 0 for radiance; data outside of the window are left away.
pub fn exr(bytes: &[u8], wanted: Wanted) -> Result<Raster, BadInput> {
    let meta = ::exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| unreadable("EXR", e))?;
    let mut all_samples = 0_u64;
    for header in &meta.headers {
        let (size, shown) = (header.layer_size, header.shared_attributes.display_window.size);
        check_size(size.width() as u64, size.height() as u64)?;
        check_size(shown.width() as u64, shown.height() as u64)?;
        let samples = (size.width() as u64 * size.height() as u64).saturating_mul(header.channels.list.len() as u64);
        // All parts are allocated at once where one of several is looked for.
        all_samples = all_samples.saturating_add(samples);
        if all_samples.saturating_mul(4) > MAX_BYTES {
            let channels: usize = meta.headers.iter().map(|h| h.channels.list.len()).sum();
            return Err(BadInput::new(
                format!("the EXR has {channels} channels in {} parts", meta.headers.len()),
                "keep those that are needed",
            ));
        }
    }
    let reader = || ::exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    let heights_apart =
        wanted == Wanted::Heights && meta.headers.iter().skip(1).any(|h| h.channels.list.iter().any(|c| is_height(&c.name)));
    let (layer, window) = if heights_apart {
        let image =
            reader().all_layers().all_attributes().non_parallel().from_buffered(Cursor::new(bytes)).map_err(|e| unreadable("EXR", e))?;
        let window = image.attributes.display_window;
        let holds = |layer: &Layer<AnyChannels<FlatSamples>>| layer.channel_data.list.iter().any(|c| is_height(&c.name));
        let layer = image.layer_data.into_iter().find(holds).ok_or_else(|| unreadable("EXR", "a layer with the channel Z is lacking"))?;
        (layer, window)
    } else {
        let image = reader()
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
            .map_err(|e| unreadable("EXR", e))?;
        (image.layer_data, image.attributes.display_window)
    };
    let outside = if wanted == Wanted::Radiance { 0.0 } else { f32::NAN };
    let data = IntegerBounds::new(layer.attributes.layer_position, layer.size);
    let values = |c: &AnyChannel<FlatSamples>| -> Result<Vec<f32>, BadInput> {
        let values: Vec<f32> = c.sample_data.values_as_f32().collect();
        if values.len() != data.size.area() {
            return Err(unreadable("EXR", "a channel is subsampled"));
        }
        Ok(if data == window { values } else { laid_into(&values, data, window, outside) })
    };
    let channels = chosen(&layer.channel_data.list, wanted)?.into_iter().map(values).collect::<Result<_, _>>()?;
    let alpha = layer.channel_data.list.iter().find(|c| c.name.eq("A")).map(values).transpose()?;
    Ok(Raster { width: window.size.width(), height: window.size.height(), channels, alpha, integer: false })
}

/// Whether a channel is Z, in any layer: `depth.Z` is.
fn is_height(name: &Text) -> bool {
    name.to_string().rsplit('.').next() == Some("Z")
}

/// The channels that are wanted.
fn chosen(channels: &[AnyChannel<FlatSamples>], wanted: Wanted) -> Result<Vec<&AnyChannel<FlatSamples>>, BadInput> {
    let named = |name: &str| channels.iter().find(|c| c.name.eq(name));
    let height = channels.iter().find(|c| is_height(&c.name)).filter(|_| wanted == Wanted::Heights);
    Ok(match (height, named("R"), named("G"), named("B"), channels) {
        (Some(height), ..) => vec![height],
        (_, Some(r), Some(g), Some(b), _) => vec![r, g, b],
        (.., [only]) => vec![only],
        _ => match named("Z").or(named("Y")) {
            Some(channel) => vec![channel],
            None => {
                let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
                let problem = format!("the EXR has the channels {}", names.join(", "));
                return Err(BadInput::new(problem, "name one Z or Y, or three R, G and B"));
            }
        },
    })
}

/// Values of the window `data` in the window `shown`.
fn laid_into(values: &[f32], data: IntegerBounds, shown: IntegerBounds, outside: f32) -> Vec<f32> {
    let offset = [shown.position.x(), shown.position.y()].map(i64::from);
    let origin = [data.position.x(), data.position.y()].map(i64::from);
    let at = |k: usize, axis: usize, size: usize| {
        let place = i64::try_from(k).expect("at most MAX_PIXELS") + offset[axis] - origin[axis];
        usize::try_from(place).ok().filter(|&place| place < size)
    };
    let mut laid = Vec::with_capacity(shown.size.area());
    for row in 0..shown.size.height() {
        for column in 0..shown.size.width() {
            let place = at(row, 1, data.size.height()).zip(at(column, 0, data.size.width()));
            laid.push(place.map_or(outside, |(row, column)| values[row * data.size.width() + column]));
        }
    }
    laid
}
