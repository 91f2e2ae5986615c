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

// A picture that is shown smaller than it is can be seen whole, and scrolled.
function makeZoomable(picture) {
  const toggle = () => picture.parentElement.classList.toggle("whole");
  const offer = () => {
    if (picture.clientWidth >= picture.naturalWidth) return;
    picture.setAttribute("role", "button");
    picture.tabIndex = 0;
    picture.title = "Full size, and back";
  };
  picture.addEventListener("click", () => { if (picture.tabIndex === 0) toggle(); });
  picture.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    toggle();
  });
  if (picture.complete) offer();
  picture.addEventListener("load", offer);
  // Pictures of folded parts have their size when these are opened.
  new ResizeObserver(() => { if (picture.clientWidth) offer(); }).observe(picture);
}

document.querySelectorAll("img[data-zoom]").forEach(makeZoomable);

const unfolded = [];
window.addEventListener("beforeprint", () => {
  document.querySelectorAll("details:not([open])").forEach((one) => { one.open = true; unfolded.push(one); });
});
window.addEventListener("afterprint", () => { while (unfolded.length) unfolded.pop().open = false; });
