//! What a scene file may not say of layers, tints and normal maps, and how it is told.

use super::{SCENE_TEMPLATE, Scene};
use crate::error::Result;
use crate::render::Picture;
use crate::toml_reader::Source;
use image::{ImageBuffer, Luma, LumaA, Rgb};

const MATERIAL: &str =
    "format = 1\n[geometry]\nkind = \"grooves\"\n[[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 0.5 }\n";

/// A folder with a material, meshes with and without texture coordinates and colours, and images.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let write = |name: &str, text: &str| std::fs::write(at(name), text).unwrap();
    write("material.toml", MATERIAL);
    write("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("mapped.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
    write("bytes.obj", "v 0 0 0 255 0 0\nv 1 0 0 0 255 0\nv 0 1 0 0 0 255\nf 1 2 3\n");
    write("coloured.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n");
    write("text.png", "no image\n");
    let grey = |name: &str, width: u32, height: u32, value: &dyn Fn(u32, u32) -> u8| {
        ImageBuffer::<Luma<u8>, _>::from_fn(width, height, |x, y| Luma([value(x, y)])).save(at(name)).unwrap();
    };
    grey("logo.png", 4, 2, &|x, _| if x < 2 { 255 } else { 0 });
    grey("rest.png", 4, 2, &|x, _| if x < 2 { 0 } else { 255 });
    grey("over.png", 4, 2, &|x, y| if (x, y) == (1, 0) { 26 } else { 0 });
    grey("square.png", 4, 4, &|_, _| 128);
    ImageBuffer::<LumaA<u8>, _>::from_pixel(2, 2, LumaA([7, 200])).save(at("alpha.png")).unwrap();
    ImageBuffer::<LumaA<u8>, _>::from_fn(2, 2, |x, _| LumaA([if x == 0 { 0 } else { 255 }, 255])).save(at("opaque.png")).unwrap();
    let rgb = |name: &str, pixel: [u8; 3]| ImageBuffer::<Rgb<u8>, _>::from_pixel(2, 2, Rgb(pixel)).save(at(name)).unwrap();
    rgb("red.png", [200, 10, 10]);
    rgb("normals.png", [128, 128, 255]);
    rgb("below.png", [128, 128, 90]);
    let mut bright = Picture::new(2, 1);
    bright.rgb = vec![[0.5; 3], [1.5; 3]];
    bright.write_exr(&mut std::fs::File::create(at("bright.exr")).unwrap(), false, "").unwrap();
    folder
}

const HEAD: &str = "format = 1\n[camera]\norigin = [0, -5, 0]\ntarget = [0, 0, 0]\nfov_deg = 30\nwidth = 8\nheight = 4\n\
                    [[light]]\ntype = \"directional\"\nto_light = [0, -1, 1]\nirradiance_rgb = 1\n\
                    [[object]]\nmaterial = \"material.toml\"\n";
const SLIDE: &str = "mask_projection = \"planar\"\nmask_size = [2, 1]\nmask_wrap = \"clamp\"";
const SPHERE: &str = "kind = \"sphere\"\nradius = 1\n";

/// The scene of one object.
fn parse(folder: &tempfile::TempDir, object: &str) -> Result<Scene> {
    Scene::parse(&Source { path: folder.path().join("scene.toml"), text: format!("{HEAD}{object}") })
}

/// A layer on what comes before.
fn layer(keys: &str) -> String {
    format!("[[object.layer]]\nmaterial = \"material.toml\"\n{keys}\n")
}

#[test]
fn what_is_wrong_with_layers_is_said_with_its_place_and_a_remedy() {
    let folder = folder();
    let sphere = |keys: &str| format!("{SPHERE}{keys}\n");
    let on_sphere = |keys: &str| format!("{SPHERE}{}", layer(keys));
    let mesh = |file: &str, keys: &str| format!("kind = \"mesh\"\nfile = \"{file}\"\n{keys}\n");
    let planar = "mask = \"logo.png\"\nmask_projection = \"planar\"\n";
    let logo = layer("mask = \"logo.png\"");
    for (object, field, problem, remedy) in [
        (on_sphere(""), "object[0].layer[0].mask", "lacks the required key `mask`", "add `mask = \"logo.png\"`"),
        (on_sphere("mask = \"lost.png\""), "object[0].layer[0].mask", "there is no file \"lost.png\"", "relative to the folder"),
        (on_sphere("mask = \"text.png\""), "text.png", "not a readable PNG image", "write the image again"),
        (on_sphere("mask = \"red.png\""), "red.png", "the mask has colours", "save it as grey"),
        (on_sphere("mask = \"bright.exr\""), "bright.exr", "the share 1.5 in column 1, row 0 is out of range", "scale the mask"),
        (on_sphere("mask = \"logo.png\"\nmask_channel = \"alpha\""), "logo.png", "no alpha channel", "grey values"),
        (on_sphere("mask = \"logo.png\"\nmask_wrap = \"mirror\""), "mask_wrap", "\"mirror\" is not known here", "repeat, clamp, none"),
        (
            on_sphere("mask = \"logo.png\"\nmask_size = [1, 1]"),
            "layer[0].mask_size",
            "by texture coordinates",
            "mask_projection = \"planar\"",
        ),
        (on_sphere("maks = \"logo.png\"\nmask = \"logo.png\""), "layer[0].maks", "unknown key", "did you mean `mask`?"),
        (on_sphere(planar), "layer[0].mask_size", "lacks the required key", "add `mask_size = [1.0, 1.0]`"),
        (
            on_sphere(&format!("{planar}mask_size = [1, 1]")),
            "layer[0].mask_size",
            "the mask of 4 x 2 pixels has another aspect than 1 x 1",
            "write mask_size = [1, 0.5]",
        ),
        (
            on_sphere(&format!("{planar}mask_size = [2, 1]\nmask_x_axis = [0, 0, 2]")),
            "layer[0].mask_x_axis",
            "mask_x_axis and mask_normal are parallel",
            "write a direction in the plane",
        ),
        (format!("{SPHERE}[[object.layer]]\nmask = \"logo.png\"\n"), "layer[0].material", "lacks the required key `material`", "my.toml"),
        (mesh("bare.obj", &logo), "layer[0].mask", "the mesh has no texture coordinates", "or write mask_projection = \"planar\""),
        (sphere(&logo.repeat(17)), "object[0].layer", "there are 17 layers", "at most 16"),
        (sphere("blend = \"sum\""), "object[0].blend", "there is no layer to blend", "add an [[object.layer]]"),
        (on_sphere("mask = \"opaque.png\""), "opaque.png", "alpha is 1 everywhere", "mask_channel = \"grey\""),
        // Shares of 1 where the slide is not faced, though the masks sum to 1 in every pixel.
        (
            sphere(&format!(
                "blend = \"sum\"\n{}{}",
                layer(&format!("mask = \"logo.png\"\ninvert = true\n{SLIDE}")),
                layer(&format!("mask = \"rest.png\"\ninvert = true\n{SLIDE}"))
            )),
            "object[0].blend",
            "sum to 2 outside of their image",
            "scale the masks",
        ),
        (
            sphere(&format!("blend = \"sum\"\n{logo}{}", layer("mask = \"over.png\""))),
            "object[0].blend",
            "sum to 1.1019608 in column 1, row 0",
            "scale the masks",
        ),
        (
            sphere(&format!("blend = \"sum\"\n{logo}{}", layer("mask = \"square.png\""))),
            "object[0].blend",
            "layer[0] (4 x 2 pixels) and layer[1] (4 x 4) do not lie on each other",
            "one size",
        ),
        (
            sphere(&format!(
                "blend = \"sum\"\n{}{}",
                layer(&format!("{planar}mask_size = [2, 1]\ninvert = true")),
                layer(&(format!("{planar}mask_size = [2, 1]").replace("logo", "rest") + "\ninvert = true"))
            )),
            "object[0].blend",
            "sum to 2 outside of their image",
            "scale the masks",
        ),
        (sphere("tint = [1, 0.5, 1.5]"), "object[0].tint", "1.5 is out of range", "from 0 to 1"),
        (mesh("bare.obj", "tint_texture = \"red.png\""), "object[0].tint_texture", "no texture coordinates", "export the mesh"),
        (sphere("tint_wrap = \"clamp\""), "object[0].tint_wrap", "there is no tint_texture", "add one"),
        (sphere("tint_vertex_colors = true"), "object[0].tint_vertex_colors", "only a mesh has vertices", "tint_texture"),
        (mesh("bare.obj", "tint_vertex_colors = true"), "tint_vertex_colors", "the mesh has no colours of vertices", "v x y z r g b"),
        (mesh("bytes.obj", "tint_vertex_colors = true"), "tint_vertex_colors", "the colour (255, 0, 0)", "colours lie in 0..1"),
        (mesh("bare.obj", "normal_map = \"normals.png\""), "object[0].normal_map", "no texture coordinates", "export the mesh"),
        (sphere("normal_map = \"logo.png\""), "logo.png", "the normal map has one channel", "a map of heights is none"),
        (sphere("normal_map = \"below.png\""), "below.png", "in column 0, row 0 is no normal that points outward", "in tangent space"),
        (sphere("normal_map = \"bright.exr\""), "bright.exr", "is no normal that points outward", "in 0..1"),
        (sphere("normal_strength = 2"), "object[0].normal_strength", "there is no normal_map", "add one"),
    ] {
        let message = parse(&folder, &object).expect_err(&object).to_string();
        for part in [field, problem, remedy] {
            assert!(message.contains(part), "{message}\nand not {part}, of\n{object}");
        }
        // A key is placed in the scene, a mistake in an image in that file.
        let is_file = [".png", ".exr"].iter().any(|ending| field.ends_with(ending));
        assert!(is_file || message.contains("scene.toml:"), "{message}");
    }
}

#[test]
fn good_layers_are_read_and_masks_may_sum_to_1() {
    let folder = folder();
    let planar = "mask_projection = \"planar\"\nmask_size = [2, 1]";
    for object in [
        format!("{SPHERE}blend = \"sum\"\n{}{}", layer("mask = \"logo.png\""), layer("mask = \"rest.png\"")),
        format!("{SPHERE}{}{}", layer("mask = \"alpha.png\"\ninvert = true"), layer(&format!("mask = \"logo.png\"\n{planar}"))),
        format!("kind = \"mesh\"\nfile = \"bare.obj\"\n{}", layer(&format!("mask = \"logo.png\"\n{planar}"))),
        "kind = \"mesh\"\nfile = \"mapped.obj\"\ntint_texture = \"red.png\"\nnormal_map = \"normals.png\"\n".to_owned(),
        "kind = \"mesh\"\nfile = \"coloured.obj\"\ntint_vertex_colors = true\n".to_owned(),
    ] {
        let scene = parse(&folder, &object).unwrap();
        assert_eq!(scene.materials.len(), 1, "{object}");
    }
    let scene = parse(&folder, &format!("{SPHERE}{}", layer("mask = \"alpha.png\""))).unwrap();
    assert_eq!(scene.objects[0].covering.layers[0].mask.image.pixels()[0], [200.0 / 255.0], "alpha counts where there is some");
}

#[test]
fn the_template_names_every_key_of_a_layer() {
    for key in [
        "tint",
        "tint_texture",
        "tint_wrap",
        "tint_vertex_colors",
        "normal_map",
        "normal_strength",
        "blend",
        "mask",
        "mask_channel",
        "mask_encoding",
        "mask_wrap",
        "mask_projection",
        "mask_center",
        "mask_normal",
        "mask_x_axis",
        "mask_size",
        "invert",
    ] {
        assert!(SCENE_TEMPLATE.contains(&format!("# {key} = ")), "{key}");
    }
}
