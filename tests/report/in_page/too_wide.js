// what reaches beyond the screen and is not in a part that scrolls
() => [...document.querySelectorAll("main *")].filter(
    each => each.getBoundingClientRect().right > innerWidth + 1 && !each.closest(".wide, .chart")
).map(each => each.outerHTML.slice(0, 80))
