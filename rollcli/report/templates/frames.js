(() => {
  // the table of all frames: only the rows in view are in the document, so that 10,000 are as quick as ten
  const { rows, places } = JSON.parse(document.getElementById("rows").textContent);
  const NUMBER = 0, FILE = 1, STATUS = 2, ROLL = 3, ANGLE = 4, WHY = 5;
  const box = document.querySelector(".frames .rows"), space = box.firstElementChild;
  const search = document.querySelector(".frames input"), count = document.querySelector(".frames .count");
  const detail = document.querySelector(".frames .detail"), heads = [...document.querySelectorAll(".frames [data-sort]")];
  const texts = rows.map(row => [row[FILE], row[STATUS], row[WHY]].join("\n").toLowerCase());
  const first = new Map();
  rows.forEach((row, place) => { if (!first.has(row[FILE])) first.set(row[FILE], place); });
  let order = rows.map((_, place) => place), sorted = NUMBER, falling = false, selected = -1;

  const element = (tag, className, text) => Object.assign(document.createElement(tag), { className, textContent: text });
  const link = place => first.get(rows[place][FILE]) === place
    ? "#frame=" + encodeURIComponent(rows[place][FILE]) : "#row=" + rows[place][NUMBER];
  const height = () => parseFloat(getComputedStyle(box).getPropertyValue("--height"))
    * parseFloat(getComputedStyle(document.documentElement).fontSize);

  const draw = () => {
    const each = height(), start = Math.max(0, Math.floor(box.scrollTop / each) - 5);
    const end = Math.min(order.length, Math.ceil((box.scrollTop + box.clientHeight) / each) + 5);
    space.style.height = order.length * each + "px";
    box.style.maxHeight = rows.length * each + 2 + "px";
    space.replaceChildren(...order.slice(start, end).map((place, i) => {
      const row = rows[place], line = element("a", "row", "");
      line.href = link(place);
      line.setAttribute("role", "row");
      line.setAttribute("aria-rowindex", start + i + 2);
      if (place === selected) line.setAttribute("aria-current", "true");
      line.style.top = (start + i) * each + "px";
      const name = element("span", "name", ""), end = row[FILE].lastIndexOf("/") + 1;
      // a long folder is shortened, so that the file's own name is seen
      name.append(element("i", "", row[FILE].slice(0, end)), element("b", "", row[FILE].slice(end)));
      line.append(element("span", "", row[NUMBER].toLocaleString("en")), name,
        element("span", row[STATUS], row[STATUS]), element("span", "", row[ANGLE]), element("span", "reason", row[WHY]));
      [...line.children].forEach(cell => cell.setAttribute("role", "cell"));
      return line;
    }));
  };
  const arrange = () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    order = rows.map((_, place) => place).filter(place => words.every(word => texts[place].includes(word)));
    const compare = (one, other) => typeof one === "number" ? one - other : one < other ? -1 : one > other ? 1 : 0;
    order.sort((one, other) => {
      const a = rows[one][sorted], b = rows[other][sorted];
      if (a === null || b === null) return (a === null) - (b === null) || one - other;  // without a value: last
      return (falling ? compare(b, a) : compare(a, b)) || one - other;
    });
    count.textContent = `${order.length.toLocaleString("en")} of ${rows.length.toLocaleString("en")}`;
    heads.forEach(head => head.parentElement.setAttribute("aria-sort",
      Number(head.dataset.sort) !== sorted ? "none" : falling ? "descending" : "ascending"));
    box.scrollTop = 0;
    draw();
  };
  const select = place => {
    selected = place;
    if (!order.includes(place)) { search.value = ""; arrange(); }
    const each = height(), top = order.indexOf(place) * each;
    if (top < box.scrollTop || top + each > box.scrollTop + box.clientHeight)
      box.scrollTop = top - (box.clientHeight - each) / 2;
    draw();
    const row = rows[place], shown = document.getElementById("pictures-" + row[NUMBER]);
    const facts = element("p", "", `frame ${row[NUMBER].toLocaleString("en")} · ${row[ANGLE]} · ${row[STATUS]}`);
    detail.replaceChildren(element("h3", "", row[FILE]), facts, element("p", "", row[WHY]));
    if (shown) detail.append(shown.cloneNode(true));
    else if (row[ROLL] !== null) detail.append(element("p", "note", "This page has no pictures of it: --gallery N shows more frames."));
    detail.querySelectorAll("[id]").forEach(each => each.removeAttribute("id"));
    detail.hidden = false;
  };
  const follow = () => {
    const [, kind, value] = location.hash.match(/^#(frame|row)=(.*)$/s) ?? [];
    if (!kind) return;
    let name = value;
    try { name = decodeURIComponent(value); } catch { /* a name with a bare % is taken as it is */ }
    const place = kind === "frame" ? first.get(name) ?? -1 : Number(value) - 1;
    if (!rows[place]) return;
    select(place);
    detail.parentElement.scrollIntoView({ block: "start" });
  };
  const open = place => {
    if (location.hash === link(place)) follow();
    else location.hash = link(place);
  };

  heads.forEach(head => head.addEventListener("click", () => {
    const column = Number(head.dataset.sort);
    falling = column === sorted && !falling;
    sorted = column;
    arrange();
  }));
  search.addEventListener("input", arrange);
  box.addEventListener("scroll", () => requestAnimationFrame(draw));
  window.addEventListener("resize", draw);
  window.addEventListener("hashchange", follow);
  document.addEventListener("drawn", ({ target }) => target.on("plotly_click", event => {
    const place = each => {
      if (!places) return each.x - 1;
      // the rest of a broken recording has the time of the frame before it
      return each.data.name === "failed" ? places.lastIndexOf(each.x) : places.indexOf(each.x);
    };
    const point = event.points.find(each => each.customdata && rows[place(each)]);
    if (point && target.id !== "histogram") open(place(point));
  }));
  arrange();
  follow();
})();
