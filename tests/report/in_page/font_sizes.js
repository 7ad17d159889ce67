// the size of the letters of each element that has text of its own
() => [...document.querySelectorAll("main *")].filter(
    each => [...each.childNodes].some(node => node.nodeType === 3 && node.data.trim())
        && !each.closest("dialog, script") && each.getClientRects().length
).map(each => [parseFloat(getComputedStyle(each).fontSize), each.outerHTML.slice(0, 80)])
