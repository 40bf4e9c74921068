//! A BRDF of one's own, from a formula: tabulated in the MERL format, put on a V groove, and compared with a closed form.
//!
//! A table is the way for a BRDF that this program does not know. One that it shall know gets a file in `src/brdf/`: the head of
//! `src/brdf/mod.rs` says the steps, and this comparison is the first test that it should pass.
//!
//! The closed form: both sides of a symmetric V groove whose sides rise by the angle `a` are seen whole from above. With light and viewer along
//! z every point has `n·w = cos a` and both sides together the area `A / cos a`, so `S = fr(a) cos a` and `av = 1`: `fbar = fr(a) cos a`
//! for any `fr`, taken at incidence `a` straight back to the light.
//!
//! usage: `cargo run --release --example custom_brdf_study`

#![allow(clippy::print_stdout, reason = "an example prints what it found")]

use biscale::formats::merl;
use biscale::toml_reader::Source;
use biscale::{Control, Error, Material, Pair, Quality, Result, effective};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// The BRDF: a diffuse part and a lobe that goes back to the light, by the cosine of the angle between light and viewer. In half and
/// difference angles that is `cos(2 theta_d)`.
fn retroreflector(theta_d: f64) -> f64 {
    0.3 / PI + 0.2 * (2.0 * theta_d).cos().max(0.0).powi(20)
}

/// The bytes of a MERL table of it, the same in all channels.
fn tabulated() -> Vec<u8> {
    let mut bytes: Vec<u8> =
        [merl::THETA_H, merl::THETA_D, merl::PHI_D].into_iter().flat_map(|n| i32::try_from(n).expect("90 or 180").to_le_bytes()).collect();
    for scale in merl::SCALE {
        for _ in 0..merl::THETA_H {
            for d in 0..merl::THETA_D {
                let value = retroreflector(d as f64 / merl::THETA_D as f64 * FRAC_PI_2) / scale;
                bytes.extend(std::iter::repeat_n(value.to_le_bytes(), merl::PHI_D).flatten());
            }
        }
    }
    bytes
}

/// `fbar` along the normal of a V groove with sides of this slope, covered by the table.
fn along_the_normal(folder: &Path, slope_deg: f64) -> Result<f64> {
    // Period 1: the sides rise over half of it.
    let depth = 0.5 * slope_deg.to_radians().tan();
    let text = format!(
        "format = 1\n[geometry]\nkind = \"grooves\"\nprofile = \"v\"\ndepth = {depth}\n\
         [[surface]]\npart = \"*\"\nbrdf = {{ model = \"measured\", file = \"own.binary\" }}\n"
    );
    let surface = Material::parse(&Source { path: folder.join("groove.toml"), text })?.build()?;
    let pair = Pair { wi: DVec3::Z, wo: DVec3::Z };
    let result = effective(&surface, &[pair], &Quality { tolerance: 0.01, ..Quality::default() }, &Control::quiet())?;
    Ok(result.values[0].fbar[0])
}

fn main() -> Result<()> {
    let folder = tempfile::tempdir().map_err(|source| Error::Io { action: "create", path: std::env::temp_dir(), source })?;
    let table = folder.path().join("own.binary");
    std::fs::write(&table, tabulated()).map_err(|source| Error::Io { action: "write", path: table, source })?;
    println!("slope deg   fbar   closed form (1/sr)");
    for slope_deg in [0.0, 15.0, 30.0, 45.0, 60.0] {
        let found = along_the_normal(folder.path(), slope_deg)?;
        let expected = retroreflector(0.0) * slope_deg.to_radians().cos();
        println!("{slope_deg:9}   {found:.4}   {expected:.4}");
        assert!((found / expected - 1.0).abs() < 0.01, "{found} and not {expected} at {slope_deg} degrees");
    }
    Ok(())
}
