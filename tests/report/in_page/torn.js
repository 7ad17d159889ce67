// headings in another column than what follows them, and parts that reach beyond their column
() => {
    const main = document.querySelector("main"), gap = parseFloat(getComputedStyle(main).columnGap) || 16;
    const first = each => each.getClientRects()[0];
    const column = each => Math.floor(first(each).left / (720 + gap));
    const seen = each => each.getClientRects().length;
    const headings = [...document.querySelectorAll("h2, h3")].filter(seen);
    const torn = headings.filter(each => {
        let next = each.nextElementSibling;
        while (next && !seen(next)) next = next.nextElementSibling;
        return next && column(next) !== column(each);
    });
    const reaches = (box, each) => box.right > (column(each) + 1) * (720 + gap) || box.bottom > 1041;
    const cut = [...document.querySelectorAll("td, th, .picture, .chart")].filter(seen).filter(
        each => [...each.getClientRects()].some(box => reaches(box, each)));
    return [...torn, ...cut].map(each => each.outerHTML.slice(0, 80));
}
