//! Cloths of all classes, drawn at random.

use super::cloth::{Cloth, Random};
use biscale_capture::weave::{Class, TwillDirection};

/// A cloth of a class, with everything else at random.
pub fn random_cloth(kind: usize, random: &mut Random) -> (Class, Cloth) {
    let (class, draft) = draft(kind, random);
    let pitch = [random.between(8.0, 40.0_f64.min(30.0)), 0.0];
    let pitch = [pitch[0], (pitch[0] * random.between(0.7, 1.4)).clamp(8.0, 40.0)];
    let colour = |random: &mut Random| [0, 1, 2].map(|_| random.between(0.05, 0.6));
    let warp = colour(random);
    // Every third cloth has one colour, every third two that are alike, every third two that are not.
    let weft = match random.next() % 3 {
        0 => warp,
        1 => warp.map(|c| c * random.between(0.85, 1.18)),
        _ => colour(random),
    };
    let behind = if random.unit() < 0.8 { [0.02; 3] } else { colour(random) };
    let azimuth = random.between(0.0, std::f64::consts::TAU);
    let elevation = random.between(35.0_f64, 75.0).to_radians();
    let repeat = draft.len().max(draft[0].len());
    // At least 14 threads, and four repeats.
    let threads = f64::max(14.0, 4.0 * repeat as f64);
    let cloth = Cloth {
        draft,
        pitch,
        fill: [random.between(0.65, 0.97), random.between(0.65, 0.97)],
        flatness: random.between(0.25, 0.6),
        section: random.between(1.8, 3.0),
        colours: [warp, weft, behind],
        gloss: random.between(0.0, 0.12),
        to_light: [azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin()],
        ambient: random.between(0.1, 0.4),
        turn_deg: random.between(-5.0, 5.0),
        gradient: [random.between(-0.3, 0.3), random.between(-0.3, 0.3)],
        noise: random.between(0.0, 0.04),
        uneven: random.between(0.0, 0.03),
        fibres: random.between(0.0, 0.2),
        blur: random.between(0.4, 1.0),
        size: [(threads * pitch[0]) as usize, (threads * pitch[1]) as usize],
        seed: random.next(),
    };
    (class, cloth)
}

/// Kinds of [`random_cloth`].
pub const KINDS: usize = 20;

fn draft(kind: usize, random: &mut Random) -> (Class, Vec<Vec<bool>>) {
    let twill = |over: usize, under: usize, direction: TwillDirection| {
        let shift = if direction == TwillDirection::Z { 1 } else { over + under - 1 };
        let class = Class::Twill { over: over as u32, under: under as u32, direction };
        (class, Cloth::draft_of(over, under, shift))
    };
    let satin = |ends: usize, step: usize, warp_faced: bool| {
        let (over, under) = if warp_faced { (ends - 1, 1) } else { (1, ends - 1) };
        (Class::Satin { ends: ends as u32, step: step as u32, warp_faced }, Cloth::draft_of(over, under, step))
    };
    let basket = |warps: usize, wefts: usize| {
        let draft = (0..2 * wefts).map(|j| (0..2 * warps).map(|i| (i / warps + j / wefts).is_multiple_of(2)).collect()).collect();
        (Class::Basket { warps: warps as u32, wefts: wefts as u32 }, draft)
    };
    let direction = if random.unit() < 0.5 { TwillDirection::Z } else { TwillDirection::S };
    let faced = random.unit() < 0.5;
    match kind % KINDS {
        0..=2 => (Class::Plain, Cloth::draft_of(1, 1, 1)),
        3 | 4 => twill(1, 2, direction),
        5 | 6 => twill(2, 1, direction),
        7 | 8 => twill(2, 2, direction),
        9 | 10 => twill(1, 3, direction),
        11 | 12 => twill(3, 1, direction),
        13 => twill(3, 3, direction),
        14 => satin(5, 2, faced),
        15 => satin(5, 3, faced),
        16 => satin(8, 3, faced),
        17 => satin(7, [2, 3, 4, 5][random.next() as usize % 4], faced),
        18 => basket(2, 2),
        _ => satin(8, 5, faced),
    }
}
