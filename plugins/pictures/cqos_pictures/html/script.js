"use strict";
// The page is complete without this script; it adds search, a filter, zoom and highlights in graphs, and a choice of the theme.
addEventListener("DOMContentLoaded", () => {
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const tools = document.querySelector(".tools");
  const find = document.getElementById("find");
  const items = all("[data-item]");
  const texts = items.map(item => item.textContent.toLowerCase());
  const sections = all("section").filter(section => section.querySelector(":scope > .more"));
  // What sizes the drawing of a graph when it can be seen for the first time.
  const sizing = [];
  tools.hidden = false;

  function filter() {
    const only = tools.querySelector("[data-only][aria-pressed=true]").dataset.only;
    const words = find.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    items.forEach((item, number) => {
      const out = (only && item.dataset.item !== only) || !words.every(word => texts[number].includes(word));
      item.toggleAttribute("data-out", Boolean(out));
      shown += out ? 0 : 1;
    });
    document.querySelector(".found").textContent =
      only || words.length ? `${shown} of ${items.length} shown` : "";
    sections.forEach(section => {
      const out = all("[data-out]", section).length;
      const more = section.querySelector(":scope > .more");
      more.hidden = !out;
      more.firstElementChild.textContent = `${out} not shown.`;
    });
    sizing.forEach(size => size());
  }

  const choose = only => {
    all("[data-only]").forEach(each => each.setAttribute("aria-pressed", String(each.dataset.only === only)));
    filter();
  };
  const everything = () => {
    find.value = "";
    choose("");
  };
  find.addEventListener("input", filter);
  all("[data-only]").forEach(button => button.addEventListener("click", () => choose(button.dataset.only)));
  all(".more button").forEach(button => button.addEventListener("click", everything));
  filter();

  // A link to an entry shows it, also where it is filtered out or closed.
  function reveal() {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    if (target.closest("[data-out]")) everything();
    for (let at = target.closest("details"); at; at = at.parentElement.closest("details")) at.open = true;
    target.scrollIntoView();
  }
  addEventListener("hashchange", reveal);
  reveal();

  all(".findings").forEach(section => {
    const button = section.querySelector(".all");
    if (!button) return;
    button.hidden = false;
    button.addEventListener("click", () => {
      const open = button.getAttribute("aria-expanded") === "false";
      all(".finding", section).forEach(each => { each.open = open; });
      button.setAttribute("aria-expanded", String(open));
      button.textContent = open ? "Close all" : "Open all";
    });
  });

  document.getElementById("theme").addEventListener("click", () => {
    const root = document.documentElement;
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
  });

  const least = 0.1, most = 4, step = 1.25;
  // A drawing that is too large at first scrolls rather than has letters that nobody can read: to both sides on a narrow screen.
  const readable = 0.75, smallest = innerWidth < 768 ? readable : 0.4;
  all(".graph").forEach(graph => {
    const output = graph.querySelector("output");
    const stages = all(".stage", graph);
    const scales = new Map();
    const visible = () => stages.find(stage => stage.clientWidth);
    const show = (stage, scale, x = stage.clientWidth / 2, y = stage.clientHeight / 2) => {
      const svg = stage.querySelector("svg");
      const before = svg.getBoundingClientRect(), frame = stage.getBoundingClientRect();
      const at = [(frame.left + x - before.left) / before.width, (frame.top + y - before.top) / before.height];
      const to = Math.min(most, Math.max(least, scale));
      svg.setAttribute("width", svg.viewBox.baseVal.width * to);
      svg.setAttribute("height", svg.viewBox.baseVal.height * to);
      // The point of the drawing that was there stays there.
      const after = svg.getBoundingClientRect();
      stage.scrollLeft += after.left + at[0] * after.width - frame.left - x;
      stage.scrollTop += after.top + at[1] * after.height - frame.top - y;
      scales.set(stage, to);
      output.textContent = `${Math.round(to * 100)} %`;
    };
    // By which factors a drawing is as wide and as high as its frame.
    const room = stage => {
      const box = stage.querySelector("svg").viewBox.baseVal;
      const { paddingLeft, paddingTop, maxHeight } = getComputedStyle(stage);
      const width = stage.clientWidth - 2 * parseFloat(paddingLeft) - 1;
      const height = parseFloat(maxHeight) - 2 * parseFloat(paddingTop) - 2;
      return [width / box.width, height / box.height];
    };
    const size = () => {
      const stage = visible();
      if (!stage) return;
      const [width, height] = room(stage);
      show(stage, scales.get(stage) ?? Math.max(smallest, Math.min(1, width, Math.max(height, readable))));
    };
    const change = {
      in: stage => show(stage, scales.get(stage) * step),
      out: stage => show(stage, scales.get(stage) / step),
      fit: stage => show(stage, Math.min(1, ...room(stage))),
    };
    all("[data-zoom]", graph).forEach(button =>
      button.addEventListener("click", () => change[button.dataset.zoom](visible())));
    all("input", graph).forEach(input => input.addEventListener("change", size));
    all("[hidden]", graph).forEach(each => { each.hidden = false; });
    stages.forEach(stage => {
      stage.addEventListener("wheel", event => {
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault();
        const frame = stage.getBoundingClientRect();
        const by = event.deltaY < 0 ? step : 1 / step;
        show(stage, scales.get(stage) * by, event.clientX - frame.left, event.clientY - frame.top);
      }, { passive: false });
      stage.addEventListener("keydown", event => {
        const named = { "+": "in", "=": "in", "-": "out", "0": "fit" }[event.key];
        if (!named || event.ctrlKey || event.metaKey || event.altKey) return;
        event.preventDefault();
        change[named](stage);
      });
      highlight(stage);
    });
    sizing.push(size);
    size();
  });

  function highlight(stage) {
    const nodes = all("[data-node]", stage);
    const lines = all("[data-source]", stage);
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
  }

  let opened = [];
  addEventListener("beforeprint", () => {
    opened = all("details:not([open])");
    opened.forEach(each => { each.open = true; });
  });
  addEventListener("afterprint", () => opened.forEach(each => { each.open = false; }));
});
