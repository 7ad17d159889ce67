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
  const turn = (box, side) => {
    box.dataset.show = side;
    box.querySelectorAll(".switch button").forEach(
      each => each.setAttribute("aria-pressed", String(each.dataset.show === side)));
  };
  document.addEventListener("click", event => {
    const button = event.target.closest(".switch button");
    if (!button) return;
    const boxes = button.closest(".switch-all") ? document.querySelectorAll(".gallery .pictures") : [button.closest(".pictures")];
    boxes.forEach(box => turn(box, button.dataset.show));
  });
  // also from a copy of the pictures, which the table shows
  document.addEventListener("click", event => {
    const caption = event.target.closest(".picture")?.dataset.caption;
    if (caption !== undefined) show(pictures.findIndex(each => each.dataset.caption === caption));
  });
  dialog.querySelectorAll("[data-step]").forEach(
    button => button.addEventListener("click", () => show(current + Number(button.dataset.step))));
  dialog.querySelector("[data-close]").addEventListener("click", () => dialog.close());
  dialog.addEventListener("click", event => { if (event.target === dialog) dialog.close(); });
  dialog.addEventListener("close", () => {
    const side = ["before", "after", "heights"].find(each => pictures[current].classList.contains(each));
    if (side) turn(pictures[current].closest(".pictures"), side);
    pictures[current].focus();
  });
  dialog.addEventListener("keydown", event => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (step) show(current + step);
  });
})();
