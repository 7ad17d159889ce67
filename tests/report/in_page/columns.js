// puts pages beside each other as columns, which a browser fills by the rules of pages
() => {
    const size = "width: 720px; height: 1040px; max-width: none; margin: 0; padding: 0";
    document.querySelector("main").style.cssText = `${size}; columns: 720px; column-fill: auto`;
}
