//! Tints, layers and normal maps of objects, as a scene file describes them.

use super::super::layers::{Blend, Covering, Layer, Mask, Tint};
use super::super::mapping::Projection;
use super::super::normal_map::NormalMap;
use super::super::shapes::Plane;
use super::super::texture::{Texture, Wrap};
use super::fields::{LENGTH, required};
use super::material::SceneMaterials;
use super::shape::{Shape, plane_frame};
use crate::error::Result;
use crate::image_file::{MaskChannel, MaskEncoding, PlainImage, read_mask, read_normals, read_tint};
use crate::toml_reader::{TableReader, range};
use glam::DVec3;

/// Most layers of an object.
///
/// Chosen, not measured: every place looks up the masks of all of them.
const MAX_LAYERS: usize = 16;
/// Largest relative difference of the aspect of a mask from that of the place that it is projected to: a pixel of a hundred.
const ASPECT_TOLERANCE: f64 = 0.01;
/// By how much a mask may add to a sum over 1: what rounding to 8 bits adds.
const SUM_TOLERANCE: f32 = 0.5 / 255.0;

const BLENDS: [(&str, Blend); 2] = [("over", Blend::Over), ("sum", Blend::Sum)];
const CHANNELS: [(&str, MaskChannel); 2] = [("grey", MaskChannel::Grey), ("alpha", MaskChannel::Alpha)];
const ENCODINGS: [(&str, MaskEncoding); 2] = [("linear", MaskEncoding::Linear), ("srgb", MaskEncoding::Srgb)];
const WRAPS: [(&str, Wrap); 3] = [("repeat", Wrap::Repeat), ("clamp", Wrap::Clamp), ("none", Wrap::Zero)];
/// Keys of a projection that is planar.
const PLANAR_KEYS: [&str; 4] = ["mask_center", "mask_normal", "mask_x_axis", "mask_size"];

/// What a word stands for.
fn word<T: Copy>(table: &TableReader<'_>, key: &'static str, words: &[(&str, T)]) -> Result<Option<T>> {
    let names: Vec<&str> = words.iter().map(|w| w.0).collect();
    Ok(table.choice(key, &names)?.map(|k| words[k].1))
}

/// Refuses an image by texture coordinates on a shape without.
fn needs_uv(table: &TableReader<'_>, key: &str, shape: &Shape, remedy: &str) -> Result<()> {
    match shape {
        Shape::Mesh(mesh) if mesh.uv.is_none() => {
            let remedy = format!("export the mesh with texture coordinates for every corner{remedy}");
            Err(table.error_at(key, "the mesh has no texture coordinates", remedy))
        }
        _ => Ok(()),
    }
}

fn read_tint_keys(table: &TableReader<'_>, shape: &Shape) -> Result<Tint> {
    let colour = table.colour("tint", range(0.0, 1.0))?.unwrap_or([1.0; 3]);
    let wrap = word(table, "tint_wrap", &WRAPS[..2])?;
    let image = match table.path("tint_texture")? {
        Some(path) => {
            needs_uv(table, "tint_texture", shape, "")?;
            let image = read_tint(&path)?;
            Some(Texture::new(image.width, image.height, image.pixels, wrap.unwrap_or(Wrap::Repeat)))
        }
        None if wrap.is_some() => return Err(table.error_at("tint_wrap", "there is no tint_texture", "add one, or remove tint_wrap")),
        None => None,
    };
    let vertex_colours = table.bool("tint_vertex_colors")?.unwrap_or(false);
    if vertex_colours {
        check_vertex_colours(table, shape)?;
    }
    Ok(Tint { colour, image, vertex_colours })
}

fn check_vertex_colours(table: &TableReader<'_>, shape: &Shape) -> Result<()> {
    let bad = |problem: String, remedy: &str| Err(table.error_at("tint_vertex_colors", problem, remedy));
    let Shape::Mesh(mesh) = shape else { return bad("only a mesh has vertices".to_owned(), "write a tint or a tint_texture") };
    let Some(colours) = &mesh.colours else {
        let remedy = "use an OBJ file with v x y z r g b, or a PLY file with red, green and blue, for every vertex";
        return bad("the mesh has no colours of vertices".to_owned(), remedy);
    };
    let inside = |c: &DVec3| c.to_array().iter().all(|v| (0.0..=1.0).contains(v));
    match colours.iter().flatten().find(|c| !inside(c)) {
        Some(c) => bad(format!("a vertex of the mesh has the colour ({}, {}, {})", c.x, c.y, c.z), "colours lie in 0..1"),
        None => Ok(()),
    }
}

fn read_planar(table: &TableReader<'_>, image: &PlainImage<1>) -> Result<Projection> {
    let center = table.array::<3>("mask_center", super::fields::POSITION)?.map_or(DVec3::ZERO, DVec3::from);
    let frame = plane_frame(table, "mask_normal", "mask_x_axis")?;
    let size = required(table, "mask_size", table.array::<2>("mask_size", LENGTH)?, "[1.0, 1.0]")?;
    let (of_image, of_place) = (image.width as f64 / image.height as f64, size[0] / size[1]);
    if (of_image / of_place - 1.0).abs() > ASPECT_TOLERANCE {
        let problem = format!("the mask of {} x {} pixels has another aspect than {} x {}", image.width, image.height, size[0], size[1]);
        let fitting = size[0] * image.height as f64 / image.width as f64;
        return Err(table.error_at("mask_size", problem, format!("write mask_size = [{}, {fitting}], or resample the mask", size[0])));
    }
    Ok(Projection::Planar(Plane { center, frame, size }))
}

fn read_mask_keys(table: &TableReader<'_>, shape: &Shape) -> Result<Mask> {
    let path = required(table, "mask", table.path("mask")?, "\"logo.png\"")?;
    let channel = word(table, "mask_channel", &CHANNELS)?.unwrap_or(MaskChannel::Either);
    let encoding = word(table, "mask_encoding", &ENCODINGS)?.unwrap_or(MaskEncoding::Linear);
    let planar = word(table, "mask_projection", &[("uv", false), ("planar", true)])?.unwrap_or(false);
    let wrap = word(table, "mask_wrap", &WRAPS)?.unwrap_or(if planar { Wrap::Zero } else { Wrap::Repeat });
    let invert = table.bool("invert")?.unwrap_or(false);
    if !planar {
        if let Some(key) = PLANAR_KEYS.into_iter().find(|key| table.has(key)) {
            return Err(table.error_at(
                key,
                "the mask lies by texture coordinates",
                "add mask_projection = \"planar\", or remove this key",
            ));
        }
        needs_uv(table, "mask", shape, ", or write mask_projection = \"planar\"")?;
    }
    let image = read_mask(&path, channel, encoding)?;
    let projection = if planar { read_planar(table, &image)? } else { Projection::Uv };
    Ok(Mask { image: Texture::new(image.width, image.height, image.pixels, wrap), projection, invert })
}

fn read_layer(table: TableReader<'_>, shape: &Shape, turn: f64, materials: &mut SceneMaterials<'_>) -> Result<Layer> {
    let Some(material) = materials.place(&table)? else { return Err(table.missing("material", "\"my.toml\"")) };
    let mask = read_mask_keys(&table, shape)?;
    let tint = read_tint_keys(&table, shape)?;
    let turn = table.f64("turn_deg", range(-360.0, 360.0))?.map_or(turn, f64::to_radians);
    table.finish()?;
    Ok(Layer { material, mask, tint, turn })
}

fn read_normal_map(table: &TableReader<'_>, shape: &Shape) -> Result<Option<NormalMap>> {
    let strength = table.f64("normal_strength", range(0.0, 100.0))?;
    let Some(path) = table.path("normal_map")? else {
        return match strength {
            Some(_) => Err(table.error_at("normal_strength", "there is no normal_map", "add one, or remove normal_strength")),
            None => Ok(None),
        };
    };
    needs_uv(table, "normal_map", shape, "")?;
    let image = read_normals(&path)?;
    let image = Texture::new(image.width, image.height, image.pixels, Wrap::Repeat);
    Ok(Some(NormalMap { image, strength: strength.unwrap_or(1.0) }))
}

/// Reads what covers an object of this shape, whose tile is turned by `turn`.
pub(super) fn read_covering(table: &TableReader<'_>, shape: &Shape, turn: f64, materials: &mut SceneMaterials<'_>) -> Result<Covering> {
    let tint = read_tint_keys(table, shape)?;
    let normal_map = read_normal_map(table, shape)?;
    let blend = word(table, "blend", &BLENDS)?;
    let tables = table.tables("layer")?;
    if tables.len() > MAX_LAYERS {
        let problem = format!("there are {} layers", tables.len());
        return Err(table.error_at("layer", problem, format!("at most {MAX_LAYERS} of an object are possible")));
    }
    if let (Some(_), []) = (blend, &tables[..]) {
        return Err(table.error_at("blend", "there is no layer to blend", "add an [[object.layer]], or remove `blend`"));
    }
    let layers = tables.into_iter().map(|t| read_layer(t, shape, turn, materials)).collect::<Result<Vec<_>>>()?;
    let blend = blend.unwrap_or_default();
    if blend == Blend::Sum {
        check_sum(table, &layers)?;
    }
    Ok(Covering { tint, layers, blend, normal_map })
}

/// Refuses masks that sum over 1 anywhere, or that do not lie pixel on pixel, so that nobody could say.
fn check_sum(table: &TableReader<'_>, layers: &[Layer]) -> Result<()> {
    let Some((first, others)) = layers.split_first() else { return Ok(()) };
    let [width, height] = first.mask.image.size();
    for (k, mask) in others.iter().map(|layer| &layer.mask).enumerate() {
        let place = |m: &Mask| (m.projection, m.image.wrap());
        if mask.image.size() != [width, height] || place(mask) != place(&first.mask) {
            let [w, h] = mask.image.size();
            let problem =
                format!("the masks of layer[0] ({width} x {height} pixels) and layer[{}] ({w} x {h}) do not lie on each other", k + 1);
            return Err(table.error_at("blend", problem, "masks of a sum have one size, projection and wrap; or write blend = \"over\""));
        }
    }
    let share = |mask: &Mask, value: f32| if mask.invert { 1.0 - value } else { value };
    let sum = |value: &dyn Fn(&Mask) -> f32| layers.iter().map(|layer| share(&layer.mask, value(&layer.mask))).sum::<f32>();
    let over = |sum: f32| sum > 1.0 + SUM_TOLERANCE * layers.len() as f32;
    let remedy = "scale the masks, or write blend = \"over\"";
    if let Some(k) = (0..width * height).find(|&k| over(sum(&|mask| mask.image.pixels()[k][0]))) {
        let sum = sum(&|mask| mask.image.pixels()[k][0]);
        // Rows of files are counted from the top.
        let problem = format!("the masks of the layers sum to {sum} in column {}, row {}", k % width, height - 1 - k / width);
        return Err(table.error_at("blend", problem, remedy));
    }
    // A place that does not face a planar mask has a share of 0, whatever lies around its image.
    let outside = sum(&|_| 0.0);
    if (first.mask.image.wrap() == Wrap::Zero || matches!(first.mask.projection, Projection::Planar { .. })) && over(outside) {
        return Err(table.error_at("blend", format!("the masks of the layers sum to {outside} outside of their image"), remedy));
    }
    Ok(())
}
