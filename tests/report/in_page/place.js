// where on the screen the chart has the mark of a frame
name => {
    const chart = document.getElementById("roll");
    const box = chart.querySelector(".nsewdrag").getBoundingClientRect();
    const escaped = new Option(name).innerHTML;
    for (const trace of chart._fullData) {
        const place = (trace.customdata ?? []).findIndex(each => each?.startsWith(escaped + "<br>"));
        const axis = trace.yaxis === "y2" ? "yaxis2" : "yaxis";
        if (place >= 0) return [box.x + chart._fullLayout.xaxis.d2p(trace.x[place]),
                                box.y + chart._fullLayout[axis].d2p(trace.y[place])];
    }
}
