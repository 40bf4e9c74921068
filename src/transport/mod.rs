//! Light that is followed from event to event over the periodic surface of a tile: the one path tracer.
//!
//! A path is followed backwards, from the viewer to the light. With the points `x_1, x_2, …` that it meets, their unit normals `n_k`, `fr` the
//! BRDF with its tint there, and `wi` the one direction that light comes from, it brings back
//!
//! ```text
//! L = Σ_k T_k fr(x_k, wi, v_k) (n_k·wi)+ V(x_k, wi),      T_1 = 1,      T_(k+1) = T_k fr(x_k, w_k, v_k) (n_k·w_k)+ / p(w_k)
//! ```
//!
//! (next-event estimation; Veach 1997, "Robust Monte Carlo Methods for Light Transport Simulation", section 10.3, for a directional light). `v_1`
//! is the viewer, `w_k` is drawn with density `p` by [`Brdf::sample`](crate::brdf::Brdf::sample), and `v_(k+1) = -w_k`. Russian roulette ends long
//! paths without bias (Arvo and Kirk 1990, "Particle Transport and Image Synthesis").
//!
//! The term `k = 1` is direct light, the others are interreflection. A caller says which events count: the `reference` method wants all of them,
//! a fit only the interreflection.
//!
//! In the order of the flow: [`PathSequence`] gives the random numbers of each event, [`TransportScene`] is a surface as rays need it, and
//! [`TransportScene::path`] follows a path over it to a [`ViewRay`]. The room knows of one path at a time: means, errors and pictures are its
//! callers' matter, and so is the error that rays which are given up leave: [`PathLight`] tells these, [`lost_radiance`] what they may count.
//!
//! ```
//! use biscale::transport::{PathSequence, TransportScene, ViewRay};
//! use biscale::{Material, Pair};
//! use glam::DVec3;
//!
//! # let text = include_str!("../../samples/pyramids.toml").to_owned();
//! # let material = Material::parse(&biscale::toml_reader::Source { path: "pyramids.toml".into(), text })?;
//! let surface = material.build()?;
//! let scene = TransportScene::new(&surface)?;
//! let pair = Pair { wi: DVec3::new(0.6, 0.0, 0.8), wo: DVec3::Z };
//! let sequence = PathSequence::new(1, &[]);
//! let [x, y] = sequence.start(0);
//! let origin = DVec3::new(x * surface.tile.period.x, y * surface.tile.period.y, scene.highest());
//! // Direct light and three bounces.
//! let ray = scene.path(origin, pair, 1..=4, sequence, 0);
//! assert!(matches!(ray, ViewRay::Front(light) if light.colour.iter().all(|c| *c >= 0.0)));
//! # Ok::<(), biscale::Error>(())
//! ```

mod path;
mod scene;
mod sequence;

pub use path::{PathLight, ViewRay, lost_radiance};
pub use scene::TransportScene;
pub use sequence::PathSequence;
