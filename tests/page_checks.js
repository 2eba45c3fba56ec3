// What tests ask of a page: faults that a person would see.
(() => {
  const parse = colour => (colour.match(/[\d.]+/g) || []).map(Number);
  const linear = share => share <= 0.03928 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  const light = colour => [0.2126, 0.7152, 0.0722].reduce((sum, part, i) => sum + part * linear(colour[i] / 255), 0);

  function behind(element) { // the ground that it stands on
    for (let it = element; it; it = it.parentElement) {
      const colour = parse(getComputedStyle(it).backgroundColor);
      if (colour.length === 3 || colour[3] > 0.5) return colour;
    }
    return [255, 255, 255];
  }

  function pale() { // texts that are seen with less contrast than 3 to 1
    const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node; (node = walker.nextNode());) {
      const parent = node.parentElement, look = getComputedStyle(parent);
      if (!node.textContent.trim() || parent.closest("script, style, option, .viewer-stage")) continue;
      if (!parent.getClientRects().length || look.visibility === "hidden") continue;
      const drawing = parent.closest("svg"), ground = behind(drawing ?? parent);
      const [high, low] = [light(parse(drawing ? look.fill : look.color)), light(ground)].sort((a, b) => b - a);
      if ((high + 0.05) / (low + 0.05) < 3) found.push([node.textContent.trim().slice(0, 40), look.fill, look.color, ground.join()]);
    }
    return found;
  }

  function wide() { // what sticks out of the page, and is in nothing that scrolls by itself
    const out = it => it.getBoundingClientRect().right > innerWidth + 1 && !it.closest(".wide, pre, svg, .viewer-stage");
    return [...document.querySelectorAll("body *")].filter(out).slice(0, 5)
      .map(it => [it.tagName, String(it.className), Math.round(it.getBoundingClientRect().right)]);
  }

  const cut = () => [...document.querySelectorAll(".wide")].filter(it => it.scrollWidth > it.clientWidth + 1)
    .map(it => [it.innerText.slice(0, 60), it.scrollWidth]);
  const signed = it => getComputedStyle(it, "::before").content.includes("scroll for more");
  const unsaid = () => [...document.querySelectorAll("body *")] // what is cut without a sign
    .filter(it => ["auto", "scroll"].includes(getComputedStyle(it).overflowX) && it.scrollWidth > it.clientWidth + 1 && !signed(it))
    .map(it => [it.tagName, String(it.className), it.innerText.slice(0, 40)]);
  const open = () => document.querySelectorAll("details").forEach(it => { it.open = true; });
  const controls = () => [...document.querySelectorAll(".controls, .viewer :is(button, select, input, canvas)")]
    .filter(it => it.getClientRects().length).map(it => [it.tagName, it.id]);
  window.checks = { pale, wide, cut, unsaid, open, controls };
})();
