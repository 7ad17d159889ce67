"""HTML pages with charts that open from disk without a network: what every page shares.

A page extends `page.html` and puts `Chart` objects where it wants them. The styles and scripts of `x.html`
are in `x.css` and `x.js` beside it. A page is shown before `page.js` runs plotly, which takes longer than all
the rest. plotly (its script alone) and jinja2 are the extra `report` and are imported here only, when a page
is made.
"""

import base64
import hashlib
import html
import importlib.resources
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rollcli.pictures.colours import style_sheet

# plotly adds a style sheet for geographic maps unless an element has its id; the policy would refuse it aloud
_STYLE_OF_MAPS = re.compile(r'document\.getElementById\("([0-9a-f]{64})"\)')
_PLOTLY_STYLES = ("",)  # plotly makes an empty style element, which it fills by rules


@dataclass(frozen=True)
class Chart:
    """A chart as plotly's script takes it; prints itself in a template.

    Attributes
    ----------
    name : str
        Its id on the page, and the name of the picture that a reader saves.
    label : str
        What it shows, for those who cannot see it.
    data : sequence of mapping
        The traces. No NaN: None where there is no value. A colour may be "@" and a name of the page's own
        colours, such as "@c1", "@error" or "@muted": these follow light and dark mode.
    layout : mapping
        Titles, ranges, kinds of axes; fonts, margins and colours are the page's.
    still : str
        HTML that shows it until plotly has drawn it, or where no script runs.
    """

    name: str
    label: str
    data: Sequence[Mapping[str, Any]]
    layout: Mapping[str, Any] = field(default_factory=dict)
    still: str = ""

    def __html__(self) -> str:
        """Return the chart's place and its content."""
        content = script_json({"data": self.data, "layout": self.layout})
        name = html.escape(self.name)
        label = html.escape(self.label)
        return (
            f'<div class="chart" id="{name}" role="img" aria-label="{label}">{self.still}</div>'
            f'<script type="application/json" data-chart="{name}">{content}</script>'
        )


def script_json(value: Any) -> str:
    """Return JSON for a script element, which file names in it cannot end."""
    content = json.dumps(value, allow_nan=False)
    for mark in "<>&\u2028\u2029":
        content = content.replace(mark, f"\\u{ord(mark):04x}")
    return content


def render_page(package: str, template: str, *scripts: str, **values: Any) -> bytes:
    """Fill a template that extends `page.html`; whatever it prints is escaped.

    Parameters
    ----------
    package : str
        Whose folder `templates` holds the template.
    template : str
        Its name.
    *scripts : str
        Those beside it that run, without their ending.
    **values
        What it prints; `title` is required by `page.html`.

    Returns
    -------
    bytes
        The page, UTF-8, with plotly's script inside if any runs.
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    environment = Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader("rollcli.report")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    stem = template.removesuffix(".html")
    styles = [style_sheet(), _text("rollcli.report", "page.css"), _text(package, f"{stem}.css")]
    plotly = get_plotlyjs() if scripts else ""
    texts = [_text(package, f"{name}.js") for name in scripts]
    page = environment.get_template(template).render(
        styles=map(Markup, styles),
        scripts=map(Markup, texts),
        plotly=Markup(plotly),
        policy=_policy(styles, [*texts, plotly]),
        unused_styles=_STYLE_OF_MAPS.findall(plotly),
        **values,
    )
    return page.encode("utf-8", "replace")


def _text(package: str, name: str) -> str:
    """Return the text of a style or script beside the templates."""
    return (importlib.resources.files(package) / "templates" / name).read_text("utf-8")


def _policy(styles: Sequence[str], scripts: Sequence[str]) -> str:
    """Return the Content-Security-Policy: only these styles and scripts are active; nothing is requested.

    plotly writes labels with subscripts as elements with a style attribute, which cannot run anything.
    """
    allowed = {"script-src": scripts, "style-src": [*styles, *_PLOTLY_STYLES]}
    sources = [f"{kind} {' '.join(map(_source, texts))}" for kind, texts in allowed.items()]
    fixed = "style-src-attr 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'"
    return "; ".join(["default-src 'none'", *sources, fixed])


def _source(text: str) -> str:
    digest = hashlib.sha256(text.encode("utf-8", "replace")).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"
