(() => {
  const colour = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  // "@name" in a colour's place is one of the page's colours
  const coloured = (value, key) => {
    if (typeof value === "string") return /color$/.test(key) && value[0] === "@" ? colour(value.slice(1)) : value;
    if (Array.isArray(value)) return value.map(each => coloured(each, key));
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(Object.entries(value).map(([name, each]) => [name, coloured(each, name)]));
  };
  const narrow = window.innerWidth < 576;
  const styled = layout => {
    const page = {
      font: { family: getComputedStyle(document.body).fontFamily, size: narrow ? 11 : 13, color: colour("text") },
      colorway: ["c1", "c2", "c3", "c4", "c5", "c6"].map(colour),
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      margin: { l: narrow ? 48 : 64, r: 12, t: 34, b: 50 },
      legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", traceorder: "normal", bgcolor: "rgba(0,0,0,0)" },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("muted"), activecolor: colour("c1") },
      hoverlabel: { bgcolor: colour("card"), bordercolor: colour("line"), font: { color: colour("text") } },
      ...layout,
    };
    for (const name of new Set([...Object.keys(layout).filter(key => /^[xy]axis/.test(key)), "xaxis", "yaxis"]))
      page[name] = {
        gridcolor: colour("grid"), linecolor: colour("line"), zerolinecolor: colour("line"),
        automargin: true, ...layout[name], title: { standoff: 10, ...layout[name]?.title },
      };
    return page;
  };
  const draw = script => {
    const name = script.dataset.chart, chart = coloured(JSON.parse(script.textContent)), place = document.getElementById(name);
    Plotly.react(name, chart.data, styled(chart.layout), {
      responsive: true, displaylogo: false, displayModeBar: narrow ? false : "hover",
      // named one by one: of its own accord plotly offers to upload the chart
      modeBarButtons: [["toImage"], ["zoom2d", "pan2d"], ["zoomIn2d", "zoomOut2d", "resetScale2d"]], plotlyServerURL: "",
      toImageButtonOptions: { filename: name, scale: 2 },
    });
    place.classList.add("drawn");  // its still is for paper
  };
  const charts = [...document.querySelectorAll("[data-chart]")];
  // one thing at a time, so that the page answers in between
  const later = work => (window.requestIdleCallback ?? setTimeout)(work, { timeout: 200 });
  const next = () => {
    const script = charts.find(each => !each.drawn);
    if (!script) return;
    script.drawn = true;
    draw(script);
    document.getElementById(script.dataset.chart).dispatchEvent(new Event("drawn", { bubbles: true }));
    later(next);
  };
  const start = () => {
    const text = document.getElementById("plotly").textContent;
    document.head.append(Object.assign(document.createElement("script"), { textContent: text }));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach(draw));
    later(next);
  };
  addEventListener("load", () => requestAnimationFrame(() => later(start)));
})();
