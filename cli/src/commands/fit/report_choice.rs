//! The part of the report that says between which materials the photographs chose.

use biscale_fit::run::{Choice, Look, Screened};
use maud::{Markup, html};

/// The candidates with their evidence.
pub fn section(choice: &Choice) -> Markup {
    let percent = |share: Option<f64>| share.map_or_else(|| "-".to_owned(), |s| format!("{:.2} %", 100.0 * s));
    let held_out = |c: &Screened| c.held_out.iter().copied().reduce(f64::max);
    let mut order: Vec<&Screened> = choice.candidates.iter().collect();
    order.sort_by(|a, b| a.behind.unwrap_or(f64::INFINITY).total_cmp(&b.behind.unwrap_or(f64::INFINITY)));
    let chosen = &choice.candidates[choice.chosen].name;
    let remark = |c: &Screened| match (&c.ruled_out, c.name == *chosen, c.tied) {
        (Some(why), ..) => why.clone(),
        (None, true, _) => "chosen".to_owned(),
        (None, false, true) => "cannot be told from it".to_owned(),
        (None, false, false) => "clearly worse".to_owned(),
    };
    html! {
        h2 { "Which material" }
        p { "Chosen: " (choice.sentence()) "." }
        table {
            tr {
                th { "candidate" } th.n { "behind" } th.n { "that counts" } th.n { "enough" } th.n { "free numbers" } th.n { "training" } th.n { "close-up" } th.n { "held out" }
                th { "looked at" } th {}
            }
            @for c in &order {
                tr {
                    td { @if c.name == *chosen { b { (c.name) } } @else { (c.name) } }
                    td.n { @if let Some(b) = c.behind { (format!("{b:.1}")) } @else { "-" } }
                    td.n { @if let Some(l) = c.lead { (format!("{l:.1}")) } @else { "-" } }
                    td.n { @if let Some(e) = c.enough.filter(|_| c.behind.is_some_and(|b| b > 0.0)) { (format!("{e:.1}")) } @else { "-" } }
                    td.n { (c.numbers) } td.n { (percent(c.training)) } td.n { (percent(c.close_up)) } td.n { (percent(held_out(c))) }
                    td { (look(c.look)) } td { (remark(c)) }
                }
            }
        }
        p {
            "Behind: about -2 ln of the evidence over that of the best one, from the photographs that were fitted, the held-out ones, and the number of free numbers. That \
             counts: the same, but what free numbers cost counts against a candidate and never for it. Where that is less than \u{201c}enough\u{201d}, a candidate cannot be told from the best: the one with the fewest free numbers is taken. Errors are those of the look; the chosen material's own, \
             after its whole fit, stand below."
        }
        @for note in &choice.notes { p.flag { (note) } }
    }
}

fn look(look: Look) -> &'static str {
    match look {
        Look::None => "not at all",
        Look::First => "from its start",
        Look::Second => "by a short search",
        Look::Whole => "by a whole search",
    }
}
