(() => {
  const dialog = document.querySelector("dialog"), pictures = [...document.querySelectorAll(".pictures .picture")];
  let current = 0;
  const show = place => {
    current = (place + pictures.length) % pictures.length;
    const chosen = pictures[current];
    dialog.querySelector("img").src = chosen.querySelector("img").src;
    dialog.querySelector("img").alt = dialog.querySelector("p").textContent = chosen.dataset.caption;
    if (!dialog.open) dialog.showModal();
    const seen = dialog.querySelector("div");
    seen.scrollLeft = (seen.scrollWidth - seen.clientWidth) / 2;
  };
  const boxes = [...document.querySelectorAll(".gallery .pictures")];
  const press = (buttons, shown) => buttons.forEach(
    each => each.setAttribute("aria-pressed", String(shown(each.dataset.show))));
  const turn = (box, side) => {
    box.dataset.show = side;
    press(box.querySelectorAll(".switch button"), each => each === side);
    press(document.querySelectorAll(".switch-all button"), each => boxes.every(box => box.dataset.show === each));
  };
  document.addEventListener("click", event => {
    const button = event.target.closest(".switch button");
    if (!button) return;
    (button.closest(".switch-all") ? boxes : [button.closest(".pictures")]).forEach(box => turn(box, button.dataset.show));
  });
  // also from a copy of the pictures, which the table shows
  document.addEventListener("click", event => {
    const { dataset, innerHTML } = event.target.closest(".picture") ?? {};
    if (dataset) show(pictures.findIndex(each => each.dataset.caption === dataset.caption && each.innerHTML === innerHTML));
  });
  dialog.querySelectorAll("[data-step]").forEach(
    button => button.addEventListener("click", () => show(current + Number(button.dataset.step))));
  dialog.querySelector("[data-close]").addEventListener("click", () => dialog.close());
  dialog.addEventListener("click", event => { if (event.target === dialog) dialog.close(); });
  dialog.addEventListener("close", () => {
    const box = pictures[current].closest(".pictures"), sides = [...pictures[current].classList].slice(1);
    if (sides.length && !sides.includes(box.dataset.show)) turn(box, sides[0]);
    pictures[current].focus();
  });
  dialog.addEventListener("keydown", event => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (step) show(current + step);
  });
})();
