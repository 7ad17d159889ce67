(() => {
  // set here, since the page's policy refuses style attributes
  document.querySelectorAll("[data-share]").forEach(each => each.style.setProperty("--share", each.dataset.share));

  const dialog = document.querySelector("dialog"), pictures = [...document.querySelectorAll(".pictures button")];
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
  // also from a copy of the pictures, which the table shows
  document.addEventListener("click", event => {
    const caption = event.target.closest(".pictures button")?.dataset.caption;
    if (caption !== undefined) show(pictures.findIndex(each => each.dataset.caption === caption));
  });
  dialog.querySelectorAll("[data-step]").forEach(
    button => button.addEventListener("click", () => show(current + Number(button.dataset.step))));
  dialog.querySelector("[data-close]").addEventListener("click", () => dialog.close());
  dialog.addEventListener("click", event => { if (event.target === dialog) dialog.close(); });
  dialog.addEventListener("close", () => pictures[current].focus());
  dialog.addEventListener("keydown", event => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (step) show(current + step);
  });
})();
