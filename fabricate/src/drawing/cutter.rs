//! Pages for machines: some layers alone, folds as rows of short cuts.

use super::page::{Item, Layer, Mark, Page, Style};
use glam::DVec2;

/// The pages with these layers only.
pub fn only(pages: &[Page], layers: &[Layer]) -> Vec<Page> {
    let kept = |page: &Page| page.items.iter().filter(|i| layers.contains(&i.layer)).cloned().collect();
    pages.iter().map(|page| Page { size: page.size, items: kept(page) }).collect()
}

/// The pages with their fold lines as rows of cuts of a length with gaps between, mm: for machines that cut and do not score. A row begins
/// and ends with half a gap at least, so that folds that meet in a corner leave paper there.
pub fn perforated(pages: &[Page], [cut, gap]: [f64; 2]) -> Vec<Page> {
    let row = |item: &Item| -> Vec<Item> {
        match &item.mark {
            Mark::Line { points, closed: false, style: Style::Mountain | Style::Valley } if item.layer == Layer::Score => points
                .windows(2)
                .flat_map(|ends| cuts([ends[0], ends[1]], cut, gap))
                .map(|ends| Item {
                    layer: Layer::Score,
                    mark: Mark::Line { points: ends.to_vec(), closed: false, style: Style::Cut },
                    data: item.data.clone(),
                })
                .collect(),
            _ => vec![item.clone()],
        }
    };
    pages.iter().map(|page| Page { size: page.size, items: page.items.iter().flat_map(row).collect() }).collect()
}

/// Cuts along a line, centred; one shorter cut where there is no room for a whole one.
fn cuts([a, b]: [DVec2; 2], cut: f64, gap: f64) -> Vec<[DVec2; 2]> {
    let (length, along) = (a.distance(b), (b - a).normalize_or_zero());
    let count = (length / (cut + gap)).floor().max(1.0);
    let cut = cut.min(0.5 * length);
    let step = cut + gap;
    let begin = 0.5 * (length - (count - 1.0) * step - cut);
    (0..count as u32).map(|k| begin + f64::from(k) * step).map(|t| [a + t * along, a + (t + cut) * along]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_cuts_is_centred_and_leaves_its_ends_whole() {
        let cut_lines = cuts([DVec2::ZERO, DVec2::new(30.0, 0.0)], 2.0, 1.0);
        assert_eq!(cut_lines.len(), 10);
        assert!((cut_lines[0][0].x - 0.5).abs() < 1e-12 && (cut_lines[9][1].x - 29.5).abs() < 1e-12);
        assert!(cut_lines.windows(2).all(|w| (w[1][0].x - w[0][1].x - 1.0).abs() < 1e-12));
        // Too short for one: half of it is cut, in the middle.
        let one = cuts([DVec2::ZERO, DVec2::new(1.0, 0.0)], 2.0, 1.0);
        assert_eq!(one, vec![[DVec2::new(0.25, 0.0), DVec2::new(0.75, 0.0)]]);
    }

    #[test]
    fn only_the_layers_that_are_asked_for_are_kept_and_folds_are_no_whole_lines() {
        let mut page = Page { size: DVec2::splat(100.0), items: Vec::new() };
        page.line(Layer::Score, Style::Mountain, &[DVec2::ZERO, DVec2::new(30.0, 0.0)], false);
        page.line(Layer::Cut, Style::Cut, &[DVec2::ZERO, DVec2::new(30.0, 0.0)], false);
        page.text(DVec2::ZERO, 3.0, "1");
        let score = only(&perforated(&[page.clone()], [2.0, 1.0]), &[Layer::Score]);
        assert_eq!(score[0].items.len(), 10);
        assert!(score[0].items.iter().all(|i| i.layer == Layer::Score));
        assert_eq!(only(&[page], &[Layer::Cut, Layer::Score])[0].items.len(), 2);
    }
}
