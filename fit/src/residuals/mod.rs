//! Photographs minus model: where a photograph becomes a residual.
//!
//! [`model::Model`] evaluates a state of the material. Each source of knowledge is a [`block::ResidualBlock`]: the distant photographs
//! ([`distant`]), the close-up ([`close_up`]) and what is known beforehand ([`priors`]). Their equations are linear in the colours, which are
//! solved for at every evaluation ([`equations::solve`]).

pub mod block;
pub mod close_up;
pub mod colour_basis;
pub mod derivatives;
pub mod distant;
pub mod equations;
pub mod input;
pub mod interreflection;
pub mod model;
pub mod near_interreflection;
mod near_model;
pub mod params;
pub mod priors;
pub mod registration;
pub mod state;
pub mod tile_view;
pub mod unknowns;
