"use strict";
// The page is complete without this script; it adds search, a filter, highlights in graphs and a choice of the theme.
addEventListener("DOMContentLoaded", () => {
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const tools = document.querySelector(".tools");
  const items = all("[data-item]");
  const texts = items.map(item => item.textContent.toLowerCase());
  const fine = new Set(["compatible", "note", "unmatched"]);
  let only = "";
  tools.hidden = false;

  function filter() {
    const words = document.getElementById("find").value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    items.forEach((item, number) => {
      const out = (only && fine.has(item.dataset.item)) || !words.every(word => texts[number].includes(word));
      item.toggleAttribute("data-out", Boolean(out));
      shown += out ? 0 : 1;
    });
    document.querySelector(".found").textContent =
      only || words.length ? `${shown} of ${items.length} rows and findings are shown` : "";
  }

  document.getElementById("find").addEventListener("input", filter);
  all("[data-only]").forEach(button => button.addEventListener("click", () => {
    only = button.dataset.only;
    all("[data-only]").forEach(each => each.setAttribute("aria-pressed", String(each === button)));
    filter();
  }));

  // A link to a row that is filtered out shows it again.
  addEventListener("hashchange", () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const hidden = target && target.closest("[data-out]");
    if (hidden) {
      document.getElementById("find").value = "";
      all("[data-only]")[0].click();
      target.scrollIntoView();
    }
  });

  document.getElementById("theme").addEventListener("click", () => {
    const root = document.documentElement;
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
  });

  all(".graph").forEach(graph => {
    const nodes = all("[data-node]", graph);
    const lines = all("[data-source]", graph);
    const light = number => {
      const near = new Set([number]);
      lines.forEach(line => {
        const own = line.dataset.source === number || line.dataset.target === number;
        line.classList.toggle("dim", number !== null && !own);
        if (own) near.add(line.dataset.source).add(line.dataset.target);
      });
      nodes.forEach(node => node.classList.toggle("dim", number !== null && !near.has(node.dataset.node)));
    };
    nodes.forEach(node => {
      node.addEventListener("mouseenter", () => light(node.dataset.node));
      node.addEventListener("focus", () => light(node.dataset.node));
      node.addEventListener("mouseleave", () => light(null));
      node.addEventListener("blur", () => light(null));
    });
  });

  let opened = [];
  addEventListener("beforeprint", () => {
    opened = all("details:not([open])");
    opened.forEach(each => { each.open = true; });
  });
  addEventListener("afterprint", () => opened.forEach(each => { each.open = false; }));
});
