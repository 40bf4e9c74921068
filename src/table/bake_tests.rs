//! Long bakes: what is foreseen, how progress rises, and that an interrupted one goes on to the same bits.

use super::super::effective_table::tests::{Groove, lambert, recipe};
use super::*;
use std::cell::RefCell;

/// Seconds of a stand-in for the filter: a direction costs as much as a hundred pairs.
fn seconds(pairs: &[Pair]) -> [f64; 2] {
    let mut directions: Vec<[u64; 3]> = pairs.iter().flat_map(|p| [p.wi, p.wo]).map(|w| w.to_array().map(f64::to_bits)).collect();
    directions.sort_unstable();
    directions.dedup();
    [1e-4 * directions.len() as f64, 1e-6 * pairs.len() as f64]
}

/// The values of a groove that costs time.
fn costly(groove: &Groove, pairs: &[Pair], quality: &Quality) -> Result<Effective> {
    let mut result = (groove.values(0.25 * quality.tolerance))(pairs, quality, 0.0..0.0)?;
    let [visibility, sums] = seconds(pairs).map(|s| 1e3 * s);
    result.summary.stages = vec![("visibility", visibility), ("sums", sums)];
    result.summary.directions = truncate_usize((visibility / 0.1).round());
    Ok(result)
}

#[test]
fn the_last_table_is_foreseen_and_progress_rises_to_1() {
    let groove = Groove::new(35.0, lambert(0.7));
    let recipe = BakeRecipe { quality: Quality { tolerance: 0.004, ..Quality::default() }, ..recipe() };
    let (told, calls) = (RefCell::new(Vec::new()), RefCell::new(Vec::new()));
    let forecast = |forecast: &BakeForecast| told.borrow_mut().push((forecast.clone(), calls.borrow().len()));
    let aids = BakeAids { forecast: &forecast, kept: None };
    let mut shares = vec![0.0];
    let table = build(&recipe, None, &aids, &mut |pairs, quality, share| {
        assert!(
            share.start >= shares[shares.len() - 1] - 1e-12 && share.end > share.start && share.end <= 1.0,
            "{share:?} after {shares:?}"
        );
        shares.push(share.end);
        calls.borrow_mut().push(seconds(pairs).iter().sum::<f64>());
        costly(&groove, pairs, quality)
    })
    .unwrap();
    let told = told.into_inner();
    let (last, before) = told.last().unwrap();
    assert_eq!((last.rings, last.values), (table.grid().rings(), table.values()));
    let took = calls.into_inner()[*before..].iter().sum::<f64>();
    assert!((0.5..2.0).contains(&(last.seconds / took)), "{} s foreseen, {took} s taken", last.seconds);
    let reached = table.about.error.relative_rms;
    assert!((0.5..2.0).contains(&(last.relative_rms / reached)), "an error of {} foreseen, {reached} reached", last.relative_rms);
    assert!(last.looser[0].1 < last.seconds && last.looser[1].1 < last.looser[0].1, "{:?}", last.looser);
}

#[test]
fn an_interrupted_bake_goes_on_with_what_was_kept_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("t.exr.unfinished");
    let groove = Groove::new(35.0, lambert(0.7));
    // Three blocks of a table of 20 rings.
    let recipe = BakeRecipe { rings: Some(20), ..recipe() };
    let aids = BakeAids { forecast: &|_| {}, kept: Some(&kept) };
    let whole = build(&recipe, None, &BakeAids::none(), &mut groove.values(0.001)).unwrap();
    let mut calls = 0;
    let interrupted = build(&recipe, None, &aids, &mut |pairs, quality, share| {
        calls += 1;
        if calls == 3 { Err(Error::Interrupted) } else { groove.values(0.001)(pairs, quality, share) }
    });
    assert!(matches!(interrupted, Err(Error::Interrupted)));
    let mut again = Vec::new();
    let table = build(&recipe, None, &aids, &mut |pairs, quality, share| {
        again.push(pairs.len());
        groove.values(0.001)(pairs, quality, share)
    })
    .unwrap();
    // The probes, and the blocks but the first.
    assert_eq!(again.len(), blocks(node_count(20), true).len(), "{again:?}");
    assert!(table.planes == whole.planes && table.av == whole.av && table.about == whole.about);

    // Another surface is not mistaken for it.
    let other = Groove::new(36.0, lambert(0.7));
    let table = build(&recipe, None, &aids, &mut other.values(0.001)).unwrap();
    assert!(table.planes == build(&recipe, None, &BakeAids::none(), &mut other.values(0.001)).unwrap().planes);
}
