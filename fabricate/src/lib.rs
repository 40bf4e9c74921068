//! Folding patterns of small-scale surfaces: from the design to sheets that a person can print, cut, fold and glue.
//!
//! The rooms in the order of the flow; none uses a later one, and [`verify`] uses nothing but [`mesh`] and [`sheet_recipe`]:
//!
//! | room | in -> out |
//! |---|---|
//! | [`polygon`] | geometry of polygons in the plane |
//! | [`mesh`] | triangles -> facets with fold angles |
//! | [`design`] | material or mesh file, size -> triangles in mm; the recipe that makes them again; the colours of any point |
//! | [`surface`] | triangles -> the surface that is folded: reduced, narrowed by what folds take, cut to the page |
//! | [`paper`] | the page and its margins |
//! | [`unfold`] | facets -> pieces: `tab_shapes` (what fits under a neighbour), `net` (where facets lie, free of overlaps), `search`; weaves as strips |
//! | [`layout`] | pieces -> places on pages |
//! | [`drawing`] | pieces on pages -> marks in mm: the one model that all printed formats are written from |
//! | [`wrap`] | the sheet that is wrapped around a large object, with markers for the camera |
//! | [`formats`] | marks and pieces -> SVG, PDF, PNG, DXF, FOLD, Origami Simulator |
//! | [`preview`] | the surface as paper can take it -> how far its effective BRDF is from the design's |
//! | [`sheet_recipe`] | what the sheets are to show, as files keep it |
//! | [`verify`] | a written file -> what is wrong with it |

pub mod design;
pub mod drawing;
pub mod formats;
pub mod layout;
pub mod mesh;
pub mod paper;
pub mod polygon;
pub mod preview;
pub mod sheet_recipe;
pub mod surface;
pub mod unfold;
pub mod verify;
pub mod wrap;
