//! Report of an acceptance as a page that needs no network.

use super::report::{AcceptReport, Judged, short};
use crate::plot::page::escaped;

const STYLE: &str = "body{font-family:sans-serif;margin:2em;max-width:75em}\
table{border-collapse:collapse;width:100%}\
td,th{border-bottom:1px solid #ccc;padding:.3em .6em;text-align:left;vertical-align:top}\
.OUT{background:#fdd}.not{color:#777}";

/// Formats the report as HTML.
pub(super) fn of(report: &AcceptReport) -> String {
    let rows: String = report.figures.iter().map(row).collect();
    let counts = report.counts();
    let foot = escaped(report.foot);
    let serial = format!("0x{:08X}", report.serial);
    let program = report.program.as_deref().unwrap_or("written by a probe");
    let (hardware, version) = (escaped(&report.hardware), escaped(&report.version));
    format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\
<title>Foot {foot}, {serial}</title><style>{STYLE}</style>\n\
<h1>Foot {foot}, {serial}</h1>\n<p>{hardware}, version {version}, program {program}</p>\n\
<p><b>{counts}</b></p>\n<table>\n<tr><th>step<th>quantity<th>value<th>limits<th>virtual board<th>verdict\
<th>limits from, and what to do</tr>\n{rows}</table>\n</html>\n"
    )
}

fn row(figure: &Judged) -> String {
    let value = figure.value.map(short).unwrap_or_default();
    let predicted = figure.predicted.map(short).unwrap_or_default();
    let detail = match figure.detail.as_str() {
        "" => String::new(),
        detail => format!(" ({})", escaped(detail)),
    };
    let remedy = match figure.remedy {
        "" => String::new(),
        remedy => format!("<br><b>{}</b>", escaped(remedy)),
    };
    format!(
        "<tr class=\"{}\"><td>{}<td>{}<td>{value} {}{detail}<td>{}<td>{predicted}<td>{}<td>{}{remedy}</tr>\n",
        figure.verdict,
        figure.step,
        figure.name,
        figure.unit,
        figure.range,
        figure.verdict,
        escaped(figure.source),
    )
}
