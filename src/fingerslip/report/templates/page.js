"use strict";
// Tables that sort, and folded parts that are printed.

function sortedBy(table, column, rising) {
  const body = table.tBodies[0];
  const key = (row) => {
    const text = row.cells[column].textContent.trim();
    const number = parseFloat(text.replace("\u2212", "-"));
    return Number.isNaN(number) ? [1, text] : [0, number];
  };
  const compare = (a, b) => {
    const [kindA, valueA] = key(a), [kindB, valueB] = key(b);
    // Numbers come first in both orders: what has no number stays at the end.
    if (kindA !== kindB) return kindA - kindB;
    const order = kindA ? valueA.localeCompare(valueB) : valueA - valueB;
    return rising ? order : -order;
  };
  for (const row of Array.from(body.rows).sort(compare)) body.append(row);
}

function makeSortable(table) {
  Array.from(table.tHead.rows[0].cells).forEach((cell, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = cell.textContent;
    cell.replaceChildren(button);
    button.addEventListener("click", () => {
      const rising = cell.getAttribute("aria-sort") !== "ascending";
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      cell.setAttribute("aria-sort", rising ? "ascending" : "descending");
      sortedBy(table, column, rising);
    });
  });
}

document.querySelectorAll("table[data-sortable]").forEach(makeSortable);

const unfolded = [];
window.addEventListener("beforeprint", () => {
  document.querySelectorAll("details:not([open])").forEach((one) => { one.open = true; unfolded.push(one); });
});
window.addEventListener("afterprint", () => { while (unfolded.length) unfolded.pop().open = false; });
