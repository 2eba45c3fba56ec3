// A table that is wider than its place says so, and scrolls by the keyboard.
addEventListener("load", () => {
  const mark = () => document.querySelectorAll(".table-wrapper, .drawn").forEach(it => {
    it.scrollWidth > it.clientWidth + 1 ? it.setAttribute("tabindex", 0) : it.removeAttribute("tabindex");
  });
  addEventListener("resize", mark);
  mark();
});
