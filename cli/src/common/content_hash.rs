//! Hashes of what is computed: results that a folder keeps are taken up again only where these are the same.

use biscale::direction::Pair;
use biscale::material::{SmallScale, Tint};
use biscale::numerics::hash::Fnv1a;
use biscale::numerics::stable_bytes::StableBytes;

/// A hash in digits of what is written: the same on every machine and with every compiler, since files keep it.
fn hash_of(write: impl FnOnce(&mut StableBytes<'_>)) -> String {
    let mut hash = Fnv1a::default();
    let mut add = |bytes: &[u8]| hash.add(bytes);
    write(&mut StableBytes::new(&mut add));
    format!("{:016x}", hash.value())
}

/// A hash of the geometry, of what covers it, and of how many reflections its look includes.
pub fn hash_of_surface(small: &SmallScale) -> String {
    let tile = &small.tile;
    hash_of(|out| {
        out.reals(&tile.period.to_array());
        out.list(&tile.vertices, |out, v| out.reals(&v.to_array()));
        out.list(&tile.triangles, |out, corners| corners.iter().for_each(|&k| out.whole(k.into())));
        out.option(tile.uv.as_ref(), |out, uv| {
            out.list(uv, |out, corners| corners.iter().for_each(|uv| out.reals(&uv.to_array())));
        });
        out.list(&small.surface_of_triangle, |out, &k| out.whole(u64::from(k)));
        out.list(&small.surfaces, |out, surface| {
            match &surface.tint {
                Tint::Uniform(tint) => {
                    out.tag(1);
                    out.reals(tint);
                }
                Tint::Image(image) => {
                    out.tag(2);
                    out.whole(image.width as u64);
                    out.list(&image.pixels, |out, pixel| out.singles(pixel));
                }
            }
            surface.brdf.write(out);
        });
        // Files that say nothing of it keep the hashes that they had.
        if small.bounces > 0 {
            out.whole(small.bounces.into());
        }
    })
}

/// A hash of the pairs of some questions.
pub fn hash_of_pairs<'a>(questions: impl Iterator<Item = &'a [Pair]>) -> String {
    hash_of(|out| {
        for pairs in questions {
            out.list(pairs, |out, pair| [pair.wi, pair.wo].into_iter().for_each(|w| out.reals(&w.to_array())));
        }
    })
}
