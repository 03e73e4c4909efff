// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace vlp {

/// CSS style sheet of report.html. Verdicts differ not only in color but also in words and borders.
constexpr std::string_view kReportStyle = R"css(
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1rem; max-width: 54rem; background: #fff; color: #1b1b1b;
  font: 1rem/1.5 "DejaVu Sans", Verdana, system-ui, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; line-height: 1.25; margin: 0 0 .75rem; }
h2 { font-size: 1.25rem; margin: 2rem 0 .5rem; padding-bottom: .25rem; border-bottom: 1px solid #999; }
p { margin: .5rem 0; }
.verdict { margin: .5rem 0 1rem; padding: .75rem 1rem; border: .25rem solid; border-radius: .5rem; }
.verdict strong { display: block; font-size: 2.75rem; line-height: 1.1; letter-spacing: .04em; }
.pass { color: #00573c; background: #e6f5ef; }
.fail { color: #8a2f00; background: #fdeee5; border-style: double; border-width: .5rem; }
.none { color: #3d3d3d; background: #f2f2f2; border-style: dashed; }
.scroll { overflow-x: auto; max-width: 100%; }
table { border-collapse: collapse; font-size: .95rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: bold; padding: .5rem 0 .25rem; }
th, td { text-align: left; vertical-align: top; padding: .25rem 1rem .25rem 0; border-bottom: 1px solid #ccc;
  overflow-wrap: normal; }
tbody th { font-weight: normal; min-width: 8rem; }
thead th { border-bottom: 2px solid #555; }
tr.marked th, tr.marked td { font-weight: bold; color: #8a2f00; }
figure { margin: 1rem 0; }
img { display: block; width: 100%; min-width: 28rem; max-width: 46rem; height: auto; margin: 0 auto; }
figcaption { font-size: .9rem; color: #333; }
details { margin: .5rem 0; }
summary { cursor: pointer; font-weight: bold; padding: .25rem 0; }
code { font: .85rem/1.4 "DejaVu Sans Mono", ui-monospace, monospace; }
.digests { font: .8rem/1.4 "DejaVu Sans Mono", ui-monospace, monospace; }
.digests td { overflow-wrap: anywhere; min-width: 18rem; }
footer { margin-top: 2rem; font-size: .85rem; color: #444; }
.signature { margin: 4rem 0 1rem; width: 20rem; max-width: 100%; border-top: 1px solid #555; font-size: .85rem; }
@page { size: A4; margin: 14mm 15mm; @bottom-right { content: counter(page) " / " counter(pages); font-size: 8pt; } }
@media print {
  body { max-width: none; padding: 0; font-size: 10pt; }
  h2, caption, summary { break-after: avoid; }
  figure, .verdict, tr { break-inside: avoid; }
  img { min-width: 0; max-width: 100%; max-height: 108mm; object-fit: contain; }
  .large img { max-height: 150mm; }
  table, figcaption { font-size: 9pt; }
  .scroll { overflow: visible; }
  .verdict { print-color-adjust: exact; }
  .digests table { font-size: 7pt; line-height: 1.2; }
  .digests th, .digests td { padding-top: .1rem; padding-bottom: .1rem; }
  details::details-content { content-visibility: visible; block-size: auto; }
}
)css";

}  // namespace vlp
