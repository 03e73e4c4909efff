// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
//
// Runs in a page and returns what is wrong with it: pictures, and the accessibility that a program can
// see (of the rules of WCAG 2.1, levels A and AA, those that apply to a page of text, tables and
// pictures).
(async () => {
  const problems = [];
  const all = (selector) => [...document.querySelectorAll(selector)];
  const name = (element) => element.outerHTML.replace(/\s+/g, " ").slice(0, 60);

  // Language, title, headings.
  if (!document.documentElement.lang) problems.push("no language");
  if (!document.title.trim()) problems.push("no title");
  const viewport = document.querySelector("meta[name=viewport]");
  if (!viewport) problems.push("no viewport");
  else if (/user-scalable=no|maximum-scale/.test(viewport.content)) problems.push("cannot be zoomed");
  if (all("h1").length !== 1) problems.push(`${all("h1").length} headings of level 1`);
  let last = 0;
  for (const heading of all("h1, h2, h3, h4, h5, h6")) {
    const level = Number(heading.tagName[1]);
    if (level > last + 1) problems.push(`heading leaves out a level: ${name(heading)}`);
    if (!heading.textContent.trim()) problems.push("an empty heading");
    last = level;
  }
  if (all("main").length !== 1) problems.push(`${all("main").length} main parts`);
  const ids = all("[id]").map((element) => element.id);
  for (const id of new Set(ids.filter((id, i) => ids.indexOf(id) !== i))) problems.push(`id twice: ${id}`);
  if (all("script").length) problems.push("has a script");

  // Tables.
  for (const table of all("table")) {
    if (!table.querySelector("th")) problems.push(`a table without headers: ${name(table)}`);
    for (const header of table.querySelectorAll("th")) {
      if (!["col", "row"].includes(header.scope)) problems.push(`a header without scope: ${name(header)}`);
      if (!header.textContent.trim()) problems.push(`an empty header: ${name(header)}`);
    }
  }
  for (const region of all("[role=region]")) {
    if (!region.getAttribute("aria-label")) problems.push(`a region without a name: ${name(region)}`);
  }
  for (const box of all("*")) {
    const scrolls = /auto|scroll/.test(getComputedStyle(box).overflowX) && box.scrollWidth > box.clientWidth;
    if (scrolls && box.tabIndex < 0) problems.push(`scrolls, but not by keyboard: ${name(box)}`);
  }

  // Images: loaded, and not of a single color.
  for (const image of all("img")) {
    const what = image.alt || name(image);
    if (!image.alt.trim()) problems.push(`a picture without a text: ${name(image)}`);
    await image.decode().catch(() => {});
    if (!image.naturalWidth) {
      problems.push(`an empty picture: ${what}`);
      continue;
    }
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [200, 200];
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0, 200, 200);
    const colors = new Set(new Uint32Array(context.getImageData(0, 0, 200, 200).data.buffer));
    if (colors.size < 5) problems.push(`a picture of nothing: ${what}`);
  }
  for (const figure of all("figure")) {
    if (!figure.querySelector("figcaption")?.textContent.trim()) problems.push(`no caption: ${name(figure)}`);
  }

  // Text: contrast (WCAG 1.4.3) and size.
  const parts = (color) => color.match(/[\d.]+/g).map(Number);
  const luminance = (color) => {
    const [r, g, b] = parts(color).map((c) => c / 255)
      .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const background = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const color = getComputedStyle(at).backgroundColor;
      if ((parts(color)[3] ?? 1) > 0) return color;
    }
    return "rgb(255, 255, 255)";
  };
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  let letters = 0;
  while (texts.nextNode()) {
    const element = texts.currentNode.parentElement;
    if (!texts.currentNode.data.trim() || !element.getClientRects().length) continue;
    letters += texts.currentNode.data.trim().length;
    const style = getComputedStyle(element);
    const [a, b] = [luminance(style.color), luminance(background(element))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < 4.5) problems.push(`contrast ${contrast.toFixed(1)}: ${name(element)}`);
    if (parseFloat(style.fontSize) < 12) problems.push(`text of ${style.fontSize}: ${name(element)}`);
  }
  if (!letters) problems.push("no text");
  return problems;
})()
