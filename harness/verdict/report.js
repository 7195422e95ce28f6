// A click on a heading sorts its table; a field above a long table keeps the rows that hold every word of it.
"use strict";
const LONG = 20;  // rows: a shorter table needs no field
const text = (row, column) => row.cells[column].textContent.trim();
const number = (cell) => parseFloat(cell.replace("\u2212", "-"));

function compare(a, b) {
  const [x, y] = [number(a), number(b)];
  if (isNaN(x) !== isNaN(y)) return isNaN(x) ? 1 : -1;  // what is no number comes last
  return isNaN(x) || x === y ? a.localeCompare(b) : x - y;
}

function sort(table, column) {
  const headings = [...table.tHead.rows[0].cells];
  const down = headings[column].getAttribute("aria-sort") === "ascending";
  headings.forEach((heading, i) => heading.setAttribute("aria-sort", i !== column ? "none" : down ? "descending" : "ascending"));
  const rows = [...table.tBodies[0].rows];
  rows.sort((a, b) => (down ? -1 : 1) * compare(text(a, column), text(b, column)));
  table.tBodies[0].append(...rows);
}

function filter(table, words) {
  for (const row of table.tBodies[0].rows) {
    const held = row.textContent.toLowerCase();
    row.hidden = !words.every((word) => held.includes(word));
  }
}

for (const table of document.querySelectorAll("table.flown, table.listed, table.moved, table.changes, table.disturbed")) {
  [...table.tHead.rows[0].cells].forEach((heading, column) => {
    heading.setAttribute("aria-sort", "none");
    heading.tabIndex = 0;
    heading.addEventListener("click", () => sort(table, column));
    heading.addEventListener("keydown", (event) => { if (event.key === "Enter") sort(table, column); });
  });
  if (table.tBodies[0].rows.length < LONG) continue;
  const field = document.createElement("input");
  field.className = "filter";
  field.type = "search";
  field.placeholder = "keep rows that hold these words";
  field.addEventListener("input", () => filter(table, field.value.toLowerCase().split(/\s+/)));
  table.parentElement.before(field);
}
