"use strict";
// Sortable tables: a click on the head of a column, or Enter on it, sorts by this column; the next click reverses the order.
// Entries that are not numbers come last. Tables of one row, of connected rows, or marked data-fixed cannot be sorted.
(() => {
  const DIGITS = "⁰¹²³⁴⁵⁶⁷⁸⁹", SCALE = { ms: 1e-3, s: 1, min: 60 };

  function text(cell) { // the main text of a cell, without its small print
    const copy = cell.cloneNode(true);
    for (const small of copy.querySelectorAll("small")) small.remove();
    return copy.textContent.trim();
  }

  function power(raised) {
    return Number([...raised].map(one => one === "⁻" ? "-" : DIGITS.indexOf(one)).join(""));
  }

  function number(said) { // NaN if the text does not begin with a number
    const plain = said.replace(/\u2212/g, "-").replace(/(\d)[\u202f\u2009 ](?=\d{3})/g, "$1");
    const found = plain.match(/^[±<>~]?\s*(-?\d+(?:\.\d+)?(?:e[-+]?\d+)?)(?:\s*×\s*10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+|-?\d+))?\s*(.*)$/);
    if (!found) return /^-?infinite/.test(plain) ? (plain[0] === "-" ? -Infinity : Infinity) : NaN;
    const raised = found[2] === undefined ? 0 : /\d/.test(found[2]) ? Number(found[2]) : power(found[2]);
    return Number(found[1]) * 10 ** raised * (SCALE[found[3]] ?? 1);
  }

  function groups(body) { // each row with the rows of class "more" below it
    const found = [];
    for (const row of body.rows) row.classList.contains("more") && found.length ? found.at(-1).push(row) : found.push([row]);
    return found;
  }

  function sort(table, column, direction) {
    const body = table.tBodies[0], rows = groups(body).map(group => ({ group, said: text(group[0].cells[column]) }));
    for (const row of rows) row.value = number(row.said);
    const nothing = said => ["", "–", "not a number"].includes(said);
    const numeric = rows.every(row => nothing(row.said) || !Number.isNaN(row.value));
    const empty = row => nothing(row.said) || (numeric && Number.isNaN(row.value));
    rows.sort((a, b) => empty(a) - empty(b) || (empty(a) ? 0 : direction * (numeric ? a.value - b.value || 0 : a.said.localeCompare(b.said))));
    body.append(...rows.flatMap(row => row.group));
  }

  function sortable(table) {
    const head = table.tHead?.rows[table.tHead.rows.length - 1], body = table.tBodies[0];
    if (!head || table.tBodies.length !== 1 || "fixed" in table.dataset || groups(body).length < 2) return;
    const width = head.cells.length, rows = groups(body).map(group => group[0]);
    if ([...head.cells].some(cell => cell.colSpan > 1) || rows.some(row => row.cells.length !== width || [...row.cells].some(cell => cell.rowSpan > 1 || cell.colSpan > 1))) return;
    [...head.cells].forEach((cell, column) => {
      if (!cell.textContent.trim()) return;
      const button = document.createElement("button");
      button.type = "button";
      button.className = "sort";
      button.title = "sort by this column";
      button.append(...cell.childNodes);
      cell.append(button);
      button.addEventListener("click", () => {
        const direction = cell.getAttribute("aria-sort") === "ascending" ? -1 : 1;
        for (const other of head.cells) other.removeAttribute("aria-sort");
        cell.setAttribute("aria-sort", direction === 1 ? "ascending" : "descending");
        sort(table, column, direction);
      });
    });
  }

  for (const table of document.querySelectorAll("table")) sortable(table);
  for (const wide of document.querySelectorAll(".wide, figure, .plot")) // elements that scroll can be scrolled with the keyboard
    new ResizeObserver(() => wide.scrollWidth > wide.clientWidth ? wide.setAttribute("tabindex", "0") : wide.removeAttribute("tabindex")).observe(wide);
})();
