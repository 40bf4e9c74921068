use biscale::filter::*;
use biscale_fit::*;
#[test]
fn scratch() {
    let cancel = std::sync::atomic::AtomicBool::new(false);
    let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 };
    for m in ["/tmp/fit/truth-fit.toml", "/tmp/fit/truth-mesh-fit.toml"] {
        let spec = spec::Spec::load(std::path::Path::new(m)).unwrap();
        let small = spec.material.build().unwrap();
        let p = spec.of_role(photograph::Role::Distant).next().unwrap();
        let scene = cells::scene_of(p, &spec.material, &small);
        let world = biscale::render::world::World::opaque(&scene);
        let sights = cells::sights(&world, p);
        let cells = [cells::Cells::new(p, &sights, 40).unwrap()];
        let model = model::Model::new(&spec, &cells, None, &[0, 1], None, 8192, 0, &[], false).unwrap();
        println!("{m} slots {:?}", model.unknowns.iter().map(|u| &u.name).collect::<Vec<_>>());
        let truth = [0.45, 0.06, 0.05, 0.05, 0.12, 0.40, 0.25, 0.25, 0.0, 0.0, 0.0];
        let e = model.evaluate_with(&[], Some(&truth), &control).unwrap().unwrap();
        println!("truth {} {}", e.objective, e.relative_rms(&cells));
        for (row, o) in &e.rows { if let model::Origin::Cell(_, k, c) = o { let cell = &cells[0].cells[*k]; println!("{k} {c} wi {:.2} wo {:.2} n {} value {:.4} ratio {:.3} sigma {:.4}", cell.wi, cell.wo, cell.count, row.value, e.residual(row) * row.sigma / row.value + 1.0, row.sigma); } }
    }
}
