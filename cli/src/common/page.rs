//! The frame of a report: one HTML file that holds everything, pictures too.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// What the reports of all commands look like.
const STYLE: &str = "body{font:15px/1.5 'DejaVu Sans',Verdana,Arial,sans-serif;max-width:62em;margin:2em auto;padding:0 1em;color:#222;background:#fff}\
table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em .7em;border-bottom:1px solid #ddd;text-align:left}\
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}h2{margin-top:1.6em;border-bottom:1px solid #ccc}small{color:#666}";

/// A page with `mark` as its first comment, by which its command knows it again, and with rules of its own after those of all reports.
pub fn page(mark: &str, title: &str, style: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        (PreEscaped(format!("<!-- {mark} -->\n")))
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(style)) }
            }
            body { (body) }
        }
    };
    page.into_string()
}
