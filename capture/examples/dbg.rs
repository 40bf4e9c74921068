#![allow(clippy::print_stdout, missing_docs)]
use biscale_capture::{light, photo, lens::Lens, vision::*};
use glam::DVec2;
fn main() {
    let p = photo::read(std::path::Path::new("/tmp/capkeep/ball.png")).unwrap();
    let g = Gray::of(&p.picture, false);
    let lens = Lens { width: 1200, height: 800, focal: DVec2::new(1500., 1503.), centre: DVec2::new(608., 391.), distortion: [-0.12, 0.05, 8e-4, -6e-4, 0.0] };
    let lum = Luminance(&p.picture);
    for c in circle::candidates(&g).unwrap() {
        let places = circle::outline(&lum, c);
        let rays: Vec<_> = places.iter().filter_map(|p| lens.ray(*p)).collect();
        let o = light::ball_outline(&rays);
        let h = circle::highlight(&lum, c);
        println!("{c:?} {} {:?} {:?}", rays.len(), o.map(|o| (o.rays, o.rms / o.half_angle)), h);
    }
}
