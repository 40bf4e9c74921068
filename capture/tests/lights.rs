//! A mirror ball in a made-up photograph, found without help.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![cfg(feature = "opencv")]

mod support;

use biscale_capture::lens::Pose;
use biscale_capture::light;
use biscale_capture::shoot::Shape;
use biscale_capture::vision::{Gray, Luminance, circle};
use glam::{DVec2, DVec3};
use support::*;

#[test]
fn a_mirror_ball_is_found_and_its_highlight_tells_the_light_within_a_degree() {
    let studio = Studio::new(900, 600);
    let board = flat_shoot::board();
    let print = Print::new(&board, &flat_shoot::bits);
    let page = DVec2::new(360.0, 300.0);
    let pose = Pose::looking_at(DVec3::new(20.0, -120.0, 450.0), DVec3::new(10.0, 0.0, 0.0), DVec3::Y);
    for (light, ball) in [
        (DVec3::new(0.45, -0.25, 0.86), DVec3::new(145.0, 30.0, 12.0)),
        (DVec3::new(-0.6, 0.3, 0.7), DVec3::new(-150.0, -20.0, 15.0)),
        (DVec3::new(0.1, 0.2, 1.0), DVec3::new(145.0, -60.0, 10.0)),
    ] {
        let scene = Scene {
            ball: Some((ball, ball.z)),
            ..Scene::new(Shape::Plane(page), light, Box::new(|p: DVec2| print.at(p - 0.5 * (page - board.size))))
        };
        let picture = studio.photograph(&scene, &pose, 1.0);
        if let Ok(keep) = std::env::var("BISCALE_KEEP") {
            save16(&picture, &std::path::Path::new(&keep).join(format!("ball-{}.png", ball.x)));
        }
        let luminance = Luminance(&picture);
        let mut best = f64::INFINITY;
        let seen = studio.lens.project(pose.to_camera(ball)).unwrap();
        for c in circle::candidates(&Gray::of(&picture, false)).unwrap() {
            let rays: Vec<DVec3> = circle::outline(&luminance, c).iter().filter_map(|p| studio.lens.ray(*p)).collect();
            let Some(outline) = light::ball_outline(&rays) else { continue };
            let spot = circle::highlight(&luminance, c);
            if seen.distance(DVec2::new(c[0], c[1])) < 10.0 {
                eprintln!("{c:?} for {seen}: {} rays, misfit {:.4}, spot {spot:?}", outline.rays, outline.rms / outline.half_angle);
            }
            let Some((spot, size)) = spot else { continue };
            let Some(found) = light::mirror_ball(&outline, studio.lens.ray(spot).unwrap(), size * 1e-4) else { continue };
            let l = pose.rotation.transpose() * found.direction;
            best = best.min(l.angle_between(scene.light).to_degrees());
        }
        assert!(best < 1.0, "{light}: {best} degrees");
    }
}
