"""A chart as SVG: inside of a page, or as a file of its own."""

import html
from collections.abc import Callable

from rollcli.report.drawing.colours import LIGHT
from rollcli.report.drawing.sketch import Area, Item, Line, Marks, Points, Sketch, Words

_NAMESPACE = 'xmlns="http://www.w3.org/2000/svg"'
_FONTS = "system-ui, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif"

Paint = Callable[[str, str], str]  # from an attribute and the name of a colour to attributes


def svg_for_page(sketch: Sketch, kind: str) -> str:
    """Return an element of a page, in the page's colours and font.

    Parameters
    ----------
    sketch : Sketch
    kind : str
        Its class.
    """
    box = f'viewBox="0 0 {sketch.width} {sketch.height}" font-size="{sketch.font:g}"'
    return f'<svg class="{kind}" {box} aria-hidden="true">{_items(sketch, _page_paint)}</svg>'


def svg_file(sketch: Sketch) -> bytes:
    """Return a file of its own: light colours on white, as slides have it."""
    size = f'width="{sketch.width}" height="{sketch.height}" viewBox="0 0 {sketch.width} {sketch.height}"'
    text = (
        f'<svg {_NAMESPACE} {size} role="img" font-family="{_FONTS}" font-size="{sketch.font:g}">\n'
        f"<title>{html.escape(sketch.label)}</title>\n"
        f'<rect width="100%" height="100%" {_file_paint("fill", "card")}/>\n'
        f"{_items(sketch, _file_paint)}</svg>\n"
    )
    return text.encode("utf-8", "replace")


def _page_paint(attribute: str, colour: str) -> str:
    return f'{attribute}="var(--{colour})"'


def _file_paint(attribute: str, colour: str) -> str:
    digits, opacity = LIGHT[colour]
    return f'{attribute}="#{digits}"' + (f' {attribute}-opacity="{opacity:g}"' if opacity < 1 else "")


def _items(sketch: Sketch, paint: Paint) -> str:
    """Return the items; an inner `svg` cuts off what lies outside of the frame."""
    left, top, width, height = sketch.frame
    inside = "".join(f"{_item(each, paint)}\n" for each in sketch.inside)
    around = "".join(f"{_item(each, paint)}\n" for each in sketch.around)
    place = f'x="{left}" y="{top}" width="{width}" height="{height}" overflow="hidden"'
    return f"<svg {place}>\n{inside}</svg>\n{around}"


def _item(item: Item, paint: Paint) -> str:
    if isinstance(item, Line):
        dash = f' stroke-dasharray="{item.dash:g}"' if item.dash else ""
        pen = f'fill="none" {paint("stroke", item.colour)} stroke-width="{item.width:.4g}"{dash}'
        return f'<path d="{_path(item.points)}" {pen}/>'
    if isinstance(item, Area):
        return f'<path d="{_path(item.points)}Z" {paint("fill", item.colour)}/>'
    if isinstance(item, Marks):
        return _marks(item, paint)
    return _words(item, paint)


def _path(points: Points) -> str:
    """Return a path to tenths of a pixel; each point is told by how far it is from the one before."""
    tenths = (points * 10).round().astype(int)
    steps = tenths[1:] - tenths[:-1]
    start = f"M{tenths[0, 0] / 10:g} {tenths[0, 1] / 10:g}"
    return start + "".join(f"l{x / 10:g} {y / 10:g}" for x, y in steps.tolist())


def _marks(marks: Marks, paint: Paint) -> str:
    half = marks.size / 2
    r, d = f"{half:.3g}", f"{2 * half:.3g}"
    shapes = {
        "circle": f"m-{r} 0a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0",
        "diamond": f"m0 -{r}l{r} {r}l-{r} {r}l-{r} -{r}Z",
        "cross": f"m-{r} -{r}l{d} {d}m0 -{d}l-{d} {d}",
    }
    path = "".join(f"M{x:.1f} {y:.1f}{shapes[marks.symbol]}" for x, y in marks.points.tolist())
    if marks.symbol == "cross":
        return f'<path d="{path}" fill="none" {paint("stroke", marks.colour)} stroke-width="{half / 2:.3g}"/>'
    return f'<path d="{path}" {paint("fill", marks.colour)}/>'


def _words(words: Words, paint: Paint) -> str:
    place = f'x="{words.x:.4g}" y="{words.y:.4g}" text-anchor="{words.anchor}"'
    if words.upright:
        place += f' transform="rotate(-90 {words.x:.4g} {words.y:.4g})"'
    return f"<text {place} {paint('fill', words.colour)}>{html.escape(words.text)}</text>"
