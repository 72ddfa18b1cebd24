// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

namespace mono3d::tools {

// The look of a page: one column, light or dark as the reader's system has it.
inline constexpr char kStyle[] = R"css(
:root {
  --ground: #fbfbfa; --card: #ffffff; --text: #22252a; --quiet: #646b75; --line: #e3e4e6;
  --accent: #1f5fa8; --second: #c2571a;
}
@media (prefers-color-scheme: dark) {
  :root {
    --ground: #16181b; --card: #1e2125; --text: #e3e5e8; --quiet: #9aa1ab; --line: #33373d;
    --accent: #7ab3f2; --second: #f0a067;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0; background: var(--ground); color: var(--text);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif;
}
main { max-width: 68rem; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
h1 { font-size: 1.8rem; font-weight: 600; line-height: 1.2; margin: 0 0 .3rem; }
h2 { font-size: 1.25rem; font-weight: 600; margin: 3rem 0 .6rem; }
header p, .note, figcaption, footer, .title, .key dt, .key span { color: var(--quiet); }
header p { margin: 0; overflow-wrap: anywhere; }
p { max-width: 46rem; overflow-wrap: anywhere; }
.key {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(9.5rem, 1fr)); gap: 1px;
  margin: 1.75rem 0 0; background: var(--line); border: 1px solid var(--line);
  border-radius: 8px; overflow: hidden;
}
.key div { background: var(--card); padding: .8rem 1rem; }
.key dt, .key span { font-size: .82rem; }
.key dd { margin: 0; }
.key b { display: block; font-size: 1.45rem; font-weight: 600; line-height: 1.35; }
.title { font-size: .85rem; margin: 1.2rem 0 .2rem; }
.table { overflow-x: auto; margin: 0 0 .4rem; }
details > .title { display: none; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { padding: .32rem .85rem .32rem 0; text-align: right; white-space: nowrap;
  border-bottom: 1px solid var(--line); }
th { font-weight: 400; }
thead th { color: var(--quiet); font-size: .82rem; vertical-align: bottom; }
th:first-child { text-align: left; }
.note { font-size: .85rem; margin: .3rem 0; }
a { color: var(--accent); }
figure { margin: 1.6rem 0; }
figure img, .drawing svg { display: block; max-width: 100%; height: auto; }
figure img { background: #fff; border: 1px solid var(--line); border-radius: 6px; }
.drawing { max-width: 40rem; color: var(--text); }
.drawing.wide { max-width: 60rem; overflow-x: auto; }
.drawing.wide svg { min-width: 34rem; }
pre { background: var(--card); border: 1px solid var(--line); border-radius: 6px;
  padding: .7rem .9rem; white-space: pre-wrap; overflow-wrap: anywhere; font-size: .85rem; }
.view3d canvas { display: block; width: 100%; height: min(65vh, 36rem, 110vw); border-radius: 6px;
  border: 1px solid var(--line); touch-action: none; cursor: grab; }
.view3d-controls { display: flex; flex-wrap: wrap; gap: 1rem; align-items: center;
  margin-top: .5rem; font-size: .9rem; }
figcaption { font-size: .88rem; margin-top: .5rem; max-width: 46rem; }
.curve { fill: none; stroke: var(--accent, #1f5fa8); stroke-width: 2; }
.curve.oracle { stroke: var(--second, #c2571a); stroke-dasharray: 6 4; }
details { margin: 1rem 0; }
summary { cursor: pointer; color: var(--accent); }
footer { margin-top: 4rem; padding-top: 1rem; border-top: 1px solid var(--line);
  font-size: .85rem; overflow-wrap: anywhere; }
@media (max-width: 34rem) {
  main { padding: 1.5rem 1rem 3rem; }
  h1 { font-size: 1.45rem; }
  th, td { white-space: normal; padding-right: .6rem; }
}
@media print { figure, table { break-inside: avoid; } }
)css";

}  // namespace mono3d::tools
