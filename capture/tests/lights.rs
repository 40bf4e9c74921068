//! A mirror ball in made-up photographs, which mirrors the page that it lies on.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test fails by panicking, and tells what it measured")]
#![cfg(feature = "opencv")]

mod support;

use biscale_capture::lens::Pose;
use biscale_capture::light;
use biscale_capture::shoot::Shape;
use biscale_capture::vision::{GreyImage8, Luminance, circle};
use glam::{DVec2, DVec3};
use support::*;

#[test]
fn a_mirror_ball_tells_the_light_within_a_degree() {
    let studio = Studio::new(900, 600);
    let board = flat_shoot::board();
    let print = Print::new(&board, &flat_shoot::bits);
    let page = DVec2::new(360.0, 300.0);
    let pose = Pose::looking_at(DVec3::new(20.0, -120.0, 450.0), DVec3::new(10.0, 0.0, 0.0), DVec3::Y);
    for (light, ball) in [
        (DVec3::new(0.45, -0.25, 0.86), DVec3::new(147.0, 30.0, 20.0)),
        (DVec3::new(-0.6, 0.3, 0.7), DVec3::new(-140.0, -20.0, 24.0)),
        (DVec3::new(0.1, 0.2, 1.0), DVec3::new(145.0, -60.0, 16.0)),
    ] {
        let scene = Scene {
            ball: Some((ball, ball.z)),
            ..Scene::new(Shape::Plane(page), light, Box::new(|p: DVec2| print.at(p - 0.5 * (page - board.size))))
        };
        let picture = studio.photograph(&scene, &pose, 1.0);
        let luminance = Luminance(&picture);
        let seen = studio.lens.project(pose.to_camera(ball)).unwrap();
        let radius = studio.lens.focal.x * ball.z / pose.to_camera(ball).length();
        // As someone would read it off the picture.
        let rough = [seen.x + 0.06 * radius, seen.y - 0.04 * radius, 1.05 * radius];
        let rays: Vec<Vec<DVec3>> =
            circle::outline(&luminance, rough).iter().map(|e| e.iter().filter_map(|p| studio.lens.ray(*p)).collect()).collect();
        let outline = light::ball_outline(&rays, 1.0 / studio.lens.focal.x).unwrap();
        let (spot, size) = circle::highlight(&luminance, rough).unwrap();
        let found = light::mirror_ball(&outline, studio.lens.ray(spot).unwrap(), (0.25 + 0.1 * size) / studio.lens.focal.x).unwrap();
        let off = (pose.rotation.transpose() * found.direction).angle_between(scene.light).to_degrees();
        eprintln!("{light}: off by {off:.3} degrees, says {:.3}; {} of {} rays", found.sigma.to_degrees(), outline.rays, rays.len());
        let middle = pose.to_camera(ball);
        let half = (ball.z / middle.length()).asin();
        eprintln!(
            "axis off by {:.2} px, radius {:.2} for {:.2} px, highlight {spot} of {size:.1} px",
            outline.axis.angle_between(middle) * studio.lens.focal.x,
            outline.half_angle * studio.lens.focal.x,
            half * studio.lens.focal.x
        );
        // Without a word from the user: a spot stands out, and one of the circles around it is the ball's outline.
        let spots = circle::spots(&picture);
        assert!(spots.iter().any(|s| s.0.distance(spot) < 2.0), "{light}: {spots:?} for {spot}");
        let all = circle::around(&GreyImage8::of(&picture, false), spots[0].0, spots[0].1).unwrap();
        let nearest = all.iter().map(|c| seen.distance(DVec2::new(c[0], c[1])).max((c[2] - radius).abs())).fold(f64::INFINITY, f64::min);
        eprintln!("of {} circles the nearest is {nearest:.1} px off", all.len());
        assert!(nearest < 0.12 * radius, "{light}: {nearest} px of {radius}");
        assert!(off < 1.0, "{light}: {off} degrees");
    }
}
